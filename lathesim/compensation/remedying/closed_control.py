"""A remedy for a control that nobody can change: the part program itself, with the error of the machine mirrored into its path.

The diagnosed machine is simulated; where its tables are off the sound machine, the way-points go as far to the other side, ahead by the
lag of the loops, in a few rounds (learning on the model). Play and friction become steps at the reversals, pitch errors a slow shift,
deflection under the cut a deeper path. Blocks last whole samples, so the control runs them as the machine was asked to.
"""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np

from lathesim.compensation.learning.laps import course_of
from lathesim.compensation.learning.response import learning_filter
from lathesim.compensation.remedying.remedy import Answer
from lathesim.engine.assembly import FloatArray
from lathesim.errors import LatheSimError, LessonError
from lathesim.lessons.lesson import lesson_from_text
from lathesim.lessons.simulate import prepare
from lathesim.program.loading import load_program

PROGRAM_FILE = "mirrored.nc"
_ROUNDS = 10
_SAMPLES_A_BLOCK = 4
_MOST_BLOCKS = 60_000
_LARGEST_SHIFT = 1e-3
"""Largest shift of a way-point [m]: more would gouge, and is no compensation (assumed)."""


def write_program(answer: Answer, folder: Path) -> list[Path]:
    """Write the changed part program and return its file; nothing where there is nothing to mend.

    Raises :class:`LessonError` where the mirrored path leaves the travel, where it would shift a point by more than a millimetre, or where
    the machine has no position loop to correct.
    """
    if answer.nothing or answer.bench is None:
        return []
    diagnosed = answer.diagnosed
    text = diagnosed.text([], {}, diagnosed.folder)
    prepared = prepare(lesson_from_text(text, diagnosed.folder / "lesson.yaml"), diagnosed.registry)
    course = course_of(prepared, "reference")
    chosen = learning_filter(course)
    sound = answer.bench.table(answer.bench.runs([answer.bench.sound])[0])
    corrections = np.zeros((len(course.loops), course.samples))
    best, least = corrections, np.inf
    for _ in range(_ROUNDS):
        off = sound[:, : course.samples] - course.tables_of(corrections)
        size = float(np.sqrt(np.mean(off * off)))
        if size < least:
            best, least = corrections, size
        elif size > 1.5 * least:
            break
        corrections = chosen.applied(corrections, off)
    if float(np.max(np.abs(best))) > _LARGEST_SHIFT:
        raise LessonError(
            f"the mirrored path would shift a point by {1e3 * float(np.max(np.abs(best))):.3g} mm, which gouges.",
            place=str(diagnosed.lesson.path),
            remedy="Repair the machine; a program does not take up so much.",
        )
    asked = course.references() + best
    file = folder / PROGRAM_FILE
    file.write_text(_blocks(asked, course.period, course.axes_of_path()), encoding="utf-8")
    try:
        load_program(file, "linuxcnc")
    except LatheSimError as error:
        raise LessonError(f"the mirrored program does not pass its check: {error.fact}", place=str(file)) from None
    return [file]


def _blocks(asked: FloatArray, period: float, words: list[str]) -> str:
    """Return the program: straight blocks of a few samples each, with the feed that takes just as long; dwells where it stands."""
    count = asked.shape[1]
    every = max(_SAMPLES_A_BLOCK, -(-count // _MOST_BLOCKS))
    points = [*list(range(0, count - 1, every)), count - 1]
    start = " ".join(f"{word}{1e3 * row[0]:.6f}" for word, row in zip(words, asked, strict=True))
    lines = [
        "(dialect: linuxcnc)",
        "(the path of a part, with the errors of one machine mirrored into it)",
        "G21 G18 G90 G94 G8",
        f"G0 {start}",
    ]
    standing = 0.0
    for first, last in itertools.pairwise(points):
        before, after = np.round(1e3 * asked[:, first], 6), np.round(1e3 * asked[:, last], 6)
        way = float(np.hypot.reduce(after - before))
        lasting = (last - first) * period
        if way < 1e-6:
            standing += lasting
            continue
        if standing > 0.0:
            lines.append(f"G4 P{standing:.6f}")
            standing = 0.0
        # rounded up, so that rounding costs no further sample
        feed = np.ceil(way / lasting * 60.0 * 1e5) / 1e5
        target = " ".join(f"{word}{value:.6f}" for word, value in zip(words, after, strict=True))
        lines.append(f"G1 {target} F{feed:.5f}")
    if standing > 0.0:
        lines.append(f"G4 P{standing:.6f}")
    return "\n".join([*lines, "M2"]) + "\n"
