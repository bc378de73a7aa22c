"""Commands: chatter, from the tap of a hammer to the map."""

from __future__ import annotations

from lathesim.hookspecs import CommandEntry, ScreenEntry, hookimpl

HEADING = "Chatter"


@hookimpl
def register_commands() -> list[CommandEntry]:
    """Return the commands of this room."""
    return [
        CommandEntry(
            "lobes", "lathesim.cli.stability.lobes:lobes", "Show up to which chip width a cut is stable, over the speed.", HEADING
        ),
        CommandEntry("tap", "lathesim.cli.stability.tap:tap", "Hit a tool point with a hammer: its frequency response.", HEADING),
        CommandEntry("modes", "lathesim.cli.stability.modes:modes", "Find the modes in a frequency response.", HEADING),
        CommandEntry("couple", "lathesim.cli.stability.couple:couple", "Show the receptance of the tip of parts put together.", HEADING),
        CommandEntry("cuts", "lathesim.cli.stability.cuts:cuts", "Learn a stability map from cuts, and propose the next one.", HEADING),
        CommandEntry("chatter", "lathesim.cli.stability.chatter:chatter", "Name what makes a recorded cut vibrate.", HEADING),
    ]


@hookimpl
def register_screens() -> list[ScreenEntry]:
    """Return the views that open over the machine of a lesson."""
    views = "lathesim.tui.screens.stability_views"
    tap = "Tap the tool with a hammer, or put its beams together, and fit its modes"
    return [
        ScreenEntry("tool_point", f"{views}:ToolPointView", "k", "Tool point", "configure", tap),
        ScreenEntry("lobes", f"{views}:LobesView", "l", "Lobes", "configure", "Show the stability lobes of the lesson's cut"),
    ]
