"""``lathesim train LESSON``: find the weights of a neural regulator."""

from __future__ import annotations

import json
import time
from pathlib import Path

import click

from lathesim.cli.output_path import OutputPath
from lathesim.cli.registry import open_registry, plugins_option


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
@click.option("--json", "as_json", is_flag=True, help="Write the result as JSON (schema lathesim-training/1) and nothing else.")
@plugins_option
def train(
    lesson: str,
    out: Path,
    variants: tuple[str, ...],
    judges: tuple[str, ...],
    method: str,
    hidden: int,
    score: str,
    starts: int,
    rounds: int | None,
    seed: int,
    as_json: bool,
    plugin_folders: tuple[Path, ...],
) -> None:
    """Find the weights of LESSON's neural regulator and write them as a table that the lesson can name under 'tables:'.

    All starts are told. The best is judged in each variant with the lesson's own steps, beside the regulator whose weights are zero.
    """
    from lathesim.cli.working import working
    from lathesim.compensation.train import method_named
    from lathesim.compensation.train import train as search
    from lathesim.compensation.training_question import Shape, question_of, score_named
    from lathesim.components.predictive_controllers import NeuralRegulator
    from lathesim.lessons.lesson import load_lesson
    from lathesim.lessons.part_tables import write_table

    chosen, shape, wanted = method_named(method), Shape(hidden), score_named(score)
    loaded, registry = load_lesson(lesson), open_registry(plugin_folders)
    question = question_of(loaded, registry, variants, wanted, shape)
    judged = question_of(loaded, registry, tuple(dict.fromkeys((*variants, *judges))), wanted, shape) if judges else None
    began = time.perf_counter()
    with working(shown=not as_json) as tell:
        training = search(question, chosen, starts=starts, rounds=rounds, seed=seed, judged=judged, tell=tell)
    lasted = time.perf_counter() - began
    columns = NeuralRegulator.declarations["weights"].columns  # type: ignore[attr-defined]
    if as_json:
        result = {
            "schema": "lathesim-training/1",
            "lesson": lesson,
            "method": method,
            "score": score,
            "weights": shape.weights,
            "starts": [{"score": item.score if not item.diverged else None, "rounds": item.rounds} for item in training.starts],
            "scores": training.scores,
            "zero_regulator": training.zero,
            "file": str(out),
            "wall_time_s": round(lasted, 2),
        }
        click.echo(json.dumps(result, indent=2))
        write_table(out, columns, training.table)
        return
    for number, item in enumerate(training.starts, start=1):
        told = "diverged" if item.diverged else f"score {item.score:.4g}"
        click.echo(f"start {number}: {told} after {item.rounds} rounds")
    click.echo(f"\n{'variant':<16}{'trained':>12}{'zero regulator':>16}")
    for name, value in training.scores.items():
        click.echo(f"{name:<16}{value:>12.4g}{training.zero[name]:>16.4g}")
    worse = [name for name, value in training.scores.items() if value > training.zero[name]]
    if worse:
        click.echo(f"\nWith weights of zero, the tangent speed alone, {', '.join(worse)} scores better than what was trained.")
    write_table(out, columns, training.table)
    click.echo(f"\n{shape.weights} weights, {lasted:.1f} s. See {out}; a lesson names it as 'tables: {{{question.table}: {out.name}}}'.")
