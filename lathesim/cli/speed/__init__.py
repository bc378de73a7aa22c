"""Commands: measure the speed, compile ahead."""

from __future__ import annotations

from lathesim.cli import commands_of
from lathesim.hookspecs import CommandEntry, hookimpl

_COMMANDS = {
    "Speed": (
        ("bench", "speed_commands:bench", "Measure how fast this machine simulates."),
        ("warm", "speed_commands:warm", "Compile what the lessons need, ahead of the first run."),
    )
}


@hookimpl
def register_commands() -> list[CommandEntry]:
    """Return the commands of this room."""
    return commands_of(__name__, _COMMANDS)
