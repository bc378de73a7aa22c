"""``lathesim compare`` and ``fit``: how far simulation and recording are apart, and parameters of a lesson from a recording."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from lathesim.cli.options import ChosenLesson, OutputPath, grouped, json_option, of_case, of_lesson, option, read_names, variant_option
from lathesim.cli.writing import CommandResult, write
from lathesim.whole_file import make_folder, write_text

if TYPE_CHECKING:
    from lathesim.compensation.written_remedy import Kept
    from lathesim.diagnosis.comparison.compare import Comparison
    from lathesim.identification.estimation.multistart import FittedParameter, ParameterFit
    from lathesim.lessons.lesson import Lesson
    from lathesim.plugins import Registry


@click.command()
@click.argument("lesson")
@click.argument("recording", type=click.Path(path_type=Path))
@variant_option
@json_option("lathesim-compare/1")
@click.option("--out", type=OutputPath(folder=True), metavar="DIR", help="Where the figure goes [default: lathesim_runs/LESSON/].")
@click.option("--no-plots", is_flag=True, help="Draw no figure.")
@of_lesson
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
    from lathesim.diagnosis.comparison.compare_text import compare_figure

    make_folder(path.parent)
    save_figure(compare_figure(comparison), path)
    return path


@dataclass(frozen=True)
class FitOptions:
    """What is fitted and from where, and where the lesson with the fitted values goes."""

    free: tuple[str, ...] = option("What is fitted: parameters, or starts of states.", required=True, metavar="PART.NAME,...")
    starts: int = option("Fits begun within 50 % of the given values.", type=click.IntRange(min=1), default=4)
    seed: int = option("Which starts these are.", type=click.IntRange(min=0), default=1)
    closed: bool = option("Leave the machine's loops closed, instead of replaying what was recorded.", "--closed-loop")
    out: Path | None = option("Write the lesson with the fitted values.", type=OutputPath(), metavar="LESSON.yaml")


@click.command()
@click.argument("lesson")
@click.argument("recording", type=click.Path(path_type=Path))
@grouped(wish=FitOptions)
@json_option("lathesim-fit/1")
@of_case
def fit(chosen: ChosenLesson, recording: Path, wish: FitOptions, as_json: bool) -> int:
    """Fit parameters of LESSON to RECORDING by least squares, with standard errors, and say what the recording does not determine.

    The lesson says in ``recordings:`` what the columns mean. Every part is driven by what was recorded of its inputs, so the controllers
    do not hide a wrong value.
    """
    import os

    # the runs of a batch share the cores already: threads of the linear algebra would only fight them
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

    from lathesim.identification.estimation.multistart import as_json as as_json_of
    from lathesim.identification.estimation.multistart import ask_fit, fit_parameters

    loaded, names = chosen.loaded, read_names(wish.free)
    question = ask_fit(loaded, recording, chosen.registry, names, chosen.variant, chosen.overrides, closed=wish.closed)
    found = fit_parameters(question, starts=wish.starts, seed=wish.seed, tell=None if as_json else _progress)
    findings = [str(finding) for finding in question.findings]
    write(CommandResult("lathesim-fit/1", as_json_of(loaded.name, str(recording), found, findings), fit_lines(found, findings)), as_json)
    if wish.out is not None:
        _write(loaded, found, wish.out)
        if not as_json:
            click.echo(f"\nThe lesson with these values is {wish.out}")
    return 0


def _progress(done: int, starts: int) -> None:
    if sys.stderr.isatty():
        click.echo(f"\rStart {done} of {starts}" + ("\n" if done == starts else ""), nl=False, err=True)


def fit_lines(found: ParameterFit, findings: list[str]) -> Iterator[str]:
    """Yield the result of a fit as a person reads it."""
    from lathesim.analysis.display_unit import shown_with_unit, text_table

    yield from [f"Recording: {text}" for text in findings] + [""] * bool(findings)
    rows: list[tuple[str, ...]] = [("parameter", "value", "standard error", "unit", "given")]
    yield from text_table(rows + [(item.name, *_value(item), _unit(item), f"{item.given:.6g}") for item in found.parameters])
    rows = [("channel", "misfit, rms, as given", "fitted", "floor")]
    for item in found.channels:
        rows.append((item.channel, *(shown_with_unit(size, item.unit, 3) for size in (item.before, item.after, item.floor))))
    yield from ("", *text_table(rows), "")
    yield from (f"{first} and {second} go together (correlation {rho:+.3f})." for first, second, rho in found.correlated)
    yield from found.undetermined
    yield f"{found.agreeing} of {found.starts} starts agree; {found.runs} runs, {found.wall_time:.1f} s."


def _value(item: FittedParameter) -> tuple[str, str]:
    """Return value and standard error as text, to the two digits of the error that mean something."""
    if not item.determined:
        return "not determined", "-"
    if not 0.0 < item.error < math.inf or item.value == 0.0:
        return f"{item.value:.6g}", f"{item.error:.2g}"
    digits = max(1, 2 + math.floor(math.log10(abs(item.value))) - math.floor(math.log10(item.error)))
    return f"{item.value:.{min(digits, 12)}g}", f"{item.error:.2g}"


def _unit(item: FittedParameter) -> str:
    """Return the unit without the brackets that stand around what was filled in; nothing for a pure number."""
    unit = re.sub(r"\(+(\w+)\)+", r"\1", item.unit)
    return "" if unit == "1" else unit


def _write(lesson: Lesson, found: ParameterFit, out: Path) -> None:
    from lathesim.errors import LessonError
    from lathesim.lessons.changed_lesson import changed_lesson

    values = {item.name: f"{item.value:.10g} {_unit(item)}".strip() for item in found.parameters if item.determined}
    if not out.parent.is_dir():
        raise LessonError(f"there is no folder '{out.parent}'.", place=str(out), remedy="Make it, or choose another place.")
    write_text(out, changed_lesson(lesson, [], values, out.parent))
