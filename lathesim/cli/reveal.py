"""``lathesim reveal SEAL ANSWER``: the sealed answer of a concealed recording, opened, and a diagnosis graded by it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from lathesim.diagnosis.answer_grade import EffectGrade, Grade


@click.command()
@click.argument("seal", type=click.Path(path_type=Path))
@click.argument("answer", type=click.Path(path_type=Path))
@click.option("--guess", type=click.Path(path_type=Path), metavar="FILE.json", help="Grade this diagnosis.")
@click.option(
    "--within", type=click.FloatRange(min=0.0), default=5.0, show_default=True, metavar="PERCENT", help="How far off a size may be."
)
@click.option("--json", "as_json", is_flag=True, help="Write answer and grade as JSON and nothing else.")
def reveal(seal: Path, answer: Path, guess: Path | None, within: float, as_json: bool) -> None:
    """Check that ANSWER is the one that SEAL (a seal.json, or the folder it lies in) was made of, and show what was hidden.

    With --guess the JSON of 'lathesim diagnose' is graded: names, families, sizes, and whether the intervals hold the truth.
    """
    import json

    from lathesim.diagnosis.answer_grade import grade, grade_json, read_guess
    from lathesim.diagnosis.sealed_answer import changed_files, opened

    truth = opened(seal, answer)
    graded = grade(truth, read_guess(guess), within / 100.0) if guess is not None else None
    changed = changed_files(seal, truth)
    if as_json:
        shown = {"answer": {name: item for name, item in truth.items() if name != "salt"}, "changed_files": changed}
        click.echo(json.dumps({**shown, "grade": grade_json(graded) if graded else None}, indent=2))
        return
    click.echo("The answer is the one that was sealed.")
    for name in changed:
        click.echo(f"{name} is missing or not as it was sealed.", err=True)
    click.echo("\nHidden:")
    for line in hidden_lines(truth):
        click.echo(f"  {line}")
    if graded is not None:
        click.echo(f"\n{graded.sentence}")
        for line in _graded_lines(graded, within):
            click.echo(f"  {line}")


def hidden_lines(answer: Mapping[str, Any]) -> list[str]:
    """Give what is hidden and which values the machine really has, a line each."""
    from lathesim.diagnosis.report_text import pretty_unit, quantity_text

    lines = []
    for item in answer["effects"]:
        sizes = [f"{name} = {quantity_text(size['value'], size['unit'])}" for name, size in item["parameters"].items()]
        lines.append(f"{item['effect']} at {item['at']} ({item['family']}): {', '.join(sizes)}")
    lines = lines or ["nothing"]
    for name, item in answer["true_values"].items():
        off = f" ({(item['true'] - item['given']) / abs(item['given']):+.1%})" if item["given"] else ""
        lines.append(f"{name} is {item['true']:.5g} {pretty_unit(item['unit'])}, given as {item['given']:.5g}{off}")
    return lines


def _graded_lines(graded: Grade, within: float) -> list[str]:
    from lathesim.diagnosis.diagnosis import with_unit

    lines = []
    for item in graded.effects:
        lines.append(f"{item.effect} at {item.at}: {_naming(item)}")
        for name, size in item.sizes.items():
            held = "" if size.covered is None else ", its interval holds the truth" if size.covered else ", its interval misses the truth"
            verdict = f"within {within:g} %" if size.right else f"not within {within:g} %"
            off = f"off by {round(size.off, 3) + 0.0:.1%}"
            guess, true = (with_unit(f"{value:.4g}", size.unit) for value in (size.guess, size.true))
            lines.append(f"  {name}: {guess} for {true}, {off}, {verdict}{held}")
    lines += [f"{name} was named in vain" for name in graded.wrong_names]
    return lines


def _naming(item: EffectGrade) -> str:
    if item.named:
        first = "named first" if item.first else "named"
        return first if item.place else f"{first}, at another place"
    if item.tied:
        return "not named, but called tied"
    return "not named, but its family is right" if item.family else "not named"
