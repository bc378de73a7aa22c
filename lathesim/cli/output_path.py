"""The type of every option that names an output: a path that cannot be written is refused before the work begins."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click


class OutputPath(click.Path):
    """A file to be written, or a ``folder``; with ``makes_folder`` missing folders above a file are made.

    Raises :class:`lathesim.errors.WriteError` if it cannot be written, see :func:`lathesim.whole_file.check_place`.
    """

    def __init__(self, *, folder: bool = False, makes_folder: bool = False, allow_dash: bool = False) -> None:
        super().__init__(path_type=Path, allow_dash=allow_dash)
        self._folder = folder
        self._makes_folder = makes_folder

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the path once it is known that it can be written."""
        from lathesim.whole_file import check_folder, check_output, check_place

        path: Any = super().convert(value, param, ctx)
        if self.allow_dash and str(path) == "-":
            return path
        check = check_folder if self._folder else check_output if self._makes_folder else check_place
        check(path)
        return path
