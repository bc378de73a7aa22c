"""``lathesim conceal LESSON``: a recording with an effect hidden in it, for a class or for proof."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, cast

import click

from lathesim.cli.registry import open_registry, plugins_option

if TYPE_CHECKING:
    from lathesim.diagnosis.conceal import Concealed, Situation
    from lathesim.diagnosis.hidden_effect import Wish
    from lathesim.diagnosis.logged_column import LoggedColumn
    from lathesim.effects.effect import Effect
    from lathesim.engine.assembly import FloatArray
    from lathesim.lessons.lesson import Lesson
    from lathesim.lessons.simulate import Prepared
    from lathesim.plugins import Registry

VALIDATION = "validation"
"""Variant of a lesson that is the situation of its second recording."""
_SEEDS = 1 << 48
_ATTEMPTS = 10


@click.command()
@click.argument("lesson")
@click.option(
    "--effect", "asked", multiple=True, metavar="NAME[:PARAMETER=VALUE,...][@PART]",
    help="What is hidden, for example CoulombFriction:level=20 N@x_axis; several times for several, 'none' for nothing.",
)  # fmt: skip
@click.option("--random", "at_random", is_flag=True, help="Let nothing, one effect or two be drawn.")
@click.option("--out", type=click.Path(path_type=Path), required=True, metavar="DIR", help="The folder for the class.")
@click.option("--answer", type=click.Path(path_type=Path), metavar="FILE", help="Where the answer goes [default: DIR_answer.json].")
@click.option("--validate", is_flag=True, help=f"Record a second time, in the lesson's variant '{VALIDATION}' where it has one.")
@click.option("--drive", type=click.Path(path_type=Path), metavar="FILE", help="A recording that holds the inputs the lesson drives.")
@click.option(
    "--noise", type=click.FloatRange(min=0.0), default=1.0, show_default=True, help="Noise of each sensor, in steps of its resolution."
)
@click.option("--seed", type=click.IntRange(min=0), help="Draw the same again [default: drawn, and kept in the answer].")
@plugins_option
def conceal(
    lesson: str,
    asked: tuple[str, ...],
    at_random: bool,
    out: Path,
    answer: Path | None,
    validate: bool,
    drive: Path | None,
    noise: float,
    seed: int | None,
    plugin_folders: tuple[Path, ...],
) -> None:
    """Hide an effect in the machine of LESSON, record it, and seal the answer.

    DIR gets recording.csv, with --validate a second one, the lesson for the class, and seal.json with the digest of the answer. The machine
    behind the recording has other values within what the lesson calls uncertain, noisy sensors, and is run by another integrator with a
    finer step. A class that knows the seed could make the recording again: keep it to yourself.
    """
    import secrets
    from functools import partial

    from lathesim.diagnosis.class_folder import answer_place, publish
    from lathesim.diagnosis.conceal import conceal as concealed_in
    from lathesim.diagnosis.hidden_effect import read_wish
    from lathesim.diagnosis.logged_column import logged_columns
    from lathesim.lessons.lesson import load_lesson
    from lathesim.lessons.simulate import prepare

    if at_random == bool(asked):
        raise click.UsageError("Say what is hidden with --effect, or leave it to --random.")
    if "none" in asked and len(asked) > 1:
        raise click.UsageError("--effect none hides nothing, so it stands alone.")
    registry = open_registry(plugin_folders)
    loaded = load_lesson(lesson)
    place = answer_place(out, answer)
    prepared = prepare(loaded, registry)
    seed = secrets.randbelow(_SEEDS) if seed is None else seed
    signals = _signals(loaded, prepared, drive, registry) if drive is not None else {}
    columns = logged_columns(loaded, prepared.machinery, signals)
    effects = cast("dict[str, type[Effect]]", registry.effects)
    situations = [_situation(prepared, signals)]
    if validate:
        second = VALIDATION if VALIDATION in loaded.variants and not signals else None
        situations.append(_situation(prepare(loaded, registry, second), signals))
    made = partial(concealed_in, situations, columns, uncertain=_uncertain(loaded, prepared), seed=seed, noise=noise)
    if at_random:
        concealed = _drawn(made, prepared, effects, columns, seed)
    else:
        concealed = made([read_wish(text, effects) for text in asked if text != "none"])
    published = publish(loaded, concealed, out, place, seed=seed, noise=noise)
    _tell(published.answer, [str(file) for file in published.files], str(published.answer_file), concealed.moves)


def _drawn(
    made: Callable[[list[Wish]], Concealed], prepared: Prepared, effects: dict[str, type[Effect]], columns: list[LoggedColumn], seed: int
) -> Concealed:
    """Draw what is hidden, again where what was drawn cannot be seen."""
    import numpy as np

    from lathesim.diagnosis.conceal import NotSeenError
    from lathesim.diagnosis.hidden_effect import random_wishes

    compared = [column.target for column in columns if column.role == "compare"]
    for attempt in range(_ATTEMPTS):
        wishes = random_wishes(prepared.machinery, effects.values(), compared, np.random.default_rng([seed, 0, attempt]))
        try:
            return made(wishes)
        except NotSeenError as error:
            if attempt == _ATTEMPTS - 1:
                raise
            click.echo(f"Drawn again: {error.fact}", err=True)
    raise AssertionError("the last attempt gives or raises")


def _situation(prepared: Prepared, signals: dict[str, FloatArray]) -> Situation:
    from lathesim.diagnosis.conceal import Situation

    duration = prepared.duration
    if signals:
        duration = (min(len(values) for values in signals.values()) - 1) * prepared.machinery.sample_period
    return Situation(prepared.machinery, duration, signals)


def _signals(lesson: Lesson, prepared: Prepared, file: Path, registry: Registry) -> dict[str, FloatArray]:
    """Give the driven inputs that a recording holds [SI], one value a sample of the lesson's machine."""
    from dataclasses import replace

    import numpy as np

    from lathesim.errors import LessonError
    from lathesim.lessons.recording_mapping import mapping_of
    from lathesim.recordings.mapping import map_recording
    from lathesim.recordings.reading import read_recording

    mapping = mapping_of(lesson, prepared.machinery)
    driven = tuple(signal for signal in mapping.signals if signal.role == "drive")
    if not driven:
        raise LessonError("the lesson drives no input by a recording.", place=str(lesson.path), remedy="Leave --drive out.")
    record = map_recording(read_recording(file, registry.readers.values()), replace(mapping, signals=driven)).record
    times = np.arange(0.0, record.time[-1], prepared.machinery.sample_period)
    return {name: np.interp(times, record.time, record[name]) for name in record}


def _uncertain(lesson: Lesson, prepared: Prepared) -> dict[str, float]:
    """Give how uncertain the values of the lesson are; without any the machine is as the lesson says, and that is told."""
    from lathesim.diagnosis.loading import uncertainties

    if not lesson.settings.uncertain:
        click.echo("The lesson calls no value uncertain, so the machine has them exactly; 'diagnose' will ask for 'uncertain:'.", err=True)
        return {}
    return uncertainties(lesson, prepared.plan)


def _tell(answer: object, files: list[str], answer_file: str, moves: object) -> None:
    from lathesim.cli.reveal import hidden_lines

    click.echo("Hidden:")
    for line in hidden_lines(cast("dict[str, object]", answer)):
        click.echo(f"  {line}")
    for name, floors in cast("dict[str, float]", moves).items():
        click.echo(f"  moves {name} by {floors:.3g} floors")
    if moves and max(cast("dict[str, float]", moves).values()) < 3.0:
        click.echo("No recorded channel is moved by 3 floors: nobody can find this.", err=True)
    click.echo(f"For the class: {', '.join(files)}")
    click.echo(f"The answer, to be kept: {answer_file}")
