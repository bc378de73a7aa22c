"""Where the lessons, machine templates, part programs and sample plug-ins that come with lathesim are.

In an installed wheel they lie in ``lathesim/shipped/``; in a checkout of the sources at its top level.
"""

from __future__ import annotations

from pathlib import Path

from lathesim.errors import LatheSimError

FOLDERS = ("lesson_configs", "part_programs", "plugins")
SOLUTIONS = ("teacher/*", "*_solution.md", "*_search.py", "*_designed.nc")
"""Names of shipped files with solutions of lessons, for teachers."""


def shipped_folder(name: str) -> Path:
    """Return the folder ``lesson_configs``, ``part_programs`` or ``plugins`` that came with the program."""
    package = Path(__file__).parent
    for top in (package / "shipped", package.parent):
        if (top / name).is_dir():
            return top / name
    raise LatheSimError(f"the folder '{name}' did not come with this installation.", remedy="Install lathesim again.")


def shipped_files(name: str, pattern: str) -> list[Path]:
    """Return the files of a shipped folder that match, sorted by name."""
    return sorted(path for path in shipped_folder(name).glob(pattern) if path.is_file())
