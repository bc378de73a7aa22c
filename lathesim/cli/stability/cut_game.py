"""The game of ``lathesim cuts LESSON --play N``: cuts are typed, the concealed machine answers, and the program plays beside."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

import click

from lathesim.errors import LatheSimError

if TYPE_CHECKING:
    from lathesim.stability.next_cut import ConcealedMachine
    from lathesim.stability.tried_cuts import TriedCut


def play(machine: ConcealedMachine, prior: Any, count: int, risk: float, seed: int) -> None:
    """Ask for cuts until all are made or the input ends, then show both scores."""
    from lathesim.stability.next_cut import program_plays, score

    low, high = machine.inside.speeds[0], machine.inside.speeds[-1]
    click.echo(
        f"{count} cuts. Type a speed from {low:g} to {high:g} rpm and a width up to {1e3 * machine.inside.widest:g} mm, as: 2500 1.5"
    )
    cuts: list[TriedCut] = []
    source = sys.stdin
    while len(cuts) < count:
        click.echo(f"cut {len(cuts) + 1}: ", nl=False)
        line = source.readline()
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
        click.echo(f"  {said}; {1e3 * mine.rate:.0f} rpm*mm so far, {mine.broken} tools broken")
    if not cuts:
        click.echo("No cut was made.")
        return
    theirs = program_plays(machine, prior, len(cuts), risk, seed)
    click.echo(f"\n{'':<10}{'cuts':>6}{'rate [rpm*mm]':>16}{'of the best':>13}{'tools broken':>14}")
    for name, made in (("you", cuts), ("program", theirs)):
        found = score(machine, made)
        click.echo(f"{name:<10}{len(made):>6}{1e3 * found.rate:>16.0f}{100.0 * found.share:>12.0f}%{found.broken:>14}")
    mode = machine.tool.modes[0]
    click.echo(
        f"\nThe machine: {mode.frequency:.1f} Hz, damping {100.0 * mode.damping:.1f} %; possible were {1e3 * machine.best():.0f} rpm*mm."
    )


def _read(line: str) -> tuple[float, float]:
    """Return the speed [rpm] and width [m] of a line."""
    words = line.replace(",", " ").replace(";", " ").split()
    try:
        speed, width = (float(word) for word in words)
    except ValueError:
        raise LatheSimError(f"'{line.strip()}' is no cut.", remedy="Type a speed in rpm and a width in mm, as: 2500 1.5") from None
    return speed, 1e-3 * width
