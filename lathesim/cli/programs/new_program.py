"""``lathesim new-program taper|straight``: a part program made from a few numbers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import click

from lathesim.cli.options import grouped
from lathesim.cli.output_path import OutputPath
from lathesim.errors import ProgramError
from lathesim.whole_file import write_new, write_text

_COMMON: list[Callable[[Any], Any]] = [
    click.option("--length", required=True, help="How far the cut goes behind the face, for example 20mm."),
    click.option("--face", default="15mm", show_default=True, help="Where the face of the stock lies along Z."),
    click.option("--clearance", default="5mm", show_default=True, help="How far in front of the face, and outside the part, rapid ends."),
    click.option("--feed", default="120 mm/min", show_default=True, help="Per minute (mm/min), or per revolution (mm, mm/rev)."),
    click.option("--speed", default="1000 rpm", show_default=True, help="Spindle speed (rpm), or constant surface speed (m/min)."),
    click.option("--out", type=OutputPath(), help="Write this file; without it the program is printed."),
    click.option("--force", is_flag=True, help="Replace a file that is there."),
]


@dataclass(frozen=True)
class Cut:
    """What all cuts are made from."""

    length: str
    face: str
    clearance: str
    feed: str
    speed: str


def _with_common(command: Any) -> Any:
    command = grouped(cut=Cut)(command)
    for option in reversed(_COMMON):
        command = option(command)
    return command


@click.group()
def new_program() -> None:
    """Make a part program from a few numbers, in the dialect paper."""


@new_program.command()
@click.option("--large-diameter", required=True, help="Diameter at the far end, for example 34mm.")
@click.option("--small-diameter", required=True, help="Diameter at the face, for example 30mm.")
@_with_common
def taper(large_diameter: str, small_diameter: str, cut: Cut, out: Path | None, force: bool) -> None:
    """A taper cut: one pass that widens from the face on."""
    from lathesim.program.new_program import taper_from_form

    _hand_out(taper_from_form(small_diameter=small_diameter, large_diameter=large_diameter, **asdict(cut)), out, force)


@new_program.command()
@click.option("--diameter", required=True, help="Diameter to turn, for example 30mm.")
@_with_common
def straight(diameter: str, cut: Cut, out: Path | None, force: bool) -> None:
    """A straight cut: one pass at one diameter."""
    from lathesim.program.new_program import straight_from_form

    _hand_out(straight_from_form(diameter=diameter, **asdict(cut)), out, force)


def _hand_out(text: str, out: Path | None, force: bool) -> None:
    if out is None:
        click.echo(text, nl=False)
        return
    if force:
        write_text(out, text)
    else:
        try:
            write_new((out,), lambda part: part.write_bytes(text.encode()))
        except FileExistsError:
            raise ProgramError(f"'{out}' is there already.", remedy="Choose another name, or replace it with --force.") from None
    click.echo(f"wrote {out}")
