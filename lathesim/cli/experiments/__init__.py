"""Commands: closed controllers, designed programs, watermarks."""

from __future__ import annotations

from lathesim.hookspecs import CommandEntry, hookimpl

HEADING = "Closed machines and designed programs"


@hookimpl
def register_commands() -> list[CommandEntry]:
    """Return the commands of this room."""
    return [
        CommandEntry("emulate", f"{__name__}.emulate:emulate", "Learn a closed machine from way-points of its programs.", HEADING),
        CommandEntry(
            "experiment",
            f"{__name__}.experiment_command:experiment",
            "Write the part program that separates two explanations best.",
            HEADING,
        ),
        CommandEntry(
            "isolable",
            f"{__name__}.isolable_command:isolable",
            "Show which effects a recording would reveal, and which it could not tell apart.",
            HEADING,
        ),
        CommandEntry(
            "watermark",
            f"{__name__}.watermark:watermark",
            "Show what a watermark costs, and how soon a forged sensor shows.",
            HEADING,
        ),
    ]
