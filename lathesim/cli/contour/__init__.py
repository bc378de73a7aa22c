"""Commands: contour control, learning and remedies."""

from __future__ import annotations

from lathesim.cli import commands_of
from lathesim.hookspecs import CommandEntry, hookimpl

_COMMANDS = {
    "Contour control and remedies": (
        ("remedy", "remedy_command:remedy", "Go from a diagnosis to its compensation, with a promise."),
        ("learn", "learning_commands:learn", "Learn from lap to lap what makes a lesson's part better."),
        ("train", "learning_commands:train", "Find the weights of a neural regulator."),
        ("circle", "circle:circle", "Run the circular test of ISO 230-4 on a lesson."),
    )
}


@hookimpl
def register_commands() -> list[CommandEntry]:
    """Return the commands of this room."""
    return commands_of(__name__, _COMMANDS)
