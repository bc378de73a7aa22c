"""The options that choose one case of a lesson, shared by the commands that take a lesson."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

Command = TypeVar("Command", bound=Callable[..., Any])

variant_option = click.option("--variant", metavar="NAME", help="One of the lesson's variants.")
program_option = click.option("--program", type=click.Path(path_type=Path), metavar="FILE", help="Another part program.")
set_option = click.option(
    "--set", "settings", multiple=True, metavar="PART.NAME=VALUE", help="Another value of a parameter, or start of a state; with its unit."
)


def read_settings(settings: tuple[str, ...]) -> dict[str, str | float]:
    """Return ``part.name`` -> quantity for the options ``--set part.name=quantity``."""
    found: dict[str, str | float] = {}
    for text in settings:
        name, equals, value = text.partition("=")
        if not equals or name.count(".") != 1 or not value.strip():
            raise click.UsageError(f"--set {text}: write it as --set x_axis.time_constant='24 ms'.")
        if name.strip() in found:
            raise click.UsageError(f"--set {text}: {name.strip()} is set twice.")
        found[name.strip()] = value.strip()
    return found


def find_program_file(program: Path | None, lesson_folder: Path) -> Path | None:
    """Return the file of ``--program``: as given, else in the lesson's folder, else the shipped one of that name."""
    from lathesim.errors import ProgramError
    from lathesim.lessons.lesson import find_program

    if program is None or program.is_file():
        return program
    found = find_program(program, lesson_folder)
    if found is None:
        raise ProgramError(f"there is no part program '{program}'.")
    return found
