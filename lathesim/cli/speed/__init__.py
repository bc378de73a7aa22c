"""Commands: measure the speed, compile ahead."""

from __future__ import annotations

from lathesim.hookspecs import CommandEntry, hookimpl

HEADING = "Speed"


@hookimpl
def register_commands() -> list[CommandEntry]:
    """Return the commands of this room."""
    return [
        CommandEntry("bench", f"{__name__}.speed_commands:bench", "Measure how fast this machine simulates.", HEADING),
        CommandEntry("warm", f"{__name__}.speed_commands:warm", "Compile what the lessons need, ahead of the first run.", HEADING),
    ]
