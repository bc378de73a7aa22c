"""``lathesim compare LESSON RECORDING``: how far simulation and recording are apart, where, and on what it depends."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from lathesim.cli.options import ChosenLesson, OutputPath, grouped, json_option, plugins_option, variant_option
from lathesim.cli.writing import CommandResult, write
from lathesim.whole_file import make_folder

if TYPE_CHECKING:
    from lathesim.compensation.written_remedy import Kept
    from lathesim.diagnosis.comparison.compare import Comparison
    from lathesim.lessons.lesson import Lesson
    from lathesim.plugins import Registry


@click.command()
@click.argument("lesson")
@click.argument("recording", type=click.Path(path_type=Path))
@variant_option
@json_option("lathesim-compare/1")
@click.option("--out", type=OutputPath(folder=True), metavar="DIR", help="Where the figure goes [default: lathesim_runs/LESSON/].")
@click.option("--no-plots", is_flag=True, help="Draw no figure.")
@plugins_option
@grouped(chosen=ChosenLesson)
def compare(chosen: ChosenLesson, recording: Path, as_json: bool, out: Path | None, no_plots: bool) -> int:
    """Hold RECORDING against the simulation of LESSON.

    The lesson says in 'recordings:' what the columns mean. The first table gives the error of each channel and its noise. The second one
    shows the parts in which the error arises when every part gets its recorded inputs. A list says on what the error depends, with the
    periods of waves. Only the start of the motion is fitted. If 'lathesim remedy' wrote LESSON, its promise is compared with the result.
    """
    import os

    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

    from lathesim.diagnosis.comparison.compare import as_json as as_json_of
    from lathesim.diagnosis.comparison.compare import compare as compared
    from lathesim.diagnosis.comparison.compare import load_recording
    from lathesim.lessons.lesson import results_folder

    registry, loaded = chosen.registry, chosen.loaded
    comparison = compared(loaded.name, *load_recording(loaded, recording, registry, chosen.variant))
    kept = _promises(loaded, recording, registry)
    folder = out or results_folder(loaded, recording, variant=chosen.variant)
    figure = None if no_plots else _drawn(comparison, folder / f"{recording.stem}_compared.png")
    data = {**as_json_of(comparison), "figure": figure, "promises": [vars(item) | {"holds": item.holds} for item in kept]}
    return write(CommandResult("lathesim-compare/1", data, _lines(comparison, kept, figure)), as_json)


def _lines(comparison: Comparison, kept: Sequence[Kept], figure: Path | None) -> Iterator[str]:
    from lathesim.analysis.display_unit import shown_with_unit
    from lathesim.diagnosis.comparison.compare_text import comparison_lines

    yield from comparison_lines(comparison)
    for item in kept:
        sizes = [shown_with_unit(value, item.unit) for value in (item.before, item.low, item.high, item.result)]
        yield f"{item.name}: {sizes[0]} before, promised {sizes[1]} to {sizes[2]}, now {sizes[3]}: {item.told}"
    if figure is not None:
        yield f"\nSee {figure}"


def _promises(lesson: Lesson, recording: Path, registry: Registry) -> list[Kept]:
    """Return what a remedied lesson promised, held against the recording; nothing where no promise stands beside it."""
    from lathesim.compensation.written_remedy import kept_promises, promise_beside

    promise = promise_beside(lesson)
    return kept_promises(lesson, recording, registry, promise) if promise is not None else []


def _drawn(comparison: Comparison, path: Path) -> Path:
    from lathesim.analysis.plots import save_figure
    from lathesim.diagnosis.comparison.compare_figure import compare_figure

    make_folder(path.parent)
    save_figure(compare_figure(comparison), path)
    return path
