"""``lathesim watermark``: what a watermark on a reference costs, and how soon it reveals a forged sensor."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lathesim.cli.options import grouped, json_option, option, save_option
from lathesim.cli.writing import CommandResult, Heading, table, write

if TYPE_CHECKING:
    from lathesim.experiments.guard_theory import FrontierPoint, WatermarkedLoop

_POINTS = (
    Heading("watermark", 10, ".4g"), Heading("E[x^2]", 11, ".5g"), Heading("var nu, replayed", 18, ".5g"),
    Heading("E[nu e], replayed", 19, ".4g"), Heading("mean delay [samples]", 22, ".1f", missing="never"),
)  # fmt: skip


@dataclass(frozen=True)
class LoopOptions:
    """A loop of first order: pole, gain, feedback, and the variances of process and reading."""

    pole: float = option("What a sample leaves of the state.", "--a", type=click.FloatRange(-0.9999, 0.9999), default=0.9)
    gain: float = option("What the command adds to it.", "--b", default=1.0)
    feedback: float = option("Gain of the feedback of the estimate.", default=0.5)
    process: float = option("Variance of the process.", type=click.FloatRange(min=0.0, min_open=True), default=0.01)
    reading: float = option("Variance of the readings.", type=click.FloatRange(min=0.0, min_open=True), default=0.01)


@click.command()
@grouped(given=LoopOptions)
@click.option("--size", "sizes", multiple=True, type=click.FloatRange(min=0.0), help="Standard deviation of a watermark; several times.")
@click.option("--false-alarm", type=click.FloatRange(min=100.0), default=10_000.0, show_default=True, help="Samples between false alarms.")
@click.option(
    "--within", type=click.FloatRange(min=1.0), metavar="SAMPLES", help="Choose the smallest watermark that tells a replay so soon."
)
@click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True, help="Which noise is drawn.")
@json_option("lathesim-watermark/1")
@save_option("Draw the frontier: delay against cost.")
def watermark(
    given: LoopOptions, sizes: tuple[float, ...], false_alarm: float, within: float | None, seed: int, as_json: bool, save: Path | None
) -> int:
    """Show for watermarks of several sizes what they cost, and how soon a guard tells readings that are replayed.

    The loop is x+ = a x + b u + w, y = x + v, with a Kalman filter. The guard adds up the likelihood ratio of innovation and watermark.
    """
    from lathesim.errors import LatheSimError
    from lathesim.experiments.guard_theory import WatermarkedLoop, frontier, watermark_within

    loop = WatermarkedLoop(given.pole, given.gain, given.feedback, given.process, given.reading)
    if abs(loop.a - loop.b * loop.feedback) >= 1.0:
        fact = f"the loop is unstable: a - b L is {loop.a - loop.b * loop.feedback:g}."
        raise LatheSimError(fact, place="--feedback", remedy="Choose a feedback with which it lies between -1 and 1.")
    wanted = watermark_within(loop, within, false_alarm) if within is not None else None
    asked = (*sizes, *((wanted,) if wanted else ())) or (0.02, 0.05, 0.1, 0.2)
    points = frontier(loop, tuple(sorted({0.0, *asked})), false_alarm, seed)

    def figure() -> Any:
        from lathesim.analysis.experiment_figures import frontier_figure

        told = [(point.watermark, point.cost, point.delay) for point in points if point.watermark > 0.0]
        return frontier_figure(told, points[0].cost, false_alarm)

    data = {"gain": loop.gain, "innovation": loop.innovation, "memory": loop.memory, "chosen": wanted, "rows": _rows(loop, points)}
    return write(CommandResult("lathesim-watermark/1", data, _lines(loop, points, wanted, within), figure), as_json, save)


def _rows(loop: WatermarkedLoop, points: Sequence[FrontierPoint]) -> list[dict[str, Any]]:
    return [
        {
            "watermark": point.watermark,
            "cost": point.cost,
            "replayed_variance": loop.replayed_variance(point.watermark),
            "correlation": loop.replayed_correlation(point.watermark),
            "information_nats": loop.information(point.watermark),
            "threshold": point.threshold,
            "mean_delay_samples": point.delay,
        }
        for point in points
    ]


def _lines(loop: WatermarkedLoop, points: Sequence[FrontierPoint], wanted: float | None, within: float | None) -> Iterator[str]:
    yield f"Filter gain K {loop.gain:.6g}, innovation S {loop.innovation:.6g}, g {loop.memory:.6g}"
    names = ("watermark", "cost", "replayed_variance", "correlation", "mean_delay_samples")
    yield from table(_POINTS, [[row[name] for name in names] for row in _rows(loop, points)])
    if wanted:
        yield f"A watermark of {wanted:.4g} tells within {within:g} samples: {loop.information(wanted):.3g} nats a sample."
    yield "Without a watermark replayed readings are honest in every respect but their date, so no test of them tells."
