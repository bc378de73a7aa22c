"""The terminal app. ``model`` and ``drawing`` know nothing of Textual; ``widgets`` and ``screens`` show what they hold.

Its own screens come in by the door below, as those of every room do.
"""

from __future__ import annotations

from lathesim.hookspecs import ScreenEntry, hookimpl

_SCREENS = "lathesim.tui.screens"


@hookimpl
def register_screens() -> list[ScreenEntry]:
    """Return the screens of the core."""
    return [
        ScreenEntry("help", f"{_SCREENS}.help:HelpScreen", "f1", "Help", about="Read the manual, and a page for each part and effect"),
        ScreenEntry(
            "bench",
            f"{_SCREENS}.bench_screen:BenchScreen",
            "f2",
            "Bench",
            about="Run a lesson and watch the part being turned; play a run again",
        ),
        ScreenEntry(
            "results", f"{_SCREENS}.results:ResultsScreen", "f3", "Results", about="Compare runs: curves, metrics, figures and files"
        ),
        ScreenEntry(
            "configure",
            f"{_SCREENS}.configure:ConfigureScreen",
            "f4",
            "Configure",
            about="Change the machine: values, parts, effects, part program",
        ),
        ScreenEntry(
            "lessons",
            f"{_SCREENS}.lessons:LessonsScreen",
            "f6",
            "Lessons",
            about="Choose a lesson: what it teaches, its goals, hints and questions",
        ),
        ScreenEntry(
            "plugins", f"{_SCREENS}.help:PluginsScreen", "f8", "Plug-ins", about="See what is loaded and what is at fault; load again"
        ),
    ]
