"""Commands: closed controllers, designed programs, watermarks."""

from __future__ import annotations

from lathesim.hookspecs import CommandEntry, hookimpl

HEADING = "Closed machines and designed programs"


@hookimpl
def register_commands() -> list[CommandEntry]:
    """Return the commands of this room."""
    return [
        CommandEntry(
            "emulate", "lathesim.cli.experiments.emulate:emulate", "Learn a closed machine from way-points of its programs.", HEADING
        ),
        CommandEntry(
            "experiment", "lathesim.cli.experiments.experiment:experiment", "Write the next part program: the one that tells most.", HEADING
        ),
        CommandEntry(
            "watermark",
            "lathesim.cli.experiments.watermark:watermark",
            "Show what a watermark costs, and how soon a forged sensor shows.",
            HEADING,
        ),
    ]
