"""The command line: one verb a file, imported only when it is called. Its own verbs come in by the door below, as those of every room."""

from __future__ import annotations

from lathesim.hookspecs import CommandEntry, hookimpl


@hookimpl
def register_commands() -> list[CommandEntry]:
    """Return the commands of the core."""
    return [
        CommandEntry("tui", "lathesim.cli.open_app:tui", "Open the terminal app, as lathesim alone does.", "The course"),
        CommandEntry("serve", "lathesim.cli.open_app:serve", "Serve the terminal app to a browser.", "The course"),
        CommandEntry("init", "lathesim.cli.parts.init:init", "Copy lessons, programs and plug-ins to a folder to work on.", "The course"),
        CommandEntry("lessons", "lathesim.cli.listing:lessons", "List the lessons.", "The course"),
        CommandEntry("run", "lathesim.cli.lessons.run:run", "Run a lesson: numbers, plots and a record.", "The course"),
        CommandEntry("grade", "lathesim.cli.lessons.grade:grade", "Grade records by the goals of their lesson.", "The course"),
        CommandEntry("sweep", "lathesim.cli.lessons.sweep:sweep", "Run a lesson over ranges of its parameters.", "The course"),
        CommandEntry("help", "lathesim.cli.listing:help_", "List the chapters of the manual, or print one.", "The course"),
        CommandEntry("plot", "lathesim.cli.lessons.records:plot", "Plot channels of a record.", "Records"),
        CommandEntry("export", "lathesim.cli.lessons.records:export", "Write a record as CSV or MAT file.", "Records"),
        CommandEntry("program", "lathesim.cli.part_program:program", "Check a part program and show its moves.", "Part programs"),
        CommandEntry("new-program", "lathesim.cli.part_program:new_program", "Write a part program from a few numbers.", "Part programs"),
        CommandEntry("wiring", "lathesim.cli.parts.wiring:wiring", "Show how the parts of a lesson's machine are wired.", "Machines"),
        CommandEntry("components", "lathesim.cli.listing:components", "List the machine parts, or show the page of one.", "Machines"),
        CommandEntry(
            "effects", "lathesim.cli.listing:effects", "List the effects that can be left out, or show the page of one.", "Machines"
        ),
        CommandEntry("plugins", "lathesim.cli.listing:plugins", "List what was registered, from where, and what is at fault.", "Machines"),
        CommandEntry(
            "check", "lathesim.cli.parts.check:check", "Check lessons, machine templates, part programs and plug-ins.", "Machines"
        ),
        CommandEntry("schema", "lathesim.cli.listing:schema", "Print the JSON Schema of a lesson, for editors.", "Machines"),
    ]
