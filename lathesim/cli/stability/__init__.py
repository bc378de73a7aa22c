"""Commands: chatter, from the tap of a hammer to the map."""

from __future__ import annotations

from lathesim.hookspecs import CommandEntry, ScreenEntry, hookimpl

HEADING = "Chatter"


@hookimpl
def register_commands() -> list[CommandEntry]:
    """Return the commands of this room."""
    return [
        CommandEntry("lobes", f"{__name__}.lobes_command:lobes", "Show up to which chip width a cut is stable, over the speed.", HEADING),
        CommandEntry("tap", f"{__name__}.tool_point_commands:tap", "Hit a tool point with a hammer: its frequency response.", HEADING),
        CommandEntry("modes", f"{__name__}.tool_point_commands:modes", "Find the modes in a frequency response.", HEADING),
        CommandEntry("couple", f"{__name__}.tool_point_commands:couple", "Show the receptance of the tip of parts put together.", HEADING),
        CommandEntry("cuts", f"{__name__}.cuts_command:cuts", "Learn a stability map from cuts, and propose the next one.", HEADING),
        CommandEntry("chatter", f"{__name__}.chatter_command:chatter", "Name what makes a recorded cut vibrate.", HEADING),
    ]


@hookimpl
def register_screens() -> list[ScreenEntry]:
    """Return the views that open over the machine of a lesson."""
    views = "lathesim.tui.screens.views"
    tap = "Tap the tool with a hammer, or put its beams together, and fit its modes"
    return [
        ScreenEntry("tool_point", f"{views}:ToolPointView", "k", "Tool point", "configure", tap),
        ScreenEntry("lobes", f"{views}:LobesView", "l", "Lobes", "configure", "Show the stability lobes of the lesson's cut"),
    ]
