"""Commands: closed controllers, designed programs, watermarks."""

from __future__ import annotations

from lathesim.cli import commands_of
from lathesim.hookspecs import CommandEntry, hookimpl

_COMMANDS = {
    "Closed machines and designed programs": (
        ("emulate", "emulate:emulate", "Learn a closed machine from way-points of its programs."),
        ("experiment", "experiment_command:experiment", "Write the part program that separates two explanations best."),
        ("isolable", "isolable_command:isolable", "Show which effects a recording would reveal, and which it could not tell apart."),
        ("watermark", "watermark:watermark", "Show what a watermark costs, and how soon a forged sensor shows."),
    )
}


@hookimpl
def register_commands() -> list[CommandEntry]:
    """Return the commands of this room."""
    return commands_of(__name__, _COMMANDS)
