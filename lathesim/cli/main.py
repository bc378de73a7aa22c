"""The command ``lathesim``: a group whose commands are imported only when they are called, so that it starts at once.

Exit codes: 0 done, 1 the input is at fault (one message), 2 wrong usage, 3 a fault of the program, 130 stopped with Ctrl-C.
"""

from __future__ import annotations

import functools
import io
import re
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import click

import lathesim
from lathesim.cli import STOPPED, tell_problems
from lathesim.errors import LatheSimError, PluginError, nearest
from lathesim.hookspecs import CommandEntry
from lathesim.plugins import load_registry
from lathesim.workspace import load_with_workspace

INPUT_FAULT, USAGE, PROGRAM_FAULT = 1, 2, 3


@functools.cache
def stock_commands() -> Mapping[str, CommandEntry]:
    """Return the commands that came with the program, by name."""
    return load_registry(installed=False).commands


def all_commands(ctx: click.Context) -> Mapping[str, CommandEntry]:
    """Return the commands with those of plug-ins, looked up once a call; a plug-in at fault is reported in one line."""
    if _KNOWN not in ctx.meta:
        registry = load_with_workspace((), hook="register_commands")
        ctx.meta[_KNOWN] = registry.commands
        tell_problems(registry)
    known: Mapping[str, CommandEntry] = ctx.meta[_KNOWN]
    return known


_KNOWN = "lathesim.commands"


class LazyGroup(click.Group):
    """A group that knows its commands by their entries and imports each when it is called. Plug-ins are only asked for what is unknown."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of the commands, in the order of the rooms."""
        return list(all_commands(ctx))

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import a command."""
        entry = stock_commands().get(cmd_name) or all_commands(ctx).get(cmd_name)
        if entry is None:
            return None
        command = entry.load()
        if not isinstance(command, click.Command):
            raise PluginError(f"'{entry.target}' is no command of click.", remedy="Write @click.command() above it.")
        return command

    def resolve_command(self, ctx: click.Context, args: list[str]) -> tuple[str | None, click.Command | None, list[str]]:
        """Find the command that was asked for, or name the nearest one."""
        if args and not args[0].startswith("-") and args[0] not in stock_commands() and args[0] not in all_commands(ctx):
            ctx.fail(f"there is no command '{args[0]}'. {nearest(args[0], all_commands(ctx))}".strip())
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the commands under their headings, without importing any."""
        headings: dict[str, list[tuple[str, str]]] = {}
        for entry in all_commands(ctx).values():
            headings.setdefault(entry.heading, []).append((entry.name, entry.sentence))
        for heading, rows in headings.items():
            with formatter.section(heading):
                formatter.write_dl(rows)


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
    import os

    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # characters outside the terminal's encoding are replaced
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")  # else all installed packages are searched for them
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # matrices are too small to be shared among cores, which wait for each other


def _tell_new_names(arguments: Sequence[str]) -> None:
    """Print the present names of lessons that a command line calls by their former ones."""
    numbered = [text.removeprefix("sim:") for text in arguments if re.fullmatch(r"(sim:)?\d\d_\w+", text)]
    if not numbered:
        return
    from lathesim.lessons.lesson import former_names

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
