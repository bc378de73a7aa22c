"""Commands: contour control, learning and remedies."""

from __future__ import annotations

from lathesim.hookspecs import CommandEntry, hookimpl

HEADING = "Contour control and remedies"


@hookimpl
def register_commands() -> list[CommandEntry]:
    """Return the commands of this room."""
    return [
        CommandEntry("remedy", f"{__name__}.remedy_command:remedy", "Go from a diagnosis to its compensation, with a promise.", HEADING),
        CommandEntry("learn", f"{__name__}.learning_commands:learn", "Learn from lap to lap what makes a lesson's part better.", HEADING),
        CommandEntry("train", f"{__name__}.learning_commands:train", "Find the weights of a neural regulator.", HEADING),
        CommandEntry("circle", f"{__name__}.circle:circle", "Run the circular test of ISO 230-4 on a lesson.", HEADING),
    ]
