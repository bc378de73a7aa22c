"""``lathesim cuts LESSON CUTS.csv``: what cuts teach about the stability map, and the next cut worth making."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lathesim.cli.output_path import OutputPath

if TYPE_CHECKING:
    from lathesim.stability.learned_map import LearnedMap


@click.command()
@click.argument("lesson")
@click.argument("cuts_file", required=False, type=click.Path(path_type=Path), metavar="[CUTS.csv]")
@click.option("--next", "count", type=click.IntRange(0, 50), default=1, show_default=True, help="How many next cuts to propose.")
@click.option("--speed", "speeds", default="1000..4000:121", show_default=True, metavar="LOW..HIGH:N", help="Speeds [rpm].")
@click.option("--widest", type=float, default=6.0, show_default=True, help="The widest chip [mm].")
@click.option("--risk", type=click.FloatRange(0.0, 1.0), default=0.6, show_default=True, help="Propose no cut that chatters more probably.")
@click.option(
    "--price-of-chatter", "price", type=click.FloatRange(0.0), default=0.0, show_default=True, help="A cut that chatters costs [rpm*mm]."
)
@click.option("--compare", "comparators", is_flag=True, help="Draw a network and a Gaussian process beside (extra 'stability').")
@click.option(
    "--prior", "before", type=click.Path(path_type=Path), metavar="MAP.json", help="Begin with what cuts at another overhang taught."
)
@click.option(
    "--play", "game", type=click.IntRange(1, 100), metavar="N", help="A game: choose N cuts on a concealed machine, as the program does."
)
@click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True, help="Another seed of the particles.")
@click.option("--json", "as_json", is_flag=True, help="Write the result as JSON (schema lathesim-cuts/1) and nothing else.")
@click.option("--save", type=OutputPath(), metavar="F.png", help="Draw the map.")
def cuts(
    lesson: str,
    cuts_file: Path | None,
    count: int,
    speeds: str,
    widest: float,
    risk: float,
    price: float,
    comparators: bool,
    before: Path | None,
    game: int | None,
    seed: int,
    as_json: bool,
    save: Path | None,
) -> None:
    """Learn the stability map of LESSON from the cuts in CUTS.csv, and propose the next one.

    CUTS.csv has the columns 'speed [rpm],width [mm],stable' and, where it was recorded, 'frequency [Hz]' of the chatter. The lesson's
    'uncertain:' says what is not known before, as tool_point.damping: 30 %. The next cut is that of largest expected gain in removal rate.
    --prior takes what --json wrote for another overhang as the beginning. With --play a machine drawn by --seed from what is uncertain
    answers your cuts; points are the removal rate reached, a cut that chatters breaks a tool, and the program plays beside.
    """
    import numpy as np

    from lathesim.cli.stability.lobes import read_range
    from lathesim.lessons.lesson import load_lesson
    from lathesim.stability.learned_map import learned_map
    from lathesim.stability.next_cut import Range
    from lathesim.stability.tried_cuts import read_cuts

    if not 0.0 < widest < math.inf:
        raise click.UsageError(f"--widest {widest:g}: give one above 0.")
    loaded = load_lesson(lesson)
    tried = read_cuts(cuts_file) if cuts_file is not None else ()
    inside = Range(np.array(read_range("--speed", speeds)), 1e-3 * widest)
    if game is not None:
        from lathesim.cli.stability.cut_game import play
        from lathesim.stability.next_cut import concealed_machine
        from lathesim.stability.uncertain_cut import lesson_prior

        prior = lesson_prior(loaded).prior
        play(concealed_machine(prior, inside, seed), prior, game, risk, seed)
        return
    found = learned_map(loaded, tried, inside, count, risk=risk, price=1e-3 * price, seed=seed, before=before)
    if save is not None:
        _draw(loaded.title, found, comparators, save)
    if as_json:
        click.echo(json.dumps(_as_json(found), indent=2))
        return
    _tell(found)
    if save is not None:
        click.echo(f"See {save}")


def _as_json(found: LearnedMap) -> dict[str, Any]:
    best = found.best
    return {
        "schema": "lathesim-cuts/1",
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
            for speed, low, middle, high in zip(found.speeds, *found.quantiles.tolist(), strict=True)
        ],
        "findings": list(found.told),
    }


def _tell(found: LearnedMap) -> None:
    for sentence in found.told:
        click.echo(sentence)
    best = found.best
    stable = sum(cut.stable for cut in found.belief.cuts)
    told = f"; the best {best.speed:.0f} rpm, {1e3 * best.width:.3f} mm" if best else ""
    click.echo(f"{len(found.belief.cuts)} cuts, {stable} stable{told}")
    for item in found.parameters:
        click.echo(f"  {item.name.replace('_', ' '):<34}{item.value:>12.5g} {item.unit:<4} 95 % {item.low:.5g} to {item.high:.5g}")
    if not found.adequacy.good:
        click.echo(f"\nOne mode does not explain the cuts: {found.adequacy.reason}. The limits are then held below what has chattered.")
    if found.proposals:
        click.echo("\nNext:")
    for cut in found.proposals:
        click.echo(
            f"  {cut.speed:.0f} rpm, {1e3 * cut.width:.3f} mm: stable with {100.0 * cut.stable:.0f} %, "
            f"expected gain {1e3 * cut.gain:.0f} rpm*mm"
        )


def _draw(title: str, found: LearnedMap, comparators: bool, save: Path) -> None:
    from lathesim.analysis.plots import save_figure
    from lathesim.analysis.stability_figures import learned_figure

    shown = found.grid()
    others = found.comparators() if comparators else {}
    cuts = [(cut.speed, 1e3 * cut.width, cut.stable) for cut in found.belief.cuts]
    asked = [(cut.speed, 1e3 * cut.width) for cut in found.proposals]
    save_figure(learned_figure(title, found.speeds, 1e3 * shown.widths, shown.stable, 1e3 * found.quantiles, cuts, asked, others), save)
