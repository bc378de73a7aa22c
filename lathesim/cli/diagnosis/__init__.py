"""Commands: recordings against simulations."""

from __future__ import annotations

from lathesim.hookspecs import CommandEntry, ScreenEntry, hookimpl

HEADING = "Recordings against the simulation"


@hookimpl
def register_commands() -> list[CommandEntry]:
    """Return the commands of this room."""
    return [
        CommandEntry("look", f"{__name__}.look_command:look", "Show what a recording holds, and propose a lesson for it.", HEADING),
        CommandEntry("compare", f"{__name__}.compare_and_fit:compare", "Compare a recording with the simulation of a lesson.", HEADING),
        CommandEntry("diagnose", f"{__name__}.diagnose_command:diagnose", "Name the physics that a simulation left out.", HEADING),
        CommandEntry("conceal", f"{__name__}.conceal_commands:conceal", "Make a recording with an effect hidden in it.", HEADING),
        CommandEntry("reveal", f"{__name__}.conceal_commands:reveal", "Open the sealed answer of a concealed recording.", HEADING),
        CommandEntry("fit", f"{__name__}.compare_and_fit:fit", "Fit parameters of a lesson to a recording.", HEADING),
    ]


@hookimpl
def register_screens() -> list[ScreenEntry]:
    """Return the screen of the detective."""
    about = "Hold a recording against the simulation, guess, diagnose"
    return [ScreenEntry("detective", "lathesim.tui.screens.detective:DetectiveScreen", "f7", "Detective", about=about)]
