"""``lathesim remedy LESSON DIAGNOSIS.json``: from the name of an effect to its compensation."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

from lathesim.cli.options import ChosenLesson, OutputPath, json_option, of_variant
from lathesim.cli.progress import working
from lathesim.cli.writing import CommandResult, Heading, table, write

if TYPE_CHECKING:
    from lathesim.compensation.lap_response import LoopGain
    from lathesim.compensation.remedying import Answer


_MOST_SHOWN = 12
"""Lines of a text for a control that are printed too."""
_SIZES = (Heading("", -40), Heading("before", 12), Heading("after", 12), Heading("promised", 24), Heading("removed", 10))


@click.command()
@click.argument("lesson")
@click.argument("diagnosis", type=click.Path(path_type=Path))
@click.option(
    "--as", "form", type=click.Choice(("lesson", "program", "table")), default="lesson", show_default=True,
    help="The lesson with its remedies; for a closed control a changed part program; or the table to type in.",
)  # fmt: skip
@click.option(
    "--for", "control", type=click.Choice(("linuxcnc", "grblhal", "smoothieware", "klipper", "sinumerik", "table")),
    help="Write the lines of this control too, with the numbers that its text holds; table: the numbers for any other one.",
)  # fmt: skip
@click.option("--out", type=OutputPath(folder=True), required=True, metavar="DIR", help="Where the files go.")
@json_option("lathesim-remedy/1", "the answer")
@click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True, help="Draw what is uncertain in the same way again.")
@click.option("--without-margin", is_flag=True, help="Size at the estimates, without the margin against overcompensation.")
@of_variant
def remedy(
    chosen: ChosenLesson, diagnosis: Path, form: str, control: str | None, out: Path, as_json: bool, seed: int, without_margin: bool
) -> int:
    """Choose, size and try what compensates the effects that DIAGNOSIS.json names in the machine of LESSON.

    The remedies are tried on the diagnosed machine, before and after, over draws of what the diagnosis leaves uncertain. What is promised
    stands in DIR/remedy.json with its intervals, and so does what no remedy of a control can mend, and why. 'lathesim conceal --again'
    records a concealed machine anew with the remedies in, and 'lathesim compare' holds the promise against the result.
    """
    from lathesim.compensation.control_lines import CONTROLS
    from lathesim.compensation.diagnosed_machine import Diagnosed, read_diagnosis
    from lathesim.compensation.remedying import remedy as compensate
    from lathesim.compensation.written_remedy import as_json as as_json_of
    from lathesim.compensation.written_remedy import write_answer, write_lesson
    from lathesim.lessons.lesson import keep_read_lesson

    if control is not None and form == "program":
        raise click.UsageError("--as program changes the part program, and no setting of a control: give it without --for.")
    found = read_diagnosis(diagnosis)
    keep_read_lesson(chosen.loaded, out)
    began = time.perf_counter()
    with tempfile.TemporaryDirectory(prefix="lathesim_remedy_") as trials, working(shown=not as_json) as tell:
        diagnosed = Diagnosed.of(chosen.loaded, chosen.registry, found, Path(trials), chosen.variant)
        answer = compensate(diagnosed, found, margin=not without_margin, seed=seed, tell=tell, control=CONTROLS.get(control or ""))
        files = write_lesson(answer, out)
        if form == "program":
            from lathesim.compensation.written_remedy import write_program

            tell("mirroring the path")
            files += write_program(answer, out)
        if "table" in (form, control):
            from lathesim.compensation.written_remedy import write_control_table

            files.append(write_control_table(answer, out))
    data = as_json_of(answer, chosen.lesson, [file.name for file in files], time.perf_counter() - began)
    files.append(write_answer(data, out))
    return write(CommandResult("lathesim-remedy/1", data, _lines(answer, files, time.perf_counter() - began)), as_json)


def _lines(answer: Answer, files: list[Path], lasted: float) -> Iterator[str]:
    from lathesim.analysis.display_unit import shown_with_unit
    from lathesim.compensation.promise import RECORDED
    from lathesim.units import in_unit

    if answer.nothing:
        yield f"{answer.nothing}\nThe lesson is written as it was. See {', '.join(map(str, files))}"
        return
    for line in answer.lines:
        units = answer.bench.units(line.name) if answer.bench is not None else {}
        values = ", ".join(f"{name} {shown_with_unit(value, units[name])}" for name, value in line.values.items() if value)
        yield f"{line.remedy} at {line.at}, against {', '.join(line.answers)}: {values or 'a table'}{_share(line.share)}"
        yield f"  {answer.diagnosed.registry.remedies[line.remedy].cannot}"  # type: ignore[attr-defined]
    yield from (f"{item.effect} at {item.at}: {item.why}." for item in answer.not_mended)
    yield from (f"{loop.controller}: {_room(loop)}" for loop in answer.gains)
    yield from answer.cautions
    for file, text in answer.texts.items():
        written = text.splitlines()
        more = [f"({len(written) - _MOST_SHOWN} more lines)"] if len(written) > _MOST_SHOWN else []
        yield from ("", f"To paste, {file}:", *(f"  {line}" for line in [*written[:_MOST_SHOWN], *more]))
    if answer.promise:
        rows = []
        for size in (item for item in answer.promise if not item.name.startswith(RECORDED)):
            before, after, low, high = (shown_with_unit(value, size.unit) for value in (size.before, size.after, size.low, size.high))
            removed = in_unit(size.removed, "%", ".0f") if not size.name.startswith("largest_voltage") else ""
            rows.append((size.name, before, after, f"{low} to {high}", removed))
        yield ""
        yield from table(_SIZES, rows)
        yield f"\nBetter than before in {in_unit(answer.better_in, '%', '.0f')} of the draws."
    yield f"{lasted:.1f} s. See {', '.join(map(str, files))}"


def _room(loop: LoopGain) -> str:
    own = f"the loop gain is {loop.gain:.4g} 1/s. It is stable up to {loop.largest:.4g} 1/s"
    return f"{own}, and up to {loop.largest_without:.4g} 1/s without the effect." if loop.largest_without is not None else f"{own}."


def _share(share: float) -> str:
    from lathesim.units import in_unit

    return f" (set to {in_unit(share, '%', '.0f')} of that, as more would be worse than less)" if share != 1.0 else ""
