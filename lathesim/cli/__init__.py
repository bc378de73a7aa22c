"""The command line: one verb a file, imported only when it is called. Its own verbs come in by the door below, as those of every room."""

from __future__ import annotations

import gc
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from lathesim.hookspecs import CommandEntry, hookimpl

if TYPE_CHECKING:
    from lathesim.plugins import Registry

gc.set_threshold(50_000, 20, 20)  # what is imported stays; searching it for garbage again and again finds none

STOPPED = 130
"""Exit code of work that Ctrl-C ended."""


def tell_problems(registry: Registry) -> None:
    """Write the plug-ins at fault to the error stream."""
    import click

    for problem in registry.problems:
        click.echo(f"Left out: {problem}", err=True)


def commands_of(room: str, table: Mapping[str, Sequence[tuple[str, str, str]]]) -> list[CommandEntry]:
    """Return the commands of a room: under each heading rows of a name, the place in the room and the sentence."""
    rows = [(heading, *row) for heading, rows in table.items() for row in rows]
    return [CommandEntry(name, f"{room}.{place}", sentence, heading) for heading, name, place, sentence in rows]


_COMMANDS = {
    "The course": (
        ("tui", "open_app:tui", "Open the terminal app, as lathesim alone does."),
        ("serve", "open_app:serve", "Serve the terminal app to a browser."),
        ("init", "init_and_check:init", "Copy lessons, programs and plug-ins to a folder to work on."),
        ("lessons", "listing:lessons", "List the lessons."),
        ("run", "lessons.run_command:run", "Run a lesson: numbers, plots and a record."),
        ("grade", "lessons.grade:grade", "Grade records by the goals of their lesson."),
        ("sweep", "lessons.sweep:sweep", "Run a lesson over ranges of its parameters."),
        ("help", "listing:help_", "List the chapters of the manual, or print one."),
    ),
    "Records": (
        ("plot", "lessons.plot_and_export:plot", "Plot channels of a record."),
        ("export", "lessons.plot_and_export:export", "Write a record as CSV or MAT file."),
    ),
    "Part programs": (
        ("program", "part_program:program", "Check a part program and show its moves."),
        ("new-program", "part_program:new_program", "Write a part program from a few numbers."),
    ),
    "Machines": (
        ("wiring", "listing:wiring", "Show how the parts of a lesson's machine are wired."),
        ("components", "listing:components", "List the machine parts, or show the page of one."),
        ("effects", "listing:effects", "List the effects that can be left out, or show the page of one."),
        ("plugins", "listing:plugins", "List what was registered, from where, and what is at fault."),
        ("check", "init_and_check:check", "Check lessons, machine templates, part programs and plug-ins."),
        ("fmu", "lessons.fmu_command:fmu", "Write a machine or a part as an FMU, for other tools."),
        ("schema", "listing:schema", "Print the JSON Schema of a lesson, for editors."),
    ),
    "For teachers": (
        ("class", "lessons.class_commands:class_", "Make machines for a class, and grade what it hands in."),
        ("sheet", "lessons.class_commands:sheet", "Write a lesson as a sheet to print, with room for answers."),
        ("notebook", "lessons.class_commands:notebook", "Write a lesson as a Jupyter notebook."),
    ),
}


@hookimpl
def register_commands() -> list[CommandEntry]:
    """Return the commands of the core."""
    return commands_of(__name__, _COMMANDS)
