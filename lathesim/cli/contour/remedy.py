"""``lathesim remedy LESSON DIAGNOSIS.json``: from the name of an effect to its compensation."""

from __future__ import annotations

import json
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

import click

from lathesim.cli.case_options import variant_option
from lathesim.cli.output_path import OutputPath
from lathesim.cli.registry import open_registry, plugins_option

if TYPE_CHECKING:
    from lathesim.compensation.loop_gains import LoopGain
    from lathesim.compensation.remedying import Answer


@click.command()
@click.argument("lesson")
@click.argument("diagnosis", type=click.Path(path_type=Path))
@click.option(
    "--as", "form", type=click.Choice(("lesson", "program", "table")), default="lesson", show_default=True,
    help="The lesson with its remedies; for a closed control a changed part program; or the table to type in.",
)  # fmt: skip
@click.option("--out", type=OutputPath(folder=True), required=True, metavar="DIR", help="Where the files go.")
@click.option("--json", "as_json", is_flag=True, help="Write the answer as JSON (schema lathesim-remedy/1) and nothing else.")
@click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True, help="Draw what is uncertain in the same way again.")
@click.option("--without-margin", is_flag=True, help="Size at the estimates, without the margin against overcompensation.")
@variant_option
@plugins_option
def remedy(
    lesson: str,
    diagnosis: Path,
    form: str,
    out: Path,
    as_json: bool,
    seed: int,
    without_margin: bool,
    variant: str | None,
    plugin_folders: tuple[Path, ...],
) -> None:
    """Choose, size and try what compensates the effects that DIAGNOSIS.json names in the machine of LESSON.

    The remedies are tried on the diagnosed machine, before and after, over draws of what the diagnosis leaves uncertain. What is promised
    stands in DIR/remedy.json with its intervals, and so does what no remedy of a control can mend, and why. 'lathesim conceal --again'
    records a concealed machine anew with the remedies in, and 'lathesim compare' holds the promise against the result.
    """
    from lathesim.cli.working import working
    from lathesim.compensation.diagnosis_file import read_diagnosis
    from lathesim.compensation.remedying import remedy as compensate
    from lathesim.compensation.written_remedy import as_json as told_as_json
    from lathesim.compensation.written_remedy import write_answer, write_lesson
    from lathesim.lessons.lesson import load_lesson
    from lathesim.lessons.results_folder import keep_read_lesson

    found = read_diagnosis(diagnosis)
    loaded = load_lesson(lesson)
    keep_read_lesson(loaded, out)
    registry = open_registry(plugin_folders)
    began = time.perf_counter()
    with tempfile.TemporaryDirectory(prefix="lathesim_remedy_") as trials, working(shown=not as_json) as tell:
        answer = compensate(loaded, registry, found, Path(trials), variant=variant, margin=not without_margin, seed=seed, tell=tell)
        files = write_lesson(answer, out)
        if form == "program":
            from lathesim.compensation.closed_control import write_program

            tell("mirroring the path")
            files += write_program(answer, out)
        if form == "table":
            from lathesim.compensation.written_remedy import write_control_table

            files.append(write_control_table(answer, out))
    data = told_as_json(answer, lesson, [file.name for file in files], time.perf_counter() - began)
    files.append(write_answer(data, out))
    if as_json:
        click.echo(json.dumps(data, indent=2))
        return
    _tell(answer, files, time.perf_counter() - began)


def _tell(answer: Answer, files: list[Path], lasted: float) -> None:
    from lathesim.analysis.display_unit import shown_with_unit
    from lathesim.compensation.promise import RECORDED

    if answer.nothing:
        click.echo(f"{answer.nothing}\nThe lesson is written as it was. See {', '.join(map(str, files))}")
        return
    for line in answer.lines:
        units = answer.bench.units(line.name) if answer.bench is not None else {}
        values = ", ".join(f"{name} {shown_with_unit(value, units[name])}" for name, value in line.values.items() if value)
        click.echo(f"{line.remedy} at {line.at}, against {', '.join(line.answers)}: {values or 'a table'}{_share(line.share)}")
        click.echo(f"  {answer.diagnosed.registry.remedies[line.remedy].cannot}")  # type: ignore[attr-defined]
    for item in answer.not_mended:
        click.echo(f"{item.effect} at {item.at}: {item.why}.")
    for loop in answer.gains:
        click.echo(f"{loop.controller}: {_room(loop)}")
    for caution in answer.cautions:
        click.echo(caution)
    if answer.promise:
        click.echo(f"\n{'':<40}{'before':>12}{'after':>12}{'promised':>24}{'removed':>10}")
        for size in (item for item in answer.promise if not item.name.startswith(RECORDED)):
            low, high = shown_with_unit(size.low, size.unit), shown_with_unit(size.high, size.unit)
            before, after = shown_with_unit(size.before, size.unit), shown_with_unit(size.after, size.unit)
            removed = f"{100.0 * size.removed:.0f} %" if not size.name.startswith("largest_voltage") else ""
            click.echo(f"{size.name:<40}{before:>12}{after:>12}{low + ' to ' + high:>24}{removed:>10}")
        click.echo(f"\nBetter than before in {100.0 * answer.better_in:.0f} % of the draws.")
    click.echo(f"{lasted:.1f} s. See {', '.join(map(str, files))}")


def _room(loop: LoopGain) -> str:
    own = f"the loop gain is {loop.gain:.4g} 1/s. It is stable up to {loop.largest:.4g} 1/s"
    return f"{own}, and up to {loop.largest_without:.4g} 1/s without the effect." if loop.largest_without is not None else f"{own}."


def _share(share: float) -> str:
    return f" (set to {100.0 * share:.0f} % of that, as more would be worse than less)" if share != 1.0 else ""
