"""Commands: machines that run."""

from __future__ import annotations

from lathesim.hookspecs import CommandEntry, hookimpl

HEADING = "Machines that run"


@hookimpl
def register_commands() -> list[CommandEntry]:
    """Return the commands of this room."""
    return [
        CommandEntry("retime", "lathesim.cli.live.retime:retime", "Time a path as quickly as the limits of the axes allow.", HEADING),
        CommandEntry("machine", "lathesim.cli.live.machine:machine", "Run the servo side of a simulated machine.", HEADING),
        CommandEntry("stream", "lathesim.cli.live.stream:stream", "Send set-points to a servo side and take its feedback.", HEADING),
        CommandEntry(
            "twin", "lathesim.cli.live.twin:twin", "Show machine and simulation beside each other while the machine runs.", HEADING
        ),
        CommandEntry("watch", "lathesim.cli.live.watch:watch", "Watch a machine: when it changed, where, and what that is.", HEADING),
        CommandEntry("publish", "lathesim.cli.live.publish:publish", "Publish a simulated machine over OPC UA and MTConnect.", HEADING),
        CommandEntry("record", "lathesim.cli.live.record:record", "Record what a machine publishes.", HEADING),
    ]
