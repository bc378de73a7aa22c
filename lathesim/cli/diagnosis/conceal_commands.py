"""``lathesim conceal`` and ``reveal``: a recording with an effect hidden in it, and its sealed answer."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import click

from lathesim.cli.options import OutputPath, grouped, open_registry, option, plugins_option

VALIDATION = "validation"
"""Variant of a lesson that is the situation of its second recording."""


@dataclass(frozen=True)
class HidingOptions:
    """What is hidden, and how it is recorded."""

    asked: tuple[str, ...]
    at_random: bool
    answer: Path | None = option("Where the answer goes [default: DIR_answer.json].", type=OutputPath(makes_folder=True), metavar="FILE")
    validate: bool = option(f"Record a second time, in the lesson's variant '{VALIDATION}' where it has one.")
    drive: Path | None = option("A recording that holds the inputs the lesson drives.", metavar="FILE")
    noise: float = option("Noise of each sensor, in steps of its resolution.", type=click.FloatRange(min=0.0), default=1.0)
    seed: int | None = option("Draw the same again [default: drawn, and kept in the answer].", type=click.IntRange(min=0))


@click.command()
@click.argument("lesson", required=False)
@click.option("--again", "again", type=click.Path(path_type=Path), metavar="ANSWER.json", help="Record the machine of this answer again.")
@click.option("--lesson", "remedied", metavar="LESSON", help="With --again: the lesson with remedies that is on its control now.")
@click.option(
    "--effect", "asked", multiple=True, metavar="NAME[:PARAMETER=VALUE,...][@PART]",
    help="What is hidden, for example CoulombFriction:level=20 N@x_axis; several times for several, 'none' for nothing.",
)  # fmt: skip
@click.option("--random", "at_random", is_flag=True, help="Let nothing, one effect or two be drawn.")
@click.option("--out", type=OutputPath(folder=True), required=True, metavar="DIR", help="The folder for the class.")
@grouped(hiding=HidingOptions)
@plugins_option
def conceal(
    lesson: str | None, again: Path | None, remedied: str | None, out: Path, plugin_folders: tuple[Path, ...], hiding: HidingOptions
) -> None:
    """Hide an effect in the machine of LESSON, record it, and seal the answer; or record a concealed machine again, with a remedy.

    DIR gets recording.csv, with --validate a second one, the lesson for the class, and seal.json with the digest of the answer. The machine
    behind the recording has noisy sensors, and its values vary within what the lesson calls uncertain. Another integrator with a finer step
    runs it. A class that knows the seed could make the recording again: keep it to yourself.
    """
    asked = hiding.asked
    if again is not None:
        if remedied is None or lesson is not None or asked or hiding.at_random:
            raise click.UsageError(
                "--again takes --lesson and --out, and hides nothing else: conceal --again ANSWER.json --lesson L.yaml --out DIR."
            )
        _record_again(again, remedied, out, plugin_folders)
        return
    if lesson is None or remedied is not None:
        raise click.UsageError("Name the LESSON in whose machine something is hidden; --lesson goes with --again.")
    if hiding.at_random == bool(asked):
        raise click.UsageError("Say what is hidden with --effect, or leave it to --random.")
    if "none" in asked and len(asked) > 1:
        raise click.UsageError("--effect none hides nothing, so it stands alone.")
    _hide(lesson, hiding, out, plugin_folders)


def _hide(lesson: str, hiding: HidingOptions, out: Path, plugin_folders: tuple[Path, ...]) -> None:
    """Hide, record and seal, and say where everything is."""
    from lathesim.exercises.class_folder import Hiding, conceal_case
    from lathesim.exercises.graded_diagnosis import hidden_lines
    from lathesim.lessons.lesson import load_lesson

    registry = open_registry(plugin_folders)
    how = Hiding(**{**vars(hiding), "asked": [text for text in hiding.asked if text != "none"]})
    concealed, published = conceal_case(load_lesson(lesson), registry, out, how, tell=lambda text: click.echo(text, err=True))
    click.echo("Hidden:")
    for line in hidden_lines(published.answer):
        click.echo(f"  {line}")
    for name, floors in concealed.moves.items():
        click.echo(f"  moves {name} by {floors:.3g} times its noise")
    if concealed.lost_in_noise:
        click.echo(concealed.lost_in_noise, err=True)
    click.echo(f"For the class: {', '.join(map(str, published.files))}")
    click.echo(f"The answer, to be kept: {published.answer_file}")


def _record_again(answer: Path, lesson: str, out: Path, plugin_folders: tuple[Path, ...]) -> None:
    """Record the concealed machine with a remedied lesson, and tell what the remedies removed."""
    from lathesim.analysis.display_unit import shown_with_unit
    from lathesim.exercises.again import record_again
    from lathesim.lessons.lesson import load_lesson
    from lathesim.units import in_unit

    result = record_again(answer, load_lesson(lesson), open_registry(plugin_folders), out)
    for name, before in result.before.items():
        told = f"{shown_with_unit(before, 'm')} before, {shown_with_unit(result.after[name], 'm')} after"
        share = result.removed.get(name)
        removed = f": {in_unit(share, '%', '.1f')} of what the hidden effects added is removed" if share is not None else ""
        click.echo(f"{name} is off the sound machine by {told}{removed}")
    click.echo(f"See {', '.join(map(str, result.files))}")


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
