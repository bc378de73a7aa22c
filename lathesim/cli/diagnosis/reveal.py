"""``lathesim reveal SEAL ANSWER``: the sealed answer of a concealed recording, opened, and a diagnosis graded by it."""

from __future__ import annotations

from pathlib import Path

import click


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
    from lathesim.exercises.graded_diagnosis import grade, grade_json, graded_lines, hidden_lines, read_guess
    from lathesim.exercises.sealed_answer import changed_files, opened
    from lathesim.json_text import written_json

    truth = opened(seal, answer)
    graded = grade(truth, read_guess(guess), within / 100.0) if guess is not None else None
    changed = changed_files(seal, truth)
    if as_json:
        shown = {"answer": {name: item for name, item in truth.items() if name != "salt"}, "changed_files": changed}
        click.echo(written_json({**shown, "grade": grade_json(graded) if graded else None}))
        return
    click.echo("The answer is the one that was sealed.")
    for name in changed:
        click.echo(f"{name} is missing or not as it was sealed.", err=True)
    click.echo("\nHidden:")
    for line in hidden_lines(truth):
        click.echo(f"  {line}")
    if graded is not None:
        click.echo(f"\n{graded.sentence}")
        for line in graded_lines(graded, within):
            click.echo(f"  {line}")
