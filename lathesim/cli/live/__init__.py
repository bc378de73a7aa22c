"""Commands: machines that run."""

from __future__ import annotations

from lathesim.cli import commands_of
from lathesim.hookspecs import CommandEntry, hookimpl

_COMMANDS = {
    "Machines that run": (
        ("retime", "retime_command:retime", "Time a path as quickly as the limits of the axes allow."),
        ("machine", "servo_commands:machine", "Run the servo side of a simulated machine."),
        ("stream", "servo_commands:stream", "Send set-points to a servo side and take its feedback."),
        ("twin", "watch_commands:twin", "Show machine and simulation beside each other while the machine runs."),
        ("watch", "watch_commands:watch", "Watch a machine: when it changed, where, and what that is."),
        ("publish", "publish_commands:publish", "Publish a simulated machine over OPC UA and MTConnect."),
        ("record", "publish_commands:record", "Record what a machine publishes."),
    )
}


@hookimpl
def register_commands() -> list[CommandEntry]:
    """Return the commands of this room."""
    return commands_of(__name__, _COMMANDS)
