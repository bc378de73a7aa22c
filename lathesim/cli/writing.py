"""How every command writes its result: as JSON for programs, as lines and tables for a person, and as a figure."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from lathesim.json_text import written_json


@dataclass(frozen=True)
class CommandResult:
    """What a command found: ``data`` for programs, ``lines`` for a person, and what draws it.

    Values of ``data`` may be numbers, texts, paths, arrays, dataclasses, and mappings and sequences of them. ``lines`` are only made where
    a person reads them, ``figure`` is only called where it is wanted. ``code`` is the exit code.
    """

    schema: str
    data: Mapping[str, Any]
    lines: Iterable[str]
    figure: Callable[[], Any] | None = None
    code: int = 0


def write(result: CommandResult, as_json: bool, save: Path | None = None) -> int:
    """Draw a result to ``save``, write it to the output and return its exit code."""
    if save is not None and result.figure is not None:
        from lathesim.analysis.plots import save_figure

        save_figure(result.figure(), save)
    if as_json:
        click.echo(written_json({"schema": result.schema, **result.data}))
    else:
        for line in result.lines:
            click.echo(line)
        if save is not None and result.figure is not None:
            click.echo(f"See {save}")
    return result.code


@dataclass(frozen=True)
class Heading:
    """The heading of a column: its text, the width of the column (below 0: written from the left), and how numbers under it are written.

    With ``si`` numbers are SI and are written in the unit that stands in the heading, as in ``"width [mm]"``. ``missing`` stands in the
    place of what is no finite number.
    """

    text: str
    width: int
    form: str = ""
    si: bool = False
    missing: str | None = None

    def cell(self, value: Any) -> str:
        """Return a value as the text of a cell; texts stay as they are."""
        text = value if isinstance(value, str) else self._number(value)
        return text.rjust(self.width) if self.width > 0 else text.ljust(-self.width)

    def _number(self, value: float) -> str:
        if self.missing is not None and not math.isfinite(value):
            return self.missing
        if self.si:
            from lathesim.units import from_si

            value = from_si(value, self.text.partition("[")[2].rstrip("]"))
        return f"{value:{self.form}}"


def table(columns: Sequence[Heading], rows: Iterable[Sequence[Any]]) -> Iterator[str]:
    """Yield a table of columns of a given width: the headings, then the rows."""
    yield "".join(column.cell(column.text) for column in columns)
    for row in rows:
        yield "".join(column.cell(value) for column, value in zip(columns, row, strict=True))


def sentence(text: str) -> str:
    """Return a finding as a sentence: with a capital and a full stop."""
    return f"{text[0].upper()}{text[1:].rstrip('.')}."
