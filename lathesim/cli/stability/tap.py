"""``lathesim tap LESSON``: the tool point hit with a hammer, and its frequency response."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lathesim.cli.options import OutputPath, json_option, save_option
from lathesim.cli.writing import CommandResult, write

if TYPE_CHECKING:
    from lathesim.stability.tap import TapEstimate


@click.command()
@click.argument("lesson")
@click.option("--recording", type=click.Path(path_type=Path), metavar="FILE.csv", help="Hits that were recorded: time, force and response.")
@click.option("--seed", type=click.IntRange(min=0), help="Another seed of noise and hand.")
@click.option("--hits", type=click.IntRange(1, 50), help="How many hits are to be kept.")
@click.option(
    "--out", type=OutputPath(makes_folder=True), metavar="F.csv|F.mat|F.uff", help="Where the response goes  [default: lathesim_runs/]."
)
@json_option("lathesim-tap/1")
@save_option("Draw the response with its coherence.")
def tap(lesson: str, recording: Path | None, seed: int | None, hits: int | None, out: Path | None, as_json: bool, save: Path | None) -> int:
    """Hit the tool point of LESSON with a hammer and estimate its frequency response along the normal.

    Double hits and overloads are found, left out and said; another hit is then made in their place. 'tap:' under 'tool_point:' says how it
    is tapped. With --recording the hits of a file are evaluated instead; its columns name time, force and displacement, velocity or
    acceleration, with their units. 'lathesim modes' finds the modes in the file that is written.
    """
    from lathesim.lessons.lesson import load_lesson, results_folder
    from lathesim.stability.lesson_settings import recorded_tap, tap_lesson
    from lathesim.stability.response_files import write_response

    loaded = load_lesson(lesson)
    found = recorded_tap(recording) if recording is not None else tap_lesson(loaded, loaded.settings.seed if seed is None else seed, hits)
    place = out or results_folder(loaded, recording) / "tap.csv"
    write_response(found.response, place)
    result = CommandResult("lathesim-tap/1", _data(found, place), _lines(found, place), lambda: _figure(loaded.title, found))
    return write(result, as_json, save)


def _figure(title: str, found: TapEstimate) -> Any:
    from lathesim.analysis.stability_figures import response_figure

    response = found.response
    return response_figure(f"{title}: tap test", response.frequency, response.receptance_values, coherence=response.coherence)


def _data(found: TapEstimate, place: Path) -> dict[str, Any]:
    response = found.response
    return {
        "response": place,
        "lines": len(response.frequency),
        "highest_frequency_hz": response.highest,
        "window_rate_per_s": response.window_rate,
        "hits": [{"hit": hit.number, "peak_n": hit.peak, "kept": not hit.reason, "reason": hit.reason} for hit in found.hits],
        "lowest_coherence": None if response.coherence is None else response.coherence.min(),
        "largest_difference_of_h1_and_h2": abs(found.by_h2 / response.receptance_values - 1.0).max(),
    }


def _lines(found: TapEstimate, place: Path) -> Iterator[str]:
    import numpy as np

    from lathesim.units import in_unit

    response = found.response
    for hit in found.hits:
        yield f"hit {hit.number}: {hit.peak:.0f} N, " + (f"left out: {hit.reason}" if hit.reason else "kept")
    kept = sum(not hit.reason for hit in found.hits)
    yield f"\nResponse of {kept} hits by H1, {response.frequency[0]:.3g} to {response.highest:.0f} Hz in {len(response.frequency)} lines"
    if response.coherence is not None:
        poor = in_unit(float(np.mean(response.coherence < 0.9)), "%", ".0f")
        yield f"Coherence: median {np.median(response.coherence):.4f}; below 0.9 at {poor} of the lines"
    if response.window_rate:
        yield f"The response had not died out: an exponential window of {response.window_rate:.3g} 1/s is in it, and kept in the file"
    yield f"Response: {place}\nNext: lathesim modes {place}"
