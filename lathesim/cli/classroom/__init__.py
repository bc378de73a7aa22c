"""Commands: exercises for a class."""

from __future__ import annotations

from lathesim.hookspecs import CommandEntry, hookimpl

HEADING = "For teachers"


@hookimpl
def register_commands() -> list[CommandEntry]:
    """Return the commands of this room."""
    return [
        CommandEntry("class", f"{__name__}.class_commands:class_", "Make machines for a class, and grade what it hands in.", HEADING),
        CommandEntry("sheet", f"{__name__}.class_commands:sheet", "Write a lesson as a sheet to print, with room for answers.", HEADING),
    ]
