"""A detective's case: a lesson, a recording of it, what comparing and diagnosing gave, and the student's guess.

All that the app uses of the diagnosis is imported here, in the functions that need it.
"""

from __future__ import annotations

import difflib
import json
import math
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lathesim.engine.assembly import Place
from lathesim.errors import LatheSimError, RecordingError
from lathesim.lessons.proposed_lesson import COMPARE, IGNORE, TIME, ColumnMeaning, ColumnSense, ProposedLesson, recordings_entry, sense_of
from lathesim.whole_file import write_text

if TYPE_CHECKING:
    from lathesim.diagnosis.comparison.compare import Comparison
    from lathesim.diagnosis.records.diagnosis import Diagnosis
    from lathesim.identification.records import CandidateStanding
    from lathesim.lessons.lesson import Lesson
    from lathesim.lessons.simulate import Prepared
    from lathesim.plugins import Registry
    from lathesim.tui.model.machine_tree import Setup


_LIKE = 0.55
"""Likeness of two names (0 to 1) from which on a guess is proposed, assumed: a person looks at each."""


def guessed_columns(file: Path, case: Prepared, registry: Registry) -> list[ColumnMeaning]:
    """Return a guess for each column of a recording, by its name and unit; raises :class:`RecordingError`."""
    from lathesim.recordings.raw_table import read_recording

    table = read_recording(file, registry.readers)
    time, found = ProposedLesson(table).time, []
    for name, values in table.columns.items():
        sense = sense_of(name, table.units.get(name, ""), values)
        if name == time:
            found.append(ColumnMeaning(name, TIME, "", sense.unit or "s"))
            continue
        target = _nearest_channel(sense, case)
        unit = sense.unit or (case.plan.unit(target) if target else "")
        found.append(ColumnMeaning(name, COMPARE if target else IGNORE, target, unit))
    return found


def _nearest_channel(sense: ColumnSense, case: Prepared) -> str:
    """Return the channel whose name is most like that of a column, of those that the column can be."""
    from lathesim.recordings.raw_table import split_unit

    plain = split_unit(sense.column)[0].lower().replace(" ", "_")
    best, likeness = "", _LIKE
    for channel in case.plan.channels:
        if not sense.may_be(case.plan.unit(channel)):
            continue
        part, item = Place.of(channel)
        for name in (channel.lower(), f"{part}_{item}", item):
            ratio = difflib.SequenceMatcher(None, plain, name).ratio()
            if ratio > likeness:
                best, likeness = channel, ratio
    return best


def write_mapping(case: CaseFile, variant: str | None, columns: Sequence[ColumnMeaning]) -> Path:
    """Write the lesson of a case with what the columns of its recording mean beside the recording, and return its path."""
    from lathesim.lessons.changed_lesson import changed_lesson
    from lathesim.lessons.lesson import results_folder

    folder = case.recording.parent
    path = folder / f"{'_'.join(results_folder(case.lesson).parts[1:])}_{case.recording.stem}.yaml"
    write_text(path, changed_lesson(case.lesson, (), {}, folder, variant=variant, further={"recordings": recordings_entry(columns)}))
    return path


RECORDING_ENDINGS = {".csv", ".txt", ".tsv", ".dat", ".lvm", ".mat", ".h5", ".hdf5", ".xml", ".mcap", ".mf4", ".tdms"}
_SIZE_OFF = 0.25
"""How far off a guessed size may be to be called right, assumed: a guess is made by eye."""


@dataclass(frozen=True)
class Guess:
    """What a student thinks was left out: an effect, its place, and one size as text; ``effect`` is empty for nothing at all."""

    effect: str = ""
    at: str = ""
    size: str = ""

    @property
    def words(self) -> str:
        """The guess as a person reads it."""
        return f"{self.effect} at {self.at} {self.size}".strip() if self.effect else "nothing is missing"


@dataclass
class CaseFile:
    """A recording and all that is known about it so far."""

    lesson: Lesson
    recording: Path
    validation: Path | None = None
    comparison: Comparison | None = None
    before: dict[str, float] = field(default_factory=dict)
    """Residual of each channel at the first comparison [SI], to hold later ones against."""
    guess: Guess | None = None
    diagnosis: Diagnosis | None = None
    steps: list[str] = field(default_factory=list)
    """What the search told, the last at the end."""
    standings: dict[str, CandidateStanding] = field(default_factory=dict)
    """Each candidate of the search as it stood best so far."""

    @property
    def has_mapping(self) -> bool:
        """Whether the lesson says what the columns of a recording mean."""
        return self.lesson.settings.recordings is not None


