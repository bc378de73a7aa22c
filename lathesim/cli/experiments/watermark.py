"""``lathesim watermark``: what a watermark on a reference costs, and how soon it tells a forged sensor."""

from __future__ import annotations

import json
import math
from pathlib import Path

import click

from lathesim.cli.output_path import OutputPath


@click.command()
@click.option(
    "--a", "pole", type=click.FloatRange(-0.9999, 0.9999), default=0.9, show_default=True, help="What a sample leaves of the state."
)
@click.option("--b", "gain", type=float, default=1.0, show_default=True, help="What the command adds to it.")
@click.option("--feedback", type=float, default=0.5, show_default=True, help="Gain of the feedback of the estimate.")
@click.option("--process", type=click.FloatRange(min=0.0, min_open=True), default=0.01, show_default=True, help="Variance of the process.")
@click.option("--reading", type=click.FloatRange(min=0.0, min_open=True), default=0.01, show_default=True, help="Variance of the readings.")
@click.option("--size", "sizes", multiple=True, type=click.FloatRange(min=0.0), help="Standard deviation of a watermark; several times.")
@click.option("--false-alarm", type=click.FloatRange(min=100.0), default=10_000.0, show_default=True, help="Samples between false alarms.")
@click.option(
    "--within", type=click.FloatRange(min=1.0), metavar="SAMPLES", help="Choose the smallest watermark that tells a replay so soon."
)
@click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True, help="Which noise is drawn.")
@click.option("--json", "as_json", is_flag=True, help="Write the result as JSON (schema lathesim-watermark/1) and nothing else.")
@click.option("--save", type=OutputPath(), metavar="F.png", help="Draw the frontier: delay against cost.")
def watermark(
    pole: float,
    gain: float,
    feedback: float,
    process: float,
    reading: float,
    sizes: tuple[float, ...],
    false_alarm: float,
    within: float | None,
    seed: int,
    as_json: bool,
    save: Path | None,
) -> None:
    """Show for watermarks of several sizes what they cost, and how soon a guard tells readings that are replayed.

    The loop is x+ = a x + b u + w, y = x + v, with a Kalman filter. The guard adds up the likelihood ratio of innovation and watermark.
    """
    from lathesim.errors import LatheSimError
    from lathesim.experiments.watermark.guard_theory import Loop, frontier, watermark_within

    loop = Loop(pole, gain, feedback, process, reading)
    if abs(pole - gain * feedback) >= 1.0:
        fact = f"the loop is unstable: a - b L is {pole - gain * feedback:g}."
        raise LatheSimError(fact, place="--feedback", remedy="Choose a feedback with which it lies between -1 and 1.")
    wanted = watermark_within(loop, within, false_alarm) if within is not None else None
    asked = (*sizes, *((wanted,) if wanted else ())) or (0.02, 0.05, 0.1, 0.2)
    chosen = tuple(sorted({0.0, *asked}))
    points = frontier(loop, chosen, false_alarm, seed)
    if save is not None:
        from lathesim.analysis.experiment_figures import frontier_figure
        from lathesim.analysis.plots import save_figure

        told = [(point.watermark, point.cost, point.delay) for point in points if point.watermark > 0.0]
        save_figure(frontier_figure(told, points[0].cost, false_alarm), save)
    rows = [
        {
            "watermark": point.watermark,
            "cost": point.cost,
            "replayed_variance": loop.replayed_variance(point.watermark),
            "correlation": loop.replayed_correlation(point.watermark),
            "information_nats": loop.information(point.watermark),
            "threshold": point.threshold if math.isfinite(point.threshold) else None,
            "mean_delay_samples": point.delay if math.isfinite(point.delay) else None,
        }
        for point in points
    ]
    if as_json:
        result = {
            "schema": "lathesim-watermark/1",
            "gain": loop.gain,
            "innovation": loop.innovation,
            "memory": loop.memory,
            "chosen": wanted,
            "rows": rows,
        }
        click.echo(json.dumps(result, indent=2))
        return
    click.echo(f"Filter gain K {loop.gain:.6g}, innovation S {loop.innovation:.6g}, g {loop.memory:.6g}")
    click.echo(f"{'watermark':>10}{'E[x^2]':>11}{'var nu, replayed':>18}{'E[nu e], replayed':>19}{'mean delay [samples]':>22}")
    for point in points:
        delay = f"{point.delay:.1f}" if math.isfinite(point.delay) else "never"
        told_of = f"{loop.replayed_variance(point.watermark):>18.5g}{loop.replayed_correlation(point.watermark):>19.4g}"
        click.echo(f"{point.watermark:>10.4g}{point.cost:>11.5g}{told_of}{delay:>22}")
    if wanted:
        click.echo(f"A watermark of {wanted:.4g} tells within {within:g} samples: {loop.information(wanted):.3g} nats a sample.")
    click.echo("Without a watermark replayed readings are honest in every respect but their date, so no test of them tells.")
    if save is not None:
        click.echo(f"See {save}")
