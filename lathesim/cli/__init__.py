"""The command line: one verb a file, imported only when it is called. Its own verbs come in by the door below, as those of every room."""

from __future__ import annotations

import gc
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


@hookimpl
def register_commands() -> list[CommandEntry]:
    """Return the commands of the core."""
    return [
        CommandEntry("tui", f"{__name__}.open_app:tui", "Open the terminal app, as lathesim alone does.", "The course"),
        CommandEntry("serve", f"{__name__}.open_app:serve", "Serve the terminal app to a browser.", "The course"),
        CommandEntry(
            "init", f"{__name__}.init_and_check:init", "Copy lessons, programs and plug-ins to a folder to work on.", "The course"
        ),
        CommandEntry("lessons", f"{__name__}.listing:lessons", "List the lessons.", "The course"),
        CommandEntry("run", f"{__name__}.lessons.run_command:run", "Run a lesson: numbers, plots and a record.", "The course"),
        CommandEntry("grade", f"{__name__}.lessons.grade:grade", "Grade records by the goals of their lesson.", "The course"),
        CommandEntry("sweep", f"{__name__}.lessons.sweep:sweep", "Run a lesson over ranges of its parameters.", "The course"),
        CommandEntry("help", f"{__name__}.listing:help_", "List the chapters of the manual, or print one.", "The course"),
        CommandEntry("plot", f"{__name__}.lessons.plot_and_export:plot", "Plot channels of a record.", "Records"),
        CommandEntry("export", f"{__name__}.lessons.plot_and_export:export", "Write a record as CSV or MAT file.", "Records"),
        CommandEntry("program", f"{__name__}.part_program:program", "Check a part program and show its moves.", "Part programs"),
        CommandEntry("new-program", f"{__name__}.part_program:new_program", "Write a part program from a few numbers.", "Part programs"),
        CommandEntry("wiring", f"{__name__}.listing:wiring", "Show how the parts of a lesson's machine are wired.", "Machines"),
        CommandEntry("components", f"{__name__}.listing:components", "List the machine parts, or show the page of one.", "Machines"),
        CommandEntry(
            "effects", f"{__name__}.listing:effects", "List the effects that can be left out, or show the page of one.", "Machines"
        ),
        CommandEntry("plugins", f"{__name__}.listing:plugins", "List what was registered, from where, and what is at fault.", "Machines"),
        CommandEntry(
            "check", f"{__name__}.init_and_check:check", "Check lessons, machine templates, part programs and plug-ins.", "Machines"
        ),
        CommandEntry("fmu", f"{__name__}.lessons.fmu_command:fmu", "Write a machine or a part as an FMU, for other tools.", "Machines"),
        CommandEntry("schema", f"{__name__}.listing:schema", "Print the JSON Schema of a lesson, for editors.", "Machines"),
        CommandEntry(
            "class", f"{__name__}.lessons.class_commands:class_", "Make machines for a class, and grade what it hands in.", "For teachers"
        ),
        CommandEntry(
            "sheet",
            f"{__name__}.lessons.class_commands:sheet",
            "Write a lesson as a sheet to print, with room for answers.",
            "For teachers",
        ),
        CommandEntry("notebook", f"{__name__}.lessons.class_commands:notebook", "Write a lesson as a Jupyter notebook.", "For teachers"),
    ]