def open_case(place: Path, setup: Setup | None) -> CaseFile:
    """Return the case of a folder made by ``lathesim conceal``, or of a recording that belongs to the lesson on the bench.

    Raises :class:`RecordingError` and :class:`LessonError`.
    """
    from lathesim.lessons.lesson import load_lesson

    if place.is_dir():
        lesson, recording, second = (place / name for name in ("lesson.yaml", "recording.csv", "validate.csv"))
        for file in (lesson, recording):
            if not file.is_file():
                raise RecordingError(f"the folder has no {file.name}.", place=str(place), remedy="Choose a folder made by 'conceal'.")
        return CaseFile(load_lesson(lesson), recording, second if second.is_file() else None)
    if not place.is_file():
        raise RecordingError("there is no such file or folder.", place=str(place), remedy="Check the path.")
    if (place.parent / "lesson.yaml").is_file():
        second = place.parent / "validate.csv"
        return CaseFile(load_lesson(place.parent / "lesson.yaml"), place, second if second.is_file() and second != place else None)
    if setup is None:
        raise RecordingError("no lesson is on the bench to compare it with.", place=str(place), remedy="Put one on the bench first.")
    return CaseFile(setup.lesson, place)


def recordings_nearby(lesson_folder: Path | None) -> list[Path]:
    """Return case folders and recordings in this folder, one below it, and beside the lesson."""
    places = [Path(), *([lesson_folder] if lesson_folder is not None else [])]
    found: dict[Path, Path] = {}
    for place in places:
        for seal in sorted(place.glob("*/seal.json")):
            found.setdefault(seal.parent.resolve(), seal.parent)
        for path in sorted(place.glob("*")):
            if path.suffix.lower() in RECORDING_ENDINGS and path.is_file():
                found.setdefault(path.resolve(), path)
    return list(found.values())


def lesson_of(case: CaseFile, setup: Setup | None) -> Lesson:
    """Return the lesson to hold the recording against: that of the case with what was changed of it on the bench."""
    from lathesim.lessons.lesson import lesson_from_text

    if setup is not None and setup.lesson.path.resolve() == case.lesson.path.resolve() and setup.is_changed:
        return lesson_from_text(setup.lesson_text(case.lesson.path.parent), case.lesson.path)
    return case.lesson


def compare(case: CaseFile, setup: Setup | None, registry: Registry) -> Comparison:
    """Hold the recording against the simulation of the lesson as it now stands on the bench; raises :class:`LatheSimError`."""
    from lathesim.diagnosis.comparison.compare import compare as compared
    from lathesim.diagnosis.comparison.compare import load_recording

    lesson = lesson_of(case, setup)
    found = compared(lesson.name, *load_recording(lesson, case.recording, registry))
    case.comparison = found
    if not case.before:
        case.before = {item.channel: item.rms for item in found.channels}
    return found


def comparison_text(case: CaseFile) -> list[str]:
    """Return the comparison in lines, and beside it what it was before the changes on the bench."""
    from lathesim.analysis.display_unit import shown_with_unit
    from lathesim.diagnosis.comparison.compare_text import comparison_lines

    assert case.comparison is not None
    lines = comparison_lines(case.comparison)
    changed = []
    for item in case.comparison.channels:
        before = case.before.get(item.channel, item.rms)
        if before != item.rms:
            words = [shown_with_unit(value, item.unit, 3) for value in (before, item.rms)]
            changed.append(f"  {item.channel}: {words[0]} before, {words[1]} now")
    return [*(["Residual before and after your changes:", *changed, ""] if changed else []), *lines]


def diagnose(case: CaseFile, setup: Setup | None, registry: Registry, tell: Callable[[str], None], stop: threading.Event) -> Diagnosis:
    """Search for what the lesson left out, told step by step; ``stop`` ends the search and keeps what is known until then."""
    from lathesim.diagnosis.diagnose import ask
    from lathesim.diagnosis.diagnose import diagnose as answer
    from lathesim.identification.records import Standing
    from lathesim.identification.replay.loading import load_case

    case.steps.clear()
    case.standings.clear()

    def told(text: str) -> None:
        case.steps.append(text.strip())
        for item in text.candidates if isinstance(text, Standing) else ():
            before = case.standings.get(item.name)
            if before is None or math.isnan(before.held_out) or item.held_out > before.held_out:
                case.standings[item.name] = item
        tell(text.strip())
        if stop.is_set():
            stop.clear()
            raise KeyboardInterrupt

    lesson = lesson_of(case, setup)
    loaded = load_case(lesson, [case.recording, *([case.validation] if case.validation is not None else [])], registry)
    question = ask(lesson.title, loaded.machine, loaded.recordings, list(registry.effects.values()))  # type: ignore[arg-type]
    case.diagnosis = answer(question, told)
    return case.diagnosis


