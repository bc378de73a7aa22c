"""``lathesim train LESSON``: find the weights of a neural regulator."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from lathesim.cli.options import ChosenLesson, OutputPath, grouped, json_option, plugins_option
from lathesim.cli.progress import working
from lathesim.cli.writing import CommandResult, Heading, table, write

if TYPE_CHECKING:
    from lathesim.compensation.train import Training

_SCORES = (Heading("variant", -16), Heading("trained", 12, ".4g"), Heading("zero regulator", 16, ".4g"))


@dataclass(frozen=True)
class TrainOptions:
    """How the weights are searched for."""

    method: str
    hidden: int
    score: str
    starts: int
    rounds: int | None
    seed: int


@click.command()
@click.argument("lesson")
@click.option("--out", type=OutputPath(), required=True, metavar="WEIGHTS.csv", help="Where the weights go.")
@click.option(
    "--variant", "variants", multiple=True, metavar="NAME", help="Score in this variant; several times for several [default: the lesson]."
)
@click.option(
    "--judge",
    "judges",
    multiple=True,
    metavar="NAME",
    help="Tell the score in this variant too; several times [default: where it is trained].",
)
@click.option("--method", default="least-squares", show_default=True, metavar="NAME", help="descent, adam, least-squares or evolution.")
@click.option("--hidden", type=int, default=0, show_default=True, metavar="N", help="Hidden neurons; 0 for no hidden layer.")
@click.option("--score", default="seed", show_default=True, metavar="NAME", help="seed, contour, largest or even.")
@click.option("--starts", type=click.IntRange(1, 100), default=3, show_default=True, help="Searches from other first weights.")
@click.option("--rounds", type=click.IntRange(1, 100_000), help="Rounds of each search [default: what the method takes].")
@click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True, help="Draw the same first weights again.")
@json_option("lathesim-training/1")
@plugins_option
@grouped(chosen=ChosenLesson, search=TrainOptions)
def train(chosen: ChosenLesson, out: Path, variants: tuple[str, ...], judges: tuple[str, ...], search: TrainOptions, as_json: bool) -> int:
    """Find the weights of LESSON's neural regulator and write them as a table that the lesson can name under 'tables:'.

    All starts are told. The best is judged in each variant with the lesson's own steps, beside the regulator whose weights are zero.
    """
    from lathesim.compensation.train import method_named
    from lathesim.compensation.train import train as trained
    from lathesim.compensation.training_question import NetworkShape, question_of, score_named
    from lathesim.components.predictive_controllers import NeuralRegulator
    from lathesim.lessons.part_values import write_table

    method, shape, wanted = method_named(search.method), NetworkShape(search.hidden), score_named(search.score)
    loaded, registry = chosen.loaded, chosen.registry
    question = question_of(loaded, registry, variants, wanted, shape)
    judged = question_of(loaded, registry, tuple(dict.fromkeys((*variants, *judges))), wanted, shape) if judges else None
    began = time.perf_counter()
    with working(shown=not as_json) as tell:
        training = trained(question, method, starts=search.starts, rounds=search.rounds, seed=search.seed, judged=judged, tell=tell)
    lasted = time.perf_counter() - began
    data = {
        "lesson": chosen.lesson,
        "method": search.method,
        "score": search.score,
        "weights": shape.weights,
        "starts": [{"score": item.score if not item.diverged else None, "rounds": item.rounds} for item in training.starts],
        "scores": training.scores,
        "zero_regulator": training.zero,
        "file": out,
        "wall_time_s": round(lasted, 2),
    }
    code = write(CommandResult("lathesim-training/1", data, _lines(training)), as_json)
    write_table(out, NeuralRegulator.declarations["weights"].columns, training.table)  # type: ignore[attr-defined]
    if not as_json:
        click.echo(
            f"\n{shape.weights} weights, {lasted:.1f} s. See {out}; a lesson names it as 'tables: {{{question.table}: {out.name}}}'."
        )
    return code


def _lines(training: Training) -> Iterator[str]:
    for number, item in enumerate(training.starts, start=1):
        told = "diverged" if item.diverged else f"score {item.score:.4g}"
        yield f"start {number}: {told} after {item.rounds} rounds"
    yield ""
    yield from table(_SCORES, [(name, value, training.zero[name]) for name, value in training.scores.items()])
    worse = [name for name, value in training.scores.items() if value > training.zero[name]]
    if worse:
        yield f"\nWith weights of zero, the tangent speed alone, {', '.join(worse)} scores better than what was trained."
