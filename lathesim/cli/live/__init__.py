"""Commands: machines that run."""

from __future__ import annotations

from lathesim.hookspecs import CommandEntry, hookimpl

HEADING = "Machines that run"


@hookimpl
def register_commands() -> list[CommandEntry]:
    """Return the commands of this room."""
    return [
        CommandEntry("retime", f"{__name__}.retime_command:retime", "Time a path as quickly as the limits of the axes allow.", HEADING),
        CommandEntry("machine", f"{__name__}.servo_commands:machine", "Run the servo side of a simulated machine.", HEADING),
        CommandEntry("stream", f"{__name__}.servo_commands:stream", "Send set-points to a servo side and take its feedback.", HEADING),
        CommandEntry(
            "twin",
            f"{__name__}.watch_commands:twin",
            "Show machine and simulation beside each other while the machine runs.",
            HEADING,
        ),
        CommandEntry("watch", f"{__name__}.watch_commands:watch", "Watch a machine: when it changed, where, and what that is.", HEADING),
        CommandEntry("publish", f"{__name__}.publish_commands:publish", "Publish a simulated machine over OPC UA and MTConnect.", HEADING),
        CommandEntry("record", f"{__name__}.publish_commands:record", "Record what a machine publishes.", HEADING),
    ]