def diagnosis_text(case: CaseFile) -> list[str]:
    """Return the answer in lines, and under it every explanation that was tried."""
    from lathesim.diagnosis.reporting.explanations import explanation_lines
    from lathesim.diagnosis.reporting.terminal_text import answer_lines

    assert case.diagnosis is not None
    return [*answer_lines(case.diagnosis), *explanation_lines(case.diagnosis)]


def judged_guess(case: CaseFile) -> str:
    """Return how the guess stands beside the diagnosis, in one or two sentences that begin with a sign."""
    guess, diagnosis = case.guess, case.diagnosis
    if guess is None or diagnosis is None:
        return ""
    found = diagnosis.effects if diagnosis.names else ()
    if not guess.effect:
        return (
            "✓ Right: nothing is missing." if not found else f"✗ You said nothing; the diagnosis found {found[0].effect} at {found[0].at}."
        )
    for effect in found:
        if effect.effect == guess.effect:
            if guess.at and Place.of(effect.at).part != Place.of(guess.at).part:
                return f"✗ {guess.effect} it is, but at {effect.at} and not at {guess.at}."
            return f"✓ Right: {effect.effect} at {effect.at}.{_size_words(guess, effect.parameters)}"
        if guess.effect in effect.tied_with:
            return f"~ This recording cannot tell {guess.effect} from {effect.effect}: your guess may be right."
    names = ", ".join(f"{effect.effect} at {effect.at}" for effect in found) or "nothing it can name"
    return f"✗ You said {guess.effect}; the diagnosis found {names}."


def _size_words(guess: Guess, parameters: Mapping[str, Any]) -> str:
    """Return how a guessed size stands beside the first that was found in the same kind of unit."""
    from lathesim.units import from_si, quantity, split_quantity

    if not guess.size:
        return ""
    for name, item in parameters.items():
        try:
            given = quantity(guess.size, item.unit)
            found = quantity(f"{item.value!r} {item.unit}".removesuffix(" 1"), item.unit)
        except LatheSimError:
            continue
        unit = split_quantity(guess.size)[1] or "1"
        off = abs(given - found) / abs(found) if found else math.inf
        sign = "✓" if off <= _SIZE_OFF else "✗"
        return f" {sign} {name} is {from_si(found, unit):.4g} {unit}, you said {guess.size}."
    return f" ✗ {guess.size} is not in the unit of a size of this effect."


def with_what_was_found(case: CaseFile, setup: Setup) -> Setup:
    """Return the setup with what the diagnosis found inserted, and with the values that were fitted beside it."""
    from lathesim.diagnosis.reporting.answer_files import refitted_values

    diagnosis = case.diagnosis
    assert diagnosis is not None
    for entry in diagnosis.lines.insert:
        setup = setup.with_insert(dict(entry))
    for name, quantity in refitted_values(diagnosis).items():
        setup = setup.with_value(name, quantity)
    return setup


def conceal(lesson: Lesson, registry: Registry, folder: Path, *, hidden: str, validate: bool, tell: Callable[[str], None]) -> list[str]:
    """Make a case in a folder: ``hidden`` is an effect as ``--effect`` takes it, ``none``, or empty for one drawn at random."""
    from lathesim.exercises.class_folder import Hiding, conceal_case

    asked = [hidden] if hidden and hidden != "none" else []
    concealed, published = conceal_case(lesson, registry, folder, Hiding(asked, not hidden, validate=validate), tell=tell)
    lines = [f"For the class: {', '.join(str(file) for file in published.files)}", f"The answer, to be kept: {published.answer_file}"]
    return [*lines, concealed.lost_in_noise] if concealed.lost_in_noise else lines


def reveal(seal: Path, answer: Path, case: CaseFile | None) -> list[str]:
    """Return the sealed answer in lines, and how diagnosis and guess stand beside it; raises :class:`RecordingError`."""
    from lathesim.diagnosis.records.diagnosis import as_json
    from lathesim.exercises.graded_diagnosis import grade, graded_lines, hidden_lines
    from lathesim.exercises.sealed_answer import changed_files, opened

    truth = opened(seal, answer)
    lines = ["The answer is the one that was sealed.", *[f"✗ {name} was changed." for name in changed_files(seal, truth)]]
    lines += ["", "Hidden:", *[f"  {line}" for line in hidden_lines(truth)]]
    if case is not None and case.guess is not None:
        names = [item["effect"] for item in truth["effects"]]
        right = case.guess.effect in names if case.guess.effect else not names
        lines += ["", f"{'✓' if right else '✗'} Your guess: {case.guess.effect or 'nothing'} {case.guess.at} {case.guess.size}".rstrip()]
    if case is not None and case.diagnosis is not None:
        graded = grade(truth, json.loads(json.dumps(as_json(case.diagnosis))))
        lines += ["", f"The diagnosis: {graded.sentence}", *[f"  {line}" for line in graded_lines(graded, 5.0)]]
    return lines
