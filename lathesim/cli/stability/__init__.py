"""Commands: chatter, from the tap of a hammer to the map."""

from __future__ import annotations

from lathesim.cli import commands_of
from lathesim.hookspecs import CommandEntry, ScreenEntry, hookimpl

_COMMANDS = {
    "Chatter": (
        ("lobes", "lobes_command:lobes", "Show up to which chip width a cut is stable, over the speed."),
        ("tap", "tool_point_commands:tap", "Hit a tool point with a hammer: its frequency response."),
        ("modes", "tool_point_commands:modes", "Find the modes in a frequency response."),
        ("couple", "tool_point_commands:couple", "Show the receptance of the tip of parts put together."),
        ("cuts", "cuts_command:cuts", "Learn a stability map from cuts, and propose the next one."),
        ("chatter", "chatter_command:chatter", "Name what makes a recorded cut vibrate."),
    )
}


@hookimpl
def register_commands() -> list[CommandEntry]:
    """Return the commands of this room."""
    return commands_of(__name__, _COMMANDS)


@hookimpl
def register_screens() -> list[ScreenEntry]:
    """Return the views that open over the machine of a lesson."""
    views = "lathesim.tui.screens.views"
    tap = "Tap the tool with a hammer, or put its beams together, and fit its modes"
    return [
        ScreenEntry("tool_point", f"{views}:ToolPointView", "k", "Tool point", "configure", tap),
        ScreenEntry("lobes", f"{views}:LobesView", "l", "Lobes", "configure", "Show the stability lobes of the lesson's cut"),
    ]
