"""``learn``: laps with corrections that each lap's errors improve, stopped where nothing is left to learn."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lathesim.compensation.lap_response import Filter
from lathesim.compensation.laps import Course, Lap
from lathesim.engine.assembly import FloatArray, Place
from lathesim.errors import LessonError, RecordingError
from lathesim.lessons.changed_lesson import changed_lesson
from lathesim.lessons.part_values import table_text
from lathesim.lessons.recording_mapping import mapping_of
from lathesim.lessons.simulate import Prepared
from lathesim.plugins import Registry
from lathesim.recordings.mapping import map_recording
from lathesim.recordings.raw_table import read_recording
from lathesim.units import in_unit
from lathesim.whole_file import WholeFiles, make_folder, write_text

_NO_FLOOR = 1e-15
"""Error [m] below which nothing is rounded."""
_FAR_BELOW = 10.0
"""Times the largest error of rounding above which rounding is not what ends the learning."""

Tell = Callable[[str], None]
_PARTS = 12.0
"""Square of a level over the variance of what rounding to it adds."""
_WORST_OF = 4.0
"""Standard deviations that the largest of some thousand samples lies away."""
_NO_BETTER = 0.97
"""Share of the error of the lap before to which a lap must bring it."""
_DIVERGED = 3.0
"""Times the first lap's error from which on the learning diverges."""


@dataclass(frozen=True)
class Learning:
    """The laps (the first without correction), the best of them, its corrections, the filter, and why it stopped.

    ``floor`` is the tracking error [m] that rounding by converter and encoder leaves, whatever is learned.
    """

    laps: tuple[Lap, ...]
    best: int
    corrections: FloatArray
    filter: Filter
    floor: float
    why: str
    never: float = 0.0
    """Root mean square of what the low-pass never learns [m]."""

    @property
    def predicted(self) -> list[float]:
        """The upper bound of each lap's error [m]:  bound * error of the previous lap + error that is never learned + 2 floor.

        The floor counts twice: rounding acts in the lap itself and in the errors of the previous lap.
        """
        return [self.filter.bound * lap.rms + self.never + 2.0 * self.floor for lap in self.laps[:-1]]

    @property
    def contractions(self) -> list[float]:
        """The error of each lap over that of the lap before."""
        return [after.rms / before.rms for before, after in zip(self.laps, self.laps[1:], strict=False)]


def learn(course: Course, chosen: Filter, laps: int, *, on: str = "axis", tell: Tell = lambda text: None) -> Learning:
    """Run up to ``laps`` laps with corrections after the first; ``on`` is "axis", or "contour" to learn from the part across the path.

    It stops where a lap is no better and the floor is near, or where it diverges; the best lap's corrections are kept.
    """
    corrections = np.zeros((len(course.loops), course.samples))
    level, count = course.floors()
    floor = float(np.hypot(level * chosen.answer, count) * np.sqrt(len(course.loops) / _PARTS))
    done = [course.lap(corrections)]
    kept = [corrections]
    why = f"all {laps} laps are run"
    for number in range(1, laps + 1):
        errors = done[-1].errors
        if on == "contour":
            errors = course.across(errors, kept[-1])
        corrections = chosen.applied(kept[-1], errors)
        lap = course.lap(corrections)
        tell(f"lap {number} of {laps}: largest distance from the path {in_unit(lap.largest, 'mm')}")
        done.append(lap)
        kept.append(corrections)
        if not np.isfinite(lap.rms) or lap.rms > _DIVERGED * done[0].rms or lap.rms > _DIVERGED * min(item.rms for item in done):
            why = f"lap {number} is worse than the first by far: the learning diverges"
            break
        if lap.rms > _NO_BETTER * done[-2].rms:
            why = _no_better(number, lap, floor, level, count)
            break
    best = int(np.nanargmin([lap.largest if on == "contour" else lap.rms for lap in done]))
    never = float(np.sqrt(np.mean(np.sum(chosen.left_out(done[0].errors) ** 2, axis=0))))
    return Learning(tuple(done), best, kept[best], chosen, floor, why, never)


