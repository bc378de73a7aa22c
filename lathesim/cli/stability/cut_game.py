"""The game of ``lathesim cuts LESSON --play N``: cuts are typed, the concealed machine answers, and the program plays beside."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

import click

from lathesim.cli.writing import Heading, table
from lathesim.errors import LatheSimError
from lathesim.units import from_si, in_unit

if TYPE_CHECKING:
    from lathesim.stability.belief import TriedCut
    from lathesim.stability.next_cut import ConcealedMachine

_SCORES = (
    Heading("", -10), Heading("cuts", 6, "d"), Heading("rate [rpm*mm]", 16, ".0f"), Heading("of the best", 13, ".0%"),
    Heading("tools broken", 14, "d"),
)  # fmt: skip


def play(machine: ConcealedMachine, prior: Any, count: int, risk: float, seed: int) -> None:
    """Ask for cuts until all are made or the input ends, then show both scores."""
    from lathesim.stability.next_cut import program_plays, score

    low, high = machine.inside.speeds[0], machine.inside.speeds[-1]
    widest = in_unit(machine.inside.widest, "mm", "g")
    click.echo(f"{count} cuts. Type a speed from {low:g} to {high:g} rpm and a width up to {widest}, as: 2500 1.5")
    cuts: list[TriedCut] = []
    while len(cuts) < count:
        click.echo(f"cut {len(cuts) + 1}: ", nl=False)
        line = sys.stdin.readline()
        if not line:
            click.echo("")
            break
        try:
            cut = machine.cut(*_read(line))
        except LatheSimError as error:
            click.echo(str(error))
            continue
        cuts.append(cut)
        said = "stable" if cut.stable else f"chatter at {cut.frequency:.1f} Hz, the tool is broken"
        mine = score(machine, cuts)
        click.echo(f"  {said}; {from_si(mine.rate, 'mm'):.0f} rpm*mm so far, {mine.broken} tools broken")
    if not cuts:
        click.echo("No cut was made.")
        return
    theirs = program_plays(machine, prior, len(cuts), risk, seed)
    scores = [(name, len(made), score(machine, made)) for name, made in (("you", cuts), ("program", theirs))]
    click.echo()
    for row in table(_SCORES, [(name, made, from_si(found.rate, "mm"), found.share, found.broken) for name, made, found in scores]):
        click.echo(row)
    mode, best = machine.tool.modes[0], from_si(machine.best(), "mm")
    click.echo(f"\nThe machine: {mode.frequency:.1f} Hz, damping {in_unit(mode.damping, '%', '.1f')}; possible were {best:.0f} rpm*mm.")


def _read(line: str) -> tuple[float, float]:
    """Return the speed [rpm] and width [m] of a line."""
    words = line.replace(",", " ").replace(";", " ").split()
    try:
        speed, width = (float(word) for word in words)
    except ValueError:
        raise LatheSimError(f"'{line.strip()}' is no cut.", remedy="Type a speed in rpm and a width in mm, as: 2500 1.5") from None
    return speed, 1e-3 * width
