"""The terminal app. ``model`` and ``drawing`` know nothing of Textual; ``widgets`` and ``screens`` show what they hold.

Its own screens come in by the door below, as those of every room do.
"""

from __future__ import annotations

from lathesim.hookspecs import ScreenEntry, hookimpl

_SCREENS = "lathesim.tui.screens"
_ENTRIES = (
    ("help", "help:HelpScreen", "f1", "Help", "", "Read the manual, and a page for each part and effect"),
    ("bench", "bench_screen:BenchScreen", "f2", "Bench", "", "Run a lesson and watch the part being turned; play a run again"),
    ("results", "results:ResultsScreen", "f3", "Results", "", "Compare runs: curves, metrics, figures and files"),
    ("configure", "configure:ConfigureScreen", "f4", "Configure", "", "Change the machine: values, parts, effects, part program"),
    ("lessons", "lessons:LessonsScreen", "f6", "Lessons", "", "Choose a lesson: what it teaches, its goals, hints and questions"),
    ("plugins", "help:PluginsScreen", "f8", "Plug-ins", "", "See what is loaded and what is at fault; load again"),
    ("sweep", "views:sweep_form", "w", "Sweep", "bench", "Run the lesson over ranges of its parameters"),
    ("circle", "views:circle_form", "o", "Circle", "bench", "Run the circular test of ISO 230-4 on the lesson"),
    ("grade", "views:grade_form", "k", "Grade", "results", "Hold records against the goals of the lesson on the bench"),
    ("isolable", "views:isolable_form", "a", "Ask first", "detective", "See what a recording would show, before it is made"),
    ("remedy", "views:remedy_form", "r", "Remedy", "detective", "Go from a diagnosis to its compensation, with a promise"),
    ("class_new", "views:class_form", "l", "New class", "lessons", "Make a machine for each student from the lesson on the bench"),
    ("class_grade", "views:class_grade_form", "g", "Grade a class", "lessons", "Grade what a class handed in"),
)
"""Name, where it is, key, title, the screen below where there is one, and what it is for."""


@hookimpl
def register_screens() -> list[ScreenEntry]:
    """Return the screens of the core, and the forms that open over them."""
    return [ScreenEntry(name, f"{_SCREENS}.{target}", *further) for name, target, *further in _ENTRIES]
