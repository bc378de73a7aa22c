"""The command ``lathesim``: a group whose commands are imported only when they are called, so that it starts at once.

Exit codes: 0 done, 1 the input is at fault (one message), 2 wrong usage, 3 a fault of the program, 130 stopped with Ctrl-C.
"""

from __future__ import annotations

import importlib
import io
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

import lathesim
from lathesim.cli.options import STOPPED
from lathesim.errors import LatheSimError

INPUT_FAULT, USAGE, PROGRAM_FAULT = 1, 2, 3

SECTIONS: dict[str, dict[str, tuple[str, str]]] = {
    "The course": {
        "tui": ("lathesim.cli.open_app:tui", "Open the terminal app, as lathesim alone does."),
        "serve": ("lathesim.cli.open_app:serve", "Serve the terminal app to a browser."),
        "init": ("lathesim.cli.parts.init:init", "Copy lessons, programs and plug-ins to a folder to work on."),
        "lessons": ("lathesim.cli.listing:lessons", "List the lessons."),
        "run": ("lathesim.cli.lessons.run:run", "Run a lesson: numbers, plots and a record."),
        "grade": ("lathesim.cli.lessons.grade:grade", "Grade records by the goals of their lesson."),
        "sweep": ("lathesim.cli.lessons.sweep:sweep", "Run a lesson over ranges of its parameters."),
        "help": ("lathesim.cli.listing:help_", "List the chapters of the manual, or print one."),
    },
    "Records": {
        "plot": ("lathesim.cli.lessons.records:plot", "Plot channels of a record."),
        "export": ("lathesim.cli.lessons.records:export", "Write a record as CSV or MAT file."),
    },
    "Part programs": {
        "program": ("lathesim.cli.part_program:program", "Check a part program and show its moves."),
        "new-program": ("lathesim.cli.part_program:new_program", "Write a part program from a few numbers."),
    },
    "Machines": {
        "wiring": ("lathesim.cli.parts.wiring:wiring", "Show how the parts of a lesson's machine are wired."),
        "components": ("lathesim.cli.listing:components", "List the machine parts, or show the page of one."),
        "effects": ("lathesim.cli.listing:effects", "List the effects that can be left out, or show the page of one."),
        "plugins": ("lathesim.cli.listing:plugins", "List what was registered, from where, and what is at fault."),
        "check": ("lathesim.cli.parts.check:check", "Check lessons, machine templates, part programs and plug-ins."),
        "schema": ("lathesim.cli.listing:schema", "Print the JSON Schema of a lesson, for editors."),
    },
    "Recordings against the simulation": {
        "compare": ("lathesim.cli.diagnosis.compare:compare", "Compare a recording with the simulation of a lesson."),
        "diagnose": ("lathesim.cli.diagnosis.diagnose:diagnose", "Name the physics that a simulation left out."),
        "conceal": ("lathesim.cli.diagnosis.conceal:conceal", "Make a recording with an effect hidden in it."),
        "reveal": ("lathesim.cli.diagnosis.reveal:reveal", "Open the sealed answer of a concealed recording."),
        "fit": ("lathesim.cli.diagnosis.fit:fit", "Fit parameters of a lesson to a recording."),
    },
    "Contour control and remedies": {
        "remedy": ("lathesim.cli.contour.remedy:remedy", "Go from a diagnosis to its compensation, with a promise."),
        "learn": ("lathesim.cli.contour.learn:learn", "Learn from lap to lap what makes a lesson's part better."),
        "train": ("lathesim.cli.contour.train:train", "Find the weights of a neural regulator."),
        "circle": ("lathesim.cli.contour.circle:circle", "Run the circular test of ISO 230-4 on a lesson."),
    },
    "Closed machines and designed programs": {
        "emulate": ("lathesim.cli.experiments.emulate:emulate", "Learn a closed machine from way-points of its programs."),
        "experiment": ("lathesim.cli.experiments.experiment:experiment", "Write the next part program: the one that tells most."),
        "watermark": (
            "lathesim.cli.experiments.watermark:watermark",
            "Show what a watermark costs, and how soon a forged sensor shows.",
        ),
    },
    "Chatter": {
        "lobes": ("lathesim.cli.stability.lobes:lobes", "Show up to which chip width a cut is stable, over the speed."),
        "tap": ("lathesim.cli.stability.tap:tap", "Hit a tool point with a hammer: its frequency response."),
        "modes": ("lathesim.cli.stability.modes:modes", "Find the modes in a frequency response."),
        "couple": ("lathesim.cli.stability.couple:couple", "Show the receptance of the tip of parts put together."),
        "cuts": ("lathesim.cli.stability.cuts:cuts", "Learn a stability map from cuts, and propose the next one."),
        "chatter": ("lathesim.cli.stability.chatter:chatter", "Name what makes a recorded cut vibrate."),
    },
    "Machines that run": {
        "retime": ("lathesim.cli.live.retime:retime", "Time a path as quickly as the limits of the axes allow."),
        "machine": ("lathesim.cli.live.machine:machine", "Run the servo side of a simulated machine."),
        "stream": ("lathesim.cli.live.stream:stream", "Send set-points to a servo side and take its feedback."),
        "twin": ("lathesim.cli.live.twin:twin", "Show machine and simulation beside each other while the machine runs."),
        "watch": ("lathesim.cli.live.watch:watch", "Watch a machine: when it changed, where, and what that is."),
        "publish": ("lathesim.cli.live.publish:publish", "Publish a simulated machine over OPC UA and MTConnect."),
        "record": ("lathesim.cli.live.record:record", "Record what a machine publishes."),
    },
    "Speed": {
        "bench": ("lathesim.cli.speed.bench:bench", "Measure how fast this machine simulates."),
        "warm": ("lathesim.cli.speed.warm:warm", "Compile what the lessons need, ahead of the first run."),
    },
}
"""Heading of a section of ``lathesim --help`` -> command -> where it stands and what it does."""

