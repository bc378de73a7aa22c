"""``lathesim program FILE``: what a part program moves; ``lathesim new-program``: one made from a few numbers."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from lathesim.cli.options import OutputPath, grouped, option
from lathesim.errors import ProgramError
from lathesim.units import from_si, in_unit
from lathesim.whole_file import write_new, write_text

if TYPE_CHECKING:
    from lathesim.program.moves import Move, Program, Tool
    from lathesim.program.program_checks import Bar


@dataclass(frozen=True)
class OutputOptions:
    """What is written of the moves: JSON, a sentence a block or the warnings alone; a figure; a plain program."""

    as_json: bool = option("Print canonical moves, schema lathe-canon/1.", "--json")
    as_words: bool = option("Say in a sentence what each block does.", "--explain")
    as_check: bool = option("Only say what is odd or wrong; leaves with 1 where something is.", "--check")
    figure: Path | None = option("Draw the path.", "--plot", type=OutputPath(), metavar="F.png")
    written: Path | None = option("Write the moves as a plain LinuxCNC program.", "--write", type=OutputPath(), metavar="F.ngc")


@dataclass(frozen=True)
class ReadingOptions:
    """How a program is read: noses of tools, the bar, and what is refused or left out."""

    tools: tuple[str, ...] = option("Nose of a tool for G41 and G42, as 1=0.8mm,3.", "--tool", metavar="N=RADIUS[,ORIENTATION]")
    stock: str | None = option(
        "Diameter and length of the bar, and Z of its face [0 mm]; rapids into it are reported.", metavar="D,L[,FACE]"
    )
    strict: bool = option("Refuse codes that do nothing in the simulation, as those of the machine's builder.")
    block_delete: bool = option("Leave out the lines that begin with /.", "--block-delete/--no-block-delete", default=True)


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--dialect", default="auto", show_default=True, help="paper, linuxcnc, grbl, fanuc or fanuc-b; auto recognises it and says why."
)
@grouped(shape=OutputOptions)
@grouped(reading=ReadingOptions)
def program(file: Path, dialect: str, shape: OutputOptions, reading: ReadingOptions) -> int:
    """Show the moves of a part program. Lengths are in mm and X is a radius."""
    from lathesim.program.canonical_moves import canon_text, linuxcnc_text
    from lathesim.program.explain import explain
    from lathesim.program.interpreter import interpret
    from lathesim.program.program_checks import checked, meets_stock
    from lathesim.program.program_file import detect_dialect
    from lathesim.program.words import read_program_file

    if not file.is_file():
        from lathesim.lessons.lesson import find_program

        file = find_program(file, Path.cwd()) or file
    blocks = read_program_file(file, block_delete=reading.block_delete)
    if dialect == "auto":
        detected = detect_dialect(blocks)
        dialect = detected.dialect.name
        click.echo(f"Read in the dialect '{dialect}': {detected.reason}. --dialect chooses another.", err=True)
    interpreted = interpret(blocks, dialect, tools=dict(map(_tool, reading.tools)), strict=reading.strict)
    bar = None if reading.stock is None else _bar(reading.stock)
    warnings = [*interpreted.warnings, *checked(interpreted, blocks), *([] if bar is None else meets_stock(interpreted, bar))]
    warnings.sort(key=lambda warned: warned.line)
    if shape.figure is not None:
        _draw(interpreted, shape.figure)
    if shape.written is not None:
        click.echo(f"wrote {_write_new(shape.written, linuxcnc_text(interpreted))}", err=True)
    if shape.as_json:
        _print(canon_text(interpreted), between="")
        return 0
    if shape.as_words:
        _print(f"{line:>4}  {sentence}" for line, sentence in explain(blocks, interpreted, every=True))
    elif not shape.as_check:
        _print(_lines(interpreted))
    if shape.as_words or shape.as_check:
        click.echo(_taken_as(interpreted), err=True)
    for warned in warnings:
        click.echo(f"{interpreted.name}:{warned.line}: {warned.sentence}", err=not shape.as_check)
    if shape.as_check and not warnings:
        click.echo(f"{interpreted.name}: {len(interpreted.moves)} move{'s' if len(interpreted.moves) != 1 else ''}, nothing odd.")
    return int(shape.as_check and bool(warnings))


def _tool(text: str) -> tuple[int, Tool]:
    """Return number and tool of ``1=0.8mm,3``."""
    from lathesim.program.moves import Tool
    from lathesim.units import quantity

    number, equals, nose = text.partition("=")
    radius, _, orientation = nose.partition(",")
    if not equals or not number.strip().isdigit() or (orientation.strip() or "3") not in set("0123456789"):
        raise click.BadParameter(f"'{text}' is no tool; write its number, nose radius and orientation, as 1=0.8mm,3", param_hint="'--tool'")
    return int(number), Tool(quantity(radius.strip(), "m"), int(orientation.strip() or "3"))


_BAR_SIZES = (2, 3)
"""How many numbers a bar has: diameter, length, and the place of the face where it is not zero."""


def _bar(text: str) -> Bar:
    """Return the bar of ``40mm,60mm`` or ``40mm,60mm,2mm``: it lies from its face towards the chuck, at smaller Z."""
    from lathesim.program.program_checks import Bar
    from lathesim.units import quantity

    parts = [part.strip() for part in text.split(",")]
    if len(parts) not in _BAR_SIZES:
        raise click.BadParameter(f"'{text}' is no bar; write its diameter and length, as 40mm,60mm", param_hint="'--stock'")
    values = [quantity(part, "m") for part in parts]
    if min(values[:2]) <= 0.0:
        raise click.BadParameter("diameter and length are above 0", param_hint="'--stock'")
    diameter, length, face = (*values, 0.0)[:3]
    return Bar(0.5 * diameter, face - length, length)


def _draw(interpreted: Program, figure: Path) -> None:
    from lathesim.analysis.path_figures import program_figure
    from lathesim.analysis.plots import save_figure

    save_figure(program_figure(Path(interpreted.name).name, map(_points, interpreted.moves)), figure)
    click.echo(f"drew {figure}", err=True)


def _points(move: Move) -> tuple[str, list[float], list[float]]:
    """Return kind, z and x [mm] of the points along a move, on an arc one every five degrees."""
    from math import ceil, cos, degrees, sin

    if move.arc is None:
        z, x = ([from_si(value, "mm") for value in ends] for ends in ((move.start_z, move.end_z), (move.start_x, move.end_x)))
        return move.kind, z, x
    arc = move.arc
    count = ceil(abs(degrees(arc.sweep)) / 5.0) + 1
    angles = [arc.start_angle + arc.sweep * step / count for step in range(count + 1)]
    return (
        "feed",
        [from_si(arc.centre_z + arc.radius * cos(a), "mm") for a in angles],
        [from_si(arc.centre_x + arc.radius * sin(a), "mm") for a in angles],
    )


def _print(parts: Iterable[str], between: str = "\n") -> None:
    """Print many parts, a thousand at a time, and end the line."""
    left = iter(parts)
    while some := list(itertools.islice(left, 1000)):
        click.echo(between.join(some), nl=between == "\n")
    if between != "\n":
        click.echo()


def _lines(interpreted: Program) -> Iterator[str]:
    from lathesim.program.moves import KINDS

    yield f"{'line':>4}  {'move':<10}{'X [mm]':>12}{'Z [mm]':>12}  {'feed':<16}spindle"
    moves = interpreted.moves
    same: dict[tuple[int, int, float], str] = {}
    millimetres = from_si(1.0, "mm")
    for place, key in enumerate(zip(moves.kinds, moves.mode_numbers, moves.feeds, strict=True)):
        behind = same.get(key)
        if behind is None:
            behind = same[key] = f"{_feed(moves[place]):<16}{_spindle(moves[place])}"
        kind, x, z = KINDS[key[0]], millimetres * moves.ends[4 * place + 2], millimetres * moves.ends[4 * place + 3]
        yield f"{moves.lines[place]:>4}  {_arc(moves[place]) if kind == 'arc' else kind:<10}{x:>12.4f}{z:>12.4f}  {behind}"
    summary = interpreted.summary
    counts = ", ".join(f"{number} {kind}" for kind, number in summary.counts.items()) or "no moves"
    yield f"{counts}; cut {in_unit(summary.cut_path, 'mm', '.3f')}, rapid {in_unit(summary.rapid_path, 'mm', '.3f')}"
    yield _taken_as(interpreted)


def _taken_as(interpreted: Program) -> str:
    """Return the values that the program leaves open and how they were taken."""
    return "taken as: " + "; ".join(f"{name.replace('_', ' ')}: {value}" for name, value in interpreted.assumed.items())


def _arc(move: Move) -> str:
    return move.kind if move.arc is None else f"arc {'cw' if move.arc.clockwise else 'ccw'}"


def _feed(move: Move) -> str:
    if move.kind == "dwell":
        return f"{move.mode.seconds:g} s"
    if move.feed is None:
        return ""
    return f"{in_unit(move.feed, 'mm', 'g')}/rev" if move.mode.per_revolution else in_unit(move.feed, "mm/min", "g")


def _spindle(move: Move) -> str:
    spindle = move.mode.spindle
    if spindle.direction == 0:
        return "off"
    turn = "cw" if spindle.direction > 0 else "ccw"
    if not spindle.surface:
        return f"{turn} {in_unit(spindle.speed, 'rpm', 'g')}"
    limit = "" if spindle.limit is None else f", at most {in_unit(spindle.limit, 'rpm', 'g')}"
    return f"{turn} {in_unit(spindle.speed, 'm/min', 'g')}{limit}"


@dataclass(frozen=True)
class CutOptions:
    """What all cuts are made from."""

    length: str = option("How far the cut goes behind the face, for example 20mm.", required=True)
    face: str = option("Where the face of the stock lies along Z.", default="15mm")
    clearance: str = option("How far in front of the face, and outside the part, rapid ends.", default="5mm")
    feed: str = option("Per minute (mm/min), or per revolution (mm, mm/rev).", default="120 mm/min")
    speed: str = option("Spindle speed (rpm), or constant surface speed (m/min).", default="1000 rpm")


@dataclass(frozen=True)
class PlaceOptions:
    """Where a program goes."""

    out: Path | None = option("Write this file; without it the program is printed.", type=OutputPath())
    force: bool = option("Replace a file that is there.")


@click.group()
def new_program() -> None:
    """Make a part program from a few numbers, in the dialect paper."""


@new_program.command()
@click.option("--large-diameter", required=True, help="Diameter at the far end, for example 34mm.")
@click.option("--small-diameter", required=True, help="Diameter at the face, for example 30mm.")
@grouped(cut=CutOptions, place=PlaceOptions)
def taper(large_diameter: str, small_diameter: str, cut: CutOptions, place: PlaceOptions) -> None:
    """A taper cut: one pass that widens from the face on."""
    from lathesim.program.program_file import taper_from_form

    _hand_out(taper_from_form(small_diameter=small_diameter, large_diameter=large_diameter, **asdict(cut)), place)


@new_program.command()
@click.option("--diameter", required=True, help="Diameter to turn, for example 30mm.")
@grouped(cut=CutOptions, place=PlaceOptions)
def straight(diameter: str, cut: CutOptions, place: PlaceOptions) -> None:
    """A straight cut: one pass at one diameter."""
    from lathesim.program.program_file import straight_from_form

    _hand_out(straight_from_form(diameter=diameter, **asdict(cut)), place)


def _hand_out(text: str, place: PlaceOptions) -> None:
    if place.out is None:
        click.echo(text, nl=False)
    elif place.force:
        write_text(place.out, text)
        click.echo(f"wrote {place.out}")
    else:
        click.echo(f"wrote {_write_new(place.out, text, 'Choose another name, or replace it with --force.')}")


def _write_new(place: Path, text: str, remedy: str = "Choose another name.") -> Path:
    """Write a file that is not there yet, and return its place."""
    try:
        return write_new((place,), lambda part: part.write_bytes(text.encode()))
    except FileExistsError:
        raise ProgramError(f"'{place}' is there already.", remedy=remedy) from None
