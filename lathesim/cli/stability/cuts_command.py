"""``lathesim cuts LESSON CUTS.csv``: what cuts teach about the stability map, the next cut worth making, and the game with ``--play``."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lathesim.cli.options import grouped, json_option, option, read_range, save_option
from lathesim.cli.writing import CommandResult, Heading, table, write
from lathesim.errors import LatheSimError
from lathesim.units import from_si, in_unit

if TYPE_CHECKING:
    from lathesim.stability.belief import TriedCut
    from lathesim.stability.learned_map import LearnedMap
    from lathesim.stability.next_cut import ConcealedMachine, CutRange


@dataclass(frozen=True)
class ProposalOptions:
    """How many next cuts are proposed, at what risk, at what price of chatter [rpm*mm], the seed of the particles, and the map before."""

    before: Path | None
    count: int
    seed: int
    risk: float = option("Propose no cut that chatters more probably.", type=click.FloatRange(0.0, 1.0), default=0.6)
    price: float = option("A cut that chatters costs [rpm*mm].", "--price-of-chatter", type=click.FloatRange(0.0), default=0.0)


@dataclass(frozen=True)
class RangeOptions:
    """Which speeds are looked at, and the widest chip [mm]."""

    speeds: str = option("Speeds [rpm].", "--speed", default="1000..4000:121", metavar="LOW..HIGH:N")
    widest: float = option("The widest chip [mm].", default=6.0)

    def range(self) -> CutRange:
        """Return both in SI, speeds in rpm."""
        import numpy as np

        from lathesim.stability.next_cut import CutRange

        return CutRange(np.array(read_range("--speed", self.speeds)), 1e-3 * self.widest)


@click.command()
@click.argument("lesson")
@click.argument("cuts_file", required=False, type=click.Path(path_type=Path), metavar="[CUTS.csv]")
@click.option("--next", "count", type=click.IntRange(0, 50), default=1, show_default=True, help="How many next cuts to propose.")
@grouped(inside=RangeOptions)
@grouped(wish=ProposalOptions)
@click.option("--compare", "comparators", is_flag=True, help="Draw a network and a Gaussian process beside (extra 'stability').")
@click.option(
    "--prior", "before", type=click.Path(path_type=Path), metavar="MAP.json", help="Begin with what cuts at another overhang taught."
)
@click.option(
    "--play", "game", type=click.IntRange(1, 100), metavar="N", help="A game: choose N cuts on a concealed machine, as the program does."
)
@click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True, help="Another seed of the particles.")
@json_option("lathesim-cuts/1")
@save_option("Draw the map.")
def cuts(
    lesson: str,
    cuts_file: Path | None,
    wish: ProposalOptions,
    inside: RangeOptions,
    comparators: bool,
    game: int | None,
    as_json: bool,
    save: Path | None,
) -> int:
    """Learn the stability map of LESSON from the cuts in CUTS.csv, and propose the next one.

    CUTS.csv has the columns 'speed [rpm],width [mm],stable' and, where it was recorded, 'frequency [Hz]' of the chatter. The lesson's
    'uncertain:' says what is not known before, as tool_point.damping: 30 %. The next cut is that of largest expected gain in removal rate.
    --prior takes what --json wrote for another overhang as the beginning. With --play a machine answers your cuts. Its uncertain values are
    drawn with --seed. You get points for the removal rate, a cut that chatters breaks a tool, and the program plays beside you.
    """
    from lathesim.lessons.lesson import load_lesson
    from lathesim.stability.belief import read_cuts
    from lathesim.stability.learned_map import learned_map

    if not 0.0 < inside.widest < math.inf:
        raise click.UsageError(f"--widest {inside.widest:g}: give one above 0.")
    loaded = load_lesson(lesson)
    tried = read_cuts(cuts_file) if cuts_file is not None else ()
    within = inside.range()
    if game is not None:
        from lathesim.stability.next_cut import concealed_machine
        from lathesim.stability.uncertain_cut import lesson_prior

        prior = lesson_prior(loaded).prior
        play(concealed_machine(prior, within, wish.seed), prior, game, wish.risk, wish.seed)
        return 0
    found = learned_map(loaded, tried, within, wish.count, risk=wish.risk, price=1e-3 * wish.price, seed=wish.seed, before=wish.before)
    return write(
        CommandResult("lathesim-cuts/1", _data(found), _lines(found), lambda: _figure(loaded.title, found, comparators)), as_json, save
    )


def _data(found: LearnedMap) -> dict[str, Any]:
    best = found.best
    return {
        "cuts": len(found.belief.cuts),
        "adequate": found.adequacy.good,
        "reason": found.adequacy.reason,
        "best_stable": None if best is None else {"speed_rpm": best.speed, "width_m": best.width},
        "parameters": {
            item.name: {"value": item.value, "low": item.low, "high": item.high, "unit": item.unit} for item in found.parameters
        },
        "given": dict(zip((item.name for item in found.parameters), found.given, strict=True)),
        "next": [
            {"speed_rpm": item.speed, "width_m": item.width, "stable_probability": item.stable, "expected_gain_rpm_m": item.gain}
            for item in found.proposals
        ],
        "rows": [
            {"speed_rpm": speed, "low_m": low, "width_m": middle, "high_m": high}
            for speed, low, middle, high in zip(found.speeds, *found.quantiles, strict=True)
        ],
        "findings": found.told,
    }


def _lines(found: LearnedMap) -> Iterator[str]:
    from lathesim.units import from_si, in_unit

    yield from found.told
    best = found.best
    stable = sum(cut.stable for cut in found.belief.cuts)
    told = f"; the best {best.speed:.0f} rpm, {in_unit(best.width, 'mm', '.3f')}" if best else ""
    yield f"{len(found.belief.cuts)} cuts, {stable} stable{told}"
    for item in found.parameters:
        yield f"  {item.name.replace('_', ' '):<34}{item.value:>12.5g} {item.unit:<4} 95 % {item.low:.5g} to {item.high:.5g}"
    if not found.adequacy.good:
        yield f"\nOne mode does not explain the cuts: {found.adequacy.reason}. The limits are then held below what has chattered."
    if found.proposals:
        yield "\nNext:"
    for cut in found.proposals:
        stable_with, gain = in_unit(cut.stable, "%", ".0f"), from_si(cut.gain, "mm")
        yield f"  {cut.speed:.0f} rpm, {in_unit(cut.width, 'mm', '.3f')}: stable with {stable_with}, expected gain {gain:.0f} rpm*mm"


def _figure(title: str, found: LearnedMap, comparators: bool) -> Any:
    from lathesim.analysis.stability_figures import learned_figure

    shown, millimetres = found.grid(), from_si(1.0, "mm")
    others = found.comparators() if comparators else {}
    cuts = [(cut.speed, millimetres * cut.width, cut.stable) for cut in found.belief.cuts]
    asked = [(cut.speed, millimetres * cut.width) for cut in found.proposals]
    return learned_figure(title, found.speeds, millimetres * shown.widths, shown.stable, millimetres * found.quantiles, cuts, asked, others)


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