COMMANDS = {name: entry for commands in SECTIONS.values() for name, entry in commands.items()}


class LazyGroup(click.Group):
    """A group that knows its commands by a table and imports each when it is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of the commands, in the order of the table."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import a command."""
        if cmd_name not in COMMANDS:
            return None
        module, _, attribute = COMMANDS[cmd_name][0].partition(":")
        try:
            found = importlib.import_module(module)
        except ModuleNotFoundError as error:
            if error.name != module:
                raise
            raise click.UsageError(f"the command '{cmd_name}' is not part of this version.") from None
        command: click.Command = getattr(found, attribute)
        return command

    def resolve_command(self, ctx: click.Context, args: list[str]) -> tuple[str | None, click.Command | None, list[str]]:
        """Find the command that was asked for, or name the nearest one."""
        if args and args[0] not in COMMANDS and not args[0].startswith("-"):
            from lathesim.errors import nearest

            ctx.fail(f"there is no command '{args[0]}'. {nearest(args[0], COMMANDS)}".strip())
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the commands by sections from the table, without importing any."""
        for title, commands in SECTIONS.items():
            with formatter.section(title):
                formatter.write_dl([(name, sentence) for name, (_, sentence) in commands.items()])


@click.group(
    cls=LazyGroup,
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
    epilog="Exit codes: 0 done, 1 the input is at fault, 2 wrong usage, 3 a fault of the program, 130 stopped with Ctrl-C.",
)
@click.version_option(lathesim.__version__, prog_name="lathesim")
@click.pass_context
def group(ctx: click.Context) -> int | None:
    """A machine-tool simulator for teaching. Without a command it opens the terminal app."""
    if ctx.invoked_subcommand is not None:
        return None
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        click.echo(ctx.get_help())
        return None
    from lathesim.cli.open_app import open_app

    return open_app()


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and leave with its exit code."""
    _start_lightly()
    sys.exit(run_command_line(arguments))


def _start_lightly() -> None:
    """Print in any encoding, and spare the start what it does not need: together a tenth of a second."""
    import gc
    import os

    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # characters outside the terminal's encoding are replaced
    gc.set_threshold(50_000, 20, 20)  # what is imported stays; searching it for garbage again and again finds none
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")  # else all installed packages are searched for them
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # matrices are too small to be shared among cores, which wait for each other


def _tell_new_names(arguments: Sequence[str]) -> None:
    """Print the present names of lessons that a command line calls by their former ones."""
    numbered = [text.removeprefix("sim:") for text in arguments if re.fullmatch(r"(sim:)?\d\d_\w+", text)]
    if not numbered:
        return
    from lathesim.lessons.lesson_list import former_names

    for name in dict.fromkeys(numbered):
        if name in former_names() and not Path("lesson_configs", f"{name}.yaml").is_file():
            click.echo(f"The lesson '{name}' is now called '{former_names()[name]}'.", err=True)


def run_command_line(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and give its exit code; every fault is told on the error stream in one message."""
    try:
        _tell_new_names(sys.argv[1:] if arguments is None else arguments)
        result: Any = group.main(args=None if arguments is None else list(arguments), prog_name="lathesim", standalone_mode=False)
    except click.exceptions.Exit as leaving:
        return leaving.exit_code
    except click.ClickException as error:
        error.show()
        return error.exit_code
    except (click.Abort, KeyboardInterrupt) as stopping:
        if isinstance(stopping.__cause__, EOFError):  # click takes it for Ctrl-D, but it comes from a file that ends early
            return _program_fault(stopping.__cause__)
        click.echo("Stopped.", err=True)
        return STOPPED
    except LatheSimError as error:
        click.echo(str(error), err=True)
        return INPUT_FAULT
    except BrokenPipeError:
        sys.stderr.close()
        return 0
    except OSError as error:
        if error.filename is None and error.strerror is None:
            return _program_fault(error)
        where = f"{error.filename}: " if error.filename is not None else ""
        click.echo(f"{where}{error.strerror}.", err=True)
        return INPUT_FAULT
    except Exception as error:
        return _program_fault(error)
    return result if isinstance(result, int) else 0


def _program_fault(error: BaseException) -> int:
    """Keep the traceback in a file and say where."""
    import tempfile
    import traceback

    text = "".join(traceback.format_exception(error))
    told = f"{type(error).__name__}: {error}".strip(": ")
    try:
        with tempfile.NamedTemporaryFile("w", prefix="lathesim_fault_", suffix=".txt", delete=False, encoding="utf-8") as file:
            file.write(f"lathesim {lathesim.__version__}, Python {sys.version}\n{text}")
        where = f"Its traceback is in {file.name}; please send it with a report."
    except OSError:
        where = text
    click.echo(f"This is a fault of the program, not of your input: {told}. {where}", err=True)
    return PROGRAM_FAULT


if __name__ == "__main__":
    main()