def _set_by_hand(prepared: Prepared) -> dict[str, str]:
    """Return the values that the command line set, which a lesson that is written keeps."""
    return {name: str(given.value) for name, given in prepared.case.changed.set.items() if given.place.startswith("--set")}


def _no_better(number: int, lap: Lap, floor: float, level: float, count: float) -> str:
    told = f"lap {number} is no better than the one before"
    if lap.rms > _FAR_BELOW * _WORST_OF * max(floor, _NO_FLOOR):
        return f"{told}, though the floor of converter and encoder is far below: what is left is not the same in each lap"
    what = f"one level of the converter is {in_unit(level, 'mV', '.3g')}" if level > 0.0 else ""
    fine = f"one count of the encoder {in_unit(count, 'um', '.3g')}" if count > 0.0 else ""
    cause = " and ".join(text for text in (what, fine) if text)
    return f"{told}: {cause}, which alone leaves a tracking error of {in_unit(floor, 'um', '.3g')}" if cause else told


def write_learned(prepared: Prepared, course: Course, learning: Learning, folder: Path) -> list[Path]:
    """Write the lesson with the learned corrections and its tables, all or none, and return the files."""
    make_folder(folder)
    contents: dict[Path, str] = {}
    tables, insert = {}, []
    for place, (loop, table) in enumerate(zip(course.loops, course.tables, strict=True)):
        part = Place.of(table).part
        file = folder / f"{part}.csv"
        contents[file] = table_text(("correction",), learning.corrections[place][:, None], course.machinery.declared(table).unit)
        port = course.machinery.ports(loop.controller)["reading" if course.what == "voltage" else "drive"]
        insert.append({"remedy": "LearnedCorrection", "at": f"{loop.controller}.{port}", "name": part})
        tables[table] = file.name
    case = prepared.case
    lesson = case.lesson
    values = _set_by_hand(prepared)
    before = dict(lesson.source.data.get("tables", {}))
    text = changed_lesson(lesson, insert, values, folder, variant=case.variant, further={"tables": {**before, **tables}})
    with WholeFiles() as whole:
        for file, content in [*contents.items(), (folder / "lesson.yaml", text)]:
            whole.write_text(file, content)
    return [folder / "lesson.yaml", *contents]


_MOST_BLOCKS = 20_000
_SMALLEST = 0.5e-6
"""Half of the last decimal that is written [mm]: a shorter way is none."""


