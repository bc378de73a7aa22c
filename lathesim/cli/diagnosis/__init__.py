"""Commands: recordings against simulations."""

from __future__ import annotations

from lathesim.cli import commands_of
from lathesim.hookspecs import CommandEntry, ScreenEntry, hookimpl

_COMMANDS = {
    "Recordings against the simulation": (
        ("look", "look_command:look", "Show what a recording holds, and propose a lesson for it."),
        ("compare", "compare_and_fit:compare", "Compare a recording with the simulation of a lesson."),
        ("diagnose", "diagnose_command:diagnose", "Name the physics that a simulation left out."),
        ("conceal", "conceal_commands:conceal", "Make a recording with an effect hidden in it."),
        ("reveal", "conceal_commands:reveal", "Open the sealed answer of a concealed recording."),
        ("fit", "compare_and_fit:fit", "Fit parameters of a lesson to a recording."),
    )
}


@hookimpl
def register_commands() -> list[CommandEntry]:
    """Return the commands of this room."""
    return commands_of(__name__, _COMMANDS)


@hookimpl
def register_screens() -> list[ScreenEntry]:
    """Return the screen of the detective."""
    about = "Hold a recording against the simulation, guess, diagnose"
    return [ScreenEntry("detective", "lathesim.tui.screens.detective:DetectiveScreen", "f7", "Detective", about=about)]
