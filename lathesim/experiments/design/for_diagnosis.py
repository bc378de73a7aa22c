"""A tied diagnosis with the program that would split it: written, and named where the diagnosis says what would tell."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from lathesim.diagnosis.records.diagnosis import Diagnosis, as_json
from lathesim.errors import LatheSimError
from lathesim.experiments.design.experiment import Wish, design_experiment
from lathesim.experiments.design.experiment_files import undecidable_sentence, write_experiment, write_program_and_lesson
from lathesim.experiments.design.rivals import named_in
from lathesim.lessons.lesson import Lesson
from lathesim.plugins import Registry


def with_designed_program(
    diagnosis: Diagnosis, lesson: Lesson, registry: Registry, folder: Path, variant: str | None, say: Callable[[str], None],
    stop: threading.Event | None = None,
) -> Diagnosis:  # fmt: skip
    """Return the diagnosis with ``separating_experiment`` naming the program in ``folder``, or saying that none would tell.

    Where nothing is tied, or no program moves the machine, the diagnosis stays as it is and one sentence says why. ``stop`` set keeps the
    best program so far, and the diagnosis.
    """
    try:
        named = named_in(as_json(diagnosis), "--design")
        found = design_experiment(lesson, named, registry, Wish(), variant, "--design", say, stop)
    except LatheSimError as error:
        say(f"No program is designed: {error.fact}")
        return diagnosis
    except KeyboardInterrupt:
        say("No program is designed: stopped before one was tried.")
        return diagnosis
    if not found.decidable:
        advice = told = undecidable_sentence(found)
    else:
        write_program_and_lesson(found, folder)
        write_experiment(found, (), folder)
        told = str(folder / "program.nc")
        advice = f"Run {told}, and diagnose it with {folder / 'lesson.yaml'} together with this recording (--with)."
        say(f"The program that would tell is {told}.")
    effects = tuple(replace(effect, separating_experiment=told) if effect.tied_with else effect for effect in diagnosis.effects)
    general = [effect.separating_experiment for effect in diagnosis.effects if effect.tied_with and effect.separating_experiment]
    return replace(diagnosis, effects=effects, not_told=tuple(_advised(sentence, general, advice) for sentence in diagnosis.not_told))


def _advised(sentence: str, general: Sequence[str], advice: str) -> str:
    """Return a sentence with the advice for these rivals in place of the one for all of their kind."""
    for text in general:
        sentence = sentence.replace(text, advice)
    return sentence