def program_text(asked: FloatArray, period: float, words: list[str], spindle: FloatArray | None) -> str:
    """Return the program of way-points [m], shape (axes, samples), which begins where the tool stands.

    It has straight blocks of whole samples with the feed that takes just as long, and dwells where nothing moves.
    """
    count = asked.shape[1]
    points = [*range(0, count - 1, max(1, -(-count // _MOST_BLOCKS))), count - 1]
    start = " ".join(f"{word}{1e3 * row[0]:.6f}" for word, row in zip(words, asked, strict=True))
    lines = [
        "(dialect: linuxcnc)",
        "(the path of a part, with the errors of one machine mirrored into it)",
        "G21 G18 G90 G94 G8",
        f"G0 {start}",
    ]
    standing, turning = 0.0, 0.0
    # what is not written is no way: the next block begins where the last one ended
    before = np.round(1e3 * asked[:, 0], 6)
    for first, last in itertools.pairwise(points):
        if spindle is not None and last < len(spindle) and spindle[last] != turning:
            turning = float(spindle[last])
            lines.append(f"G97 S{abs(turning) * 30.0 / np.pi:.4f} {'M3' if turning > 0.0 else 'M4'}" if turning else "M5")
        after = np.round(1e3 * asked[:, last], 6)
        way = float(np.sqrt(np.sum((after - before) ** 2)))
        lasting = (last - first) * period
        if way < _SMALLEST:
            standing += lasting
            continue
        if standing > 0.0:
            lines.append(f"G4 P{standing:.6f}")
            standing = 0.0
        # rounded up, so that rounding costs no further sample
        feed = np.ceil(way / lasting * 60.0 * 1e5) / 1e5
        target = " ".join(f"{word}{value:.6f}" for word, value in zip(words, after, strict=True))
        lines.append(f"G1 {target} F{feed:.5f}")
        before = after
    if standing > 0.0:
        lines.append(f"G4 P{standing:.6f}")
    return "\n".join([*lines, "M2"]) + "\n"


NEXT_LAP, LESSON = "next_lap.nc", "lesson.yaml"
_LAPS_AHEAD = 12
"""Further laps that are simulated to find the floor (assumed)."""
_OFF = 2
"""Samples by which a recorded lap may be shorter or longer: where the logger was started and stopped (assumed)."""


@dataclass(frozen=True)
class Outlook:
    """Root mean squares of tracking errors [m]: of the recorded lap, of the next lap (predicted), and the smallest of all laps to come."""

    now: float
    following: float
    floor: float


def next_lap(
    prepared: Prepared, course: Course, chosen: Filter, recording: Path, registry: Registry, folder: Path
) -> tuple[tuple[Path, Path], Outlook]:
    """Write the program of the next lap from a recorded one, and the lesson that runs it; return both files and the predicted errors.

    The lap's reference is that of the recording where it holds one, else the lesson's; by what it differs from the lesson's is what was
    learned before. Raises :class:`RecordingError` where the lap has another length, :class:`LessonError` where the lesson maps no reading.
    """
    lesson = prepared.case.lesson
    mapping = mapping_of(lesson, prepared.machinery)
    record = map_recording(read_recording(recording, registry.readers.values()), mapping).record
    missing = [loop.reading for loop in course.loops if loop.reading not in record]
    if missing:
        fact = f"the lesson maps no column to {missing[0]}, and learning needs the readings of its axes."
        raise LessonError(fact, place=str(lesson.path), remedy="Write it under 'recordings: compare:'.")
    if abs(len(record) - course.samples) > _OFF:
        fact = f"the lap has {len(record)} samples, and the lesson's has {course.samples}."
        raise RecordingError(fact, place=str(recording), remedy="Record one whole lap of the lesson's program, at its sample period.")
    asked = course.references()
    read = np.array([_as_long(record[loop.reading], course.samples) for loop in course.loops])
    names = [f"{loop.controller}.reference" for loop in course.loops]
    run = [_as_long(record[name], course.samples) if name in record else row for name, row in zip(names, asked, strict=True)]
    errors = asked - read
    before = np.array(run) - asked
    following = _following(chosen, before, errors)
    make_folder(folder)
    file = folder / NEXT_LAP
    write_text(file, program_text(asked + following, course.period, course.axes_of_path(), None))
    values = _set_by_hand(prepared)
    further = {"program": str(file.resolve()), "dialect": "linuxcnc"}
    write_text(folder / LESSON, changed_lesson(lesson, [], values, folder, variant=prepared.case.variant, further=further))
    return (file, folder / LESSON), _outlook(course, chosen, before, errors)


def _following(chosen: Filter, before: FloatArray, errors: FloatArray) -> FloatArray:
    """Return the next corrections of a program [m]; the first one is zero, because a program begins at the position of the tool."""
    following = chosen.applied(before, errors)
    following[:, 0] = 0.0
    return following


def _outlook(course: Course, chosen: Filter, before: FloatArray, errors: FloatArray) -> Outlook:
    """Return the predicted errors: those of simulated laps plus the difference between the recorded lap and its simulation."""
    off = errors - course.lap(before).errors
    reached = [_rms(errors)]
    for _ in range(_LAPS_AHEAD):
        before = _following(chosen, before, errors)
        errors = off + course.lap(before).errors
        reached.append(_rms(errors))
    return Outlook(reached[0], reached[1], min(reached))


def _rms(errors: FloatArray) -> float:
    return float(np.sqrt(np.mean(np.sum(errors**2, axis=0))))


def _as_long(values: FloatArray, count: int) -> FloatArray:
    """Return a signal cut or held to a length."""
    kept = values[:count]
    return np.concatenate([kept, np.full(count - len(kept), kept[-1])])
