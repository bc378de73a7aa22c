"""``lathesim learn LESSON``: learn from lap to lap."""

from __future__ import annotations

import json
import math
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from lathesim.cli.case_options import read_settings, set_option, variant_option
from lathesim.cli.output_path import OutputPath
from lathesim.cli.registry import open_registry, plugins_option

if TYPE_CHECKING:
    from lathesim.compensation.learn import Learning
    from lathesim.compensation.recorded_lap import Outlook

NO_BETTER = 0.97
"""Largest ratio of the floor to the error of a lap at which a further lap is worth its time (assumed)."""


@click.command()
@click.argument("lesson")
@click.option("--laps", type=click.IntRange(1, 1000), default=8, show_default=True, help="Laps after the first.")
@click.option("--what", type=click.Choice(("voltage", "reference")), default="voltage", show_default=True, help="What is corrected.")
@click.option("--on", type=click.Choice(("axis", "contour")), default="axis", show_default=True, help="Which error is learned from.")
@click.option("--without-filter", is_flag=True, help="Leave the robust filter out, to see what it is good for: it diverges.")
@click.option("--model", metavar="NAME", help="Variant whose frequency response the filter follows from [default: that of the run].")
@click.option(
    "--recording",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="A lap of a real machine: write the program of the next one to --out.",
)
@click.option("--out", type=OutputPath(folder=True), metavar="DIR", help="Write the lesson with what was learned.")
@click.option("--json", "as_json", is_flag=True, help="Write the result as JSON (schema lathesim-learning/1) and nothing else.")
@variant_option
@set_option
@plugins_option
def learn(
    lesson: str,
    laps: int,
    what: str,
    on: str,
    without_filter: bool,
    model: str | None,
    recording: Path | None,
    out: Path | None,
    as_json: bool,
    variant: str | None,
    settings: tuple[str, ...],
    plugin_folders: tuple[Path, ...],
) -> None:
    """Run LESSON lap after lap, each with a correction that the errors of the lap before improve.

    The filter follows from the lesson's own frequency response, measured by a pulse. It ends where a lap is no better than the one
    before, and says what the floor is: of the converter, of the encoder, or of what is not the same in each lap.
    """
    from lathesim.cli.working import working
    from lathesim.compensation.lap_response import learning_filter
    from lathesim.compensation.laps import course_of
    from lathesim.compensation.learn import learn as from_lap_to_lap
    from lathesim.compensation.learn import write_learned
    from lathesim.errors import WriteError
    from lathesim.lessons.lesson import load_lesson
    from lathesim.lessons.results_folder import keep_read_lesson, results_folder
    from lathesim.lessons.simulate import prepare

    loaded = load_lesson(lesson)
    keep_read_lesson(loaded, out)
    registry = open_registry(plugin_folders)
    overrides = read_settings(settings)
    prepared = prepare(loaded, registry, variant, overrides)
    # a part program changes the reference and cannot change a voltage
    what = "reference" if recording is not None else what
    began = time.perf_counter()
    with working(shown=not as_json) as tell:
        course = course_of(prepared, what)
        tell("measuring the frequency response")
        own = course if model is None else course_of(prepare(loaded, registry, model, overrides), what)
        chosen = learning_filter(own, filtered=not without_filter)
        if recording is not None:
            from lathesim.compensation.recorded_lap import next_lap

            files, outlook = next_lap(prepared, course, chosen, recording, registry, out or results_folder(loaded, recording))
            click.echo(f"{_promised(outlook)} See {', '.join(map(str, files))}")
            return
        if what == "reference":
            # what a level of the converter leaves follows from the answer to a voltage
            chosen = replace(chosen, answer=learning_filter(course_of(prepared, "voltage")).answer)
        learning = from_lap_to_lap(course, chosen, laps, on=on, tell=tell)
    lasted = time.perf_counter() - began
    written, refused = [], None
    try:
        written = write_learned(prepared, course, learning, out) if out is not None else []
    except WriteError as error:  # the result is printed first
        refused = error
    if as_json:
        click.echo(json.dumps(_as_json(lesson, learning, lasted, [str(file) for file in written]), indent=2))
    else:
        _tell(learning, lasted, written)
    if refused is not None:
        raise refused


def _tell(learning: Learning, lasted: float, written: list[Path]) -> None:
    chosen = learning.filter
    bound = f"predicted contraction of a lap at most {chosen.bound:.3f}, " if math.isfinite(chosen.bound) else ""
    cutoff = f"low-pass at {chosen.cutoff:.3g} Hz" if chosen.cutoff else "no low-pass"
    click.echo(f"{bound}{cutoff}\n")
    heads = ("tracking rms [mm]", "predicted at most", "of the lap before", "largest distance [mm]", "its rms [mm]")
    click.echo(f"{'lap':>4}" + "".join(f"{head:>{width}}" for head, width in zip(heads, (20, 20, 20, 24, 16), strict=True)))
    for number, lap in enumerate(learning.laps):
        share = f"{learning.contractions[number - 1]:.3f}" if number else "-"
        most = learning.predicted[number - 1] if number else math.nan
        told = f"{1e3 * most:.5g}" if math.isfinite(most) else "-"
        click.echo(f"{number:>4}{1e3 * lap.rms:>20.5g}{told:>20}{share:>20}{1e3 * lap.largest:>24.5g}{1e3 * lap.rms_contour:>16.4g}")
    first, best = learning.laps[0], learning.laps[learning.best]
    click.echo(f"\nIt stops because {learning.why}.")
    times = first.largest / best.largest if best.largest > 0.0 else math.inf
    click.echo(
        f"Lap {learning.best} is kept: the largest distance from the path is {times:.3g} times smaller than at first. {lasted:.1f} s."
    )
    if written:
        click.echo(f"See {', '.join(map(str, written))}")


def _promised(outlook: Outlook) -> str:
    """Return the error of a recorded lap, the predicted error of the next lap and the floor, as sentences."""
    now, following, floor = (f"{1e3 * value:.4g} mm" for value in (outlook.now, outlook.following, outlook.floor))
    text = f"The tracking error of this lap is {now} rms; the next one's is predicted to be {following}, "
    text += f"{outlook.following / outlook.now:.2f} of it. No lap is predicted to come below {floor}: that is the floor."
    return text if outlook.floor < NO_BETTER * outlook.now else f"{text} This lap has reached it: nothing is left to learn."


def _as_json(lesson: str, learning: Learning, lasted: float, files: list[str]) -> dict[str, object]:
    return {
        "schema": "lathesim-learning/1",
        "lesson": lesson,
        "predicted_contraction": _finite(learning.filter.bound),
        "cutoff_hz": learning.filter.cutoff,
        "floor_m": learning.floor,
        "laps": [
            {"rms_m": _finite(lap.rms), "largest_m": _finite(lap.largest), "rms_contour_m": _finite(lap.rms_contour)}
            for lap in learning.laps
        ],
        "predicted_at_most_m": [_finite(value) for value in learning.predicted],
        "contractions": [_finite(value) for value in learning.contractions],
        "kept": learning.best,
        "why": learning.why,
        "files": files,
        "wall_time_s": round(lasted, 2),
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
