"""``lathesim program FILE``: what a part program moves, as a table or as canonical JSON."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from lathesim.program.moves import Move, Program


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--dialect", default="paper", show_default=True, help="How the program is written: paper, linuxcnc or fanuc.")
@click.option("--json", "as_json", is_flag=True, help="Print canonical moves, schema lathe-canon/1.")
@click.option("--block-delete/--no-block-delete", default=True, show_default=True, help="Leave out the lines that begin with /.")
def program(file: Path, dialect: str, as_json: bool, block_delete: bool) -> None:
    """Show the moves of a part program. Lengths are in mm and X is a radius."""
    from lathesim.program.canon import canon
    from lathesim.program.loading import load_program

    if not file.is_file():
        from lathesim.lessons.lesson import find_program

        file = find_program(file, Path.cwd()) or file
    interpreted = load_program(file, dialect, block_delete=block_delete)
    if as_json:
        click.echo(json.dumps(canon(interpreted), indent=1, ensure_ascii=False))
        return
    click.echo("\n".join(_table(interpreted)))
    for warned in interpreted.warnings:
        click.echo(f"{interpreted.name}:{warned.line}: {warned.sentence}", err=True)


def _table(interpreted: Program) -> list[str]:
    lines = [f"{'line':>4}  {'move':<10}{'X [mm]':>12}{'Z [mm]':>12}  {'feed':<16}spindle"]
    lines += [
        f"{move.line:>4}  {_kind(move):<10}{1e3 * move.end_x:>12.4f}{1e3 * move.end_z:>12.4f}  {_feed(move):<16}{_spindle(move)}"
        for move in interpreted.moves
    ]
    summary = interpreted.summary
    counts = ", ".join(f"{number} {kind}" for kind, number in summary.counts.items()) or "no moves"
    lines.append(f"{counts}; cut {1e3 * summary.cut_path:.3f} mm, rapid {1e3 * summary.rapid_path:.3f} mm")
    lines.append("taken as: " + "; ".join(f"{name.replace('_', ' ')}: {value}" for name, value in interpreted.assumed.items()))
    return lines


def _kind(move: Move) -> str:
    return move.kind if move.arc is None else f"arc {'cw' if move.arc.clockwise else 'ccw'}"


def _feed(move: Move) -> str:
    if move.kind == "dwell":
        return f"{move.seconds:g} s"
    if move.feed is None:
        return ""
    return f"{1e3 * move.feed:g} mm/rev" if move.per_revolution else f"{6e4 * move.feed:g} mm/min"


def _spindle(move: Move) -> str:
    spindle = move.spindle
    if spindle.direction == 0:
        return "off"
    from math import pi

    turn = "cw" if spindle.direction > 0 else "ccw"
    if not spindle.surface:
        return f"{turn} {spindle.speed * 30.0 / pi:g} rpm"
    limit = "" if spindle.limit is None else f", at most {spindle.limit * 30.0 / pi:g} rpm"
    return f"{turn} {60.0 * spindle.speed:g} m/min{limit}"
