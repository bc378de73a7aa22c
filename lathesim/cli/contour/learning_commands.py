"""``lathesim learn`` and ``train``: corrections that laps teach, and the weights of a neural regulator."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lathesim.cli.options import ChosenLesson, OutputPath, grouped, json_option, of_case, of_lesson, option
from lathesim.cli.progress import working
from lathesim.cli.writing import CommandResult, Heading, table, write

if TYPE_CHECKING:
    from lathesim.compensation.learn import Learning, Outlook
    from lathesim.compensation.train import Training


NO_BETTER = 0.97
"""Largest ratio of the floor to the error of a lap at which a further lap is worth its time (assumed)."""


@dataclass(frozen=True)
class LearnOptions:
    """What is corrected, which error is learned from, and what the filter follows from."""

    what: str = option("What is corrected.", type=click.Choice(("voltage", "reference")), default="voltage")
    on: str = option("Which error is learned from.", type=click.Choice(("axis", "contour")), default="axis")
    without_filter: bool = option("Leave the robust filter out, to see what it is good for: it diverges.")
    model: str | None = option("Variant whose frequency response the filter follows from [default: that of the run].", metavar="NAME")


@click.command()
@click.argument("lesson")
@click.option("--laps", type=click.IntRange(1, 1000), default=8, show_default=True, help="Laps after the first.")
@grouped(method=LearnOptions)
@click.option(
    "--recording",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="A lap of a real machine: write the program of the next one to --out.",
)
@click.option("--out", type=OutputPath(folder=True), metavar="DIR", help="Write the lesson with what was learned.")
@json_option("lathesim-learning/1")
@of_case
def learn(chosen: ChosenLesson, method: LearnOptions, laps: int, recording: Path | None, out: Path | None, as_json: bool) -> int:
    """Run LESSON lap after lap, each with a correction that the errors of the lap before improve.

    The filter follows from the lesson's own frequency response, measured by a pulse. Learning ends when a lap is no better than the one
    before. The command says what limits the last lap: the converter, the encoder, or an error that differs from lap to lap.
    """
    from lathesim.compensation.lap_response import learning_filter
    from lathesim.compensation.laps import course_of
    from lathesim.compensation.learn import learn as from_lap_to_lap
    from lathesim.compensation.learn import write_learned
    from lathesim.errors import WriteError
    from lathesim.lessons.lesson import keep_read_lesson

    keep_read_lesson(chosen.loaded, out)
    prepared = chosen.prepared
    # a part program changes the reference and cannot change a voltage
    what = "reference" if recording is not None else method.what
    began = time.perf_counter()
    with working(shown=not as_json) as tell:
        course = course_of(prepared, what)
        tell("measuring the frequency response")
        own = course if method.model is None else course_of(chosen.prepared_as(method.model), what)
        how = learning_filter(own, filtered=not method.without_filter)
        if recording is not None:
            from lathesim.compensation.learn import next_lap
            from lathesim.lessons.lesson import results_folder

            files, outlook = next_lap(prepared, course, how, recording, chosen.registry, out or results_folder(chosen.loaded, recording))
            click.echo(f"{_promised(outlook)} See {', '.join(map(str, files))}")
            return 0
        if what == "reference":
            # what a level of the converter leaves follows from the answer to a voltage
            how = replace(how, answer=learning_filter(course_of(prepared, "voltage")).answer)
        learning = from_lap_to_lap(course, how, laps, on=method.on, tell=tell)
    lasted = time.perf_counter() - began
    written, refused = [], None
    try:
        written = write_learned(prepared, course, learning, out) if out is not None else []
    except WriteError as error:  # the result is printed first
        refused = error
    data = {"lesson": chosen.lesson, **_data(learning), "files": written, "wall_time_s": round(lasted, 2)}
    write(CommandResult("lathesim-learning/1", data, _lines(learning, lasted, written)), as_json)
    if refused is not None:
        raise refused
    return 0


_LAPS = (
    Heading("lap", 4, "d"), Heading("tracking rms [mm]", 20, ".5g", si=True), Heading("predicted at most", 20, ".5g", missing="-"),
    Heading("of the lap before", 20), Heading("largest distance [mm]", 24, ".5g", si=True),
    Heading("its rms [mm]", 16, ".4g", si=True),
)  # fmt: skip


def _lines(learning: Learning, lasted: float, written: list[Path]) -> Iterator[str]:
    from lathesim.units import from_si

    chosen = learning.filter
    bound = f"predicted contraction of a lap at most {chosen.bound:.3f}, " if math.isfinite(chosen.bound) else ""
    yield f"{bound}{f'low-pass at {chosen.cutoff:.3g} Hz' if chosen.cutoff else 'no low-pass'}\n"
    most, shares = (
        [math.nan, *(from_si(value, "mm") for value in learning.predicted)],
        ["-", *(f"{value:.3f}" for value in learning.contractions)],
    )
    laps = zip(learning.laps, most, shares, strict=False)
    yield from table(_LAPS, [(number, lap.rms, at, share, lap.largest, lap.rms_contour) for number, (lap, at, share) in enumerate(laps)])
    first, best = learning.laps[0], learning.laps[learning.best]
    yield f"\nIt stops because {learning.why}."
    times = first.largest / best.largest if best.largest > 0.0 else math.inf
    yield f"Lap {learning.best} is kept: the largest distance from the path is {times:.3g} times smaller than at first. {lasted:.1f} s."
    if written:
        yield f"See {', '.join(map(str, written))}"


def _promised(outlook: Outlook) -> str:
    """Return the error of a recorded lap, the predicted error of the next lap and the floor, as sentences."""
    from lathesim.units import in_unit

    now, following, floor = (in_unit(value, "mm") for value in (outlook.now, outlook.following, outlook.floor))
    text = f"The tracking error of this lap is {now} rms; the next one's is predicted to be {following}, "
    text += f"{outlook.following / outlook.now:.2f} of it. No lap is predicted to come below {floor}: that is the floor."
    return text if outlook.floor < NO_BETTER * outlook.now else f"{text} This lap has reached it: nothing is left to learn."


def _data(learning: Learning) -> dict[str, Any]:
    return {
        "predicted_contraction": learning.filter.bound,
        "cutoff_hz": learning.filter.cutoff,
        "floor_m": learning.floor,
        "laps": [{"rms_m": lap.rms, "largest_m": lap.largest, "rms_contour_m": lap.rms_contour} for lap in learning.laps],
        "predicted_at_most_m": learning.predicted,
        "contractions": learning.contractions,
        "kept": learning.best,
        "why": learning.why,
    }


_SCORES = (Heading("variant", -16), Heading("trained", 12, ".4g"), Heading("zero regulator", 16, ".4g"))


@dataclass(frozen=True)
class TrainOptions:
    """How the weights are searched for."""

    method: str = option("descent, adam, least-squares or evolution.", default="least-squares", metavar="NAME")
    hidden: int = option("Hidden neurons; 0 for no hidden layer.", default=0, metavar="N")
    score: str = option("seed, contour, largest or even.", default="seed", metavar="NAME")
    starts: int = option("Searches from other first weights.", type=click.IntRange(1, 100), default=3)
    rounds: int | None = option("Rounds of each search [default: what the method takes].", type=click.IntRange(1, 100_000))
    seed: int = option("Draw the same first weights again.", type=click.IntRange(min=0), default=1)


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
@grouped(search=TrainOptions)
@json_option("lathesim-training/1")
@of_lesson
def train(chosen: ChosenLesson, out: Path, variants: tuple[str, ...], judges: tuple[str, ...], search: TrainOptions, as_json: bool) -> int:
    """Find the weights of LESSON's neural regulator and write them as a table that the lesson can name under 'tables:'.

    All starts are reported. The best is judged in each variant with the lesson's own steps, beside the regulator whose weights are zero.
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
    code = write(CommandResult("lathesim-training/1", data, _train_lines(training)), as_json)
    write_table(out, NeuralRegulator.declarations["weights"].columns, training.table)  # type: ignore[attr-defined]
    if not as_json:
        click.echo(
            f"\n{shape.weights} weights, {lasted:.1f} s. See {out}; a lesson names it as 'tables: {{{question.table}: {out.name}}}'."
        )
    return code


def _train_lines(training: Training) -> Iterator[str]:
    for number, item in enumerate(training.starts, start=1):
        told = "diverged" if item.diverged else f"score {item.score:.4g}"
        yield f"start {number}: {told} after {item.rounds} rounds"
    yield ""
    yield from table(_SCORES, [(name, value, training.zero[name]) for name, value in training.scores.items()])
    worse = [name for name, value in training.scores.items() if value > training.zero[name]]
    if worse:
        yield f"\nWith weights of zero, the tangent speed alone, {', '.join(worse)} scores better than what was trained."
