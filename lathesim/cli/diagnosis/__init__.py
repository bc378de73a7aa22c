"""Commands: recordings against simulations."""

from __future__ import annotations

from lathesim.hookspecs import CommandEntry, ScreenEntry, hookimpl

HEADING = "Recordings against the simulation"


@hookimpl
def register_commands() -> list[CommandEntry]:
    """Return the commands of this room."""
    return [
        CommandEntry("compare", "lathesim.cli.diagnosis.compare:compare", "Compare a recording with the simulation of a lesson.", HEADING),
        CommandEntry("diagnose", "lathesim.cli.diagnosis.diagnose:diagnose", "Name the physics that a simulation left out.", HEADING),
        CommandEntry("conceal", "lathesim.cli.diagnosis.conceal:conceal", "Make a recording with an effect hidden in it.", HEADING),
        CommandEntry("reveal", "lathesim.cli.diagnosis.reveal:reveal", "Open the sealed answer of a concealed recording.", HEADING),
        CommandEntry("fit", "lathesim.cli.diagnosis.fit:fit", "Fit parameters of a lesson to a recording.", HEADING),
    ]


@hookimpl
def register_screens() -> list[ScreenEntry]:
    """Return the screen of the detective."""
    return [ScreenEntry("detective", "lathesim.tui.screens.detective:DetectiveScreen", "f7", "Detective")]
