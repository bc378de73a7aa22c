"""The tap test that a lesson describes, and hits that were recorded elsewhere."""

from __future__ import annotations

import itertools
import re
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lathesim.errors import LessonError, RecordingError
from lathesim.lessons.case import Given
from lathesim.lessons.part_values import si_value
from lathesim.record import FloatArray
from lathesim.stability.tap import TapEstimate, TapRecord, TapSettings, estimate_response, judged_hits, tap
from lathesim.stability.tool_point import Mode, Quantity, ToolPoint
from lathesim.units import in_unit, quantity

if TYPE_CHECKING:
    from lathesim.lessons.lesson import Lesson


SENSORS: dict[str, tuple[Quantity, str, str]] = {
    "displacement": ("receptance", "m", "2 nm"),
    "velocity": ("mobility", "m/s", "2 um/s"),
    "acceleration": ("accelerance", "m/s^2", "0.02 m/s^2"),
}
"""What a sensor reads -> the response over force, its unit, and its noise where nothing is said."""
_TRIES = 4


def tap_lesson(lesson: Lesson, seed: int, hits: int | None = None) -> TapEstimate:
    """Return the response that tapping the lesson's tool point along the normal gives; hits left out are made again, up to four times as
    often.

    Raises :class:`LessonError` where the lesson gives no modes to tap.
    """
    entry = lesson.settings.tool_point
    if entry is None or not entry.modes:
        fact = "the lesson has no tool point." if entry is None else "the tool point is a response, and only modes can be tapped."
        raise LessonError(fact, place=str(lesson.path), remedy="Give 'modes:' under 'tool_point:'.")
    place = lesson.source.place(("tool_point",), key=True)

    def value(text: str, unit: str) -> float:
        return si_value(Given(text, place, place), unit)

    modes = []
    for number, mode in enumerate(entry.modes):
        at = lesson.source.place(("tool_point", "modes", number))
        try:
            modes.append(
                Mode(value(mode.frequency, "Hz"), value(mode.damping, "1"), value(mode.stiffness, "N/m"), value(mode.direction, "rad"))
            )
        except LessonError as error:
            raise error if error.place else LessonError(error.fact, place=at, remedy=error.remedy) from None
    told = entry.tap
    quantity, unit, noise = SENSORS[told.sensor]
    settings = TapSettings(
        hits or told.hits,
        value(told.peak, "N"),
        value(told.scatter, "1"),
        value(told.contact, "s"),
        value(told.rate, "Hz"),
        value(told.length, "s"),
        value(told.force_noise, "N"),
        value(told.noise or noise, unit),
        value(told.double_hits, "1"),
        value(told.range, "N"),
        quantity,
    )
    _check(settings, place)
    return tap_until_good(ToolPoint.of(modes, 0.0), settings, seed)


def _check(settings: TapSettings, place: str) -> None:
    for word, found in (("peak", settings.peak), ("contact", settings.contact), ("rate", settings.rate), ("length", settings.length)):
        if not found > 0.0:
            raise LessonError(f"the {word} of the tap test is {found:g}.", place=place, remedy="Give a value above 0.")
    if settings.length * settings.rate > 4e6:
        raise LessonError(f"a hit would have {settings.length * settings.rate:.3g} samples.", place=place, remedy="Shorten the record.")
    if settings.length < 0.05:
        raise LessonError(f"a record of {in_unit(settings.length, 'ms', 'g')} is too short.", place=place, remedy="Use 0.5 s or more.")


def tap_until_good(tool: ToolPoint, settings: TapSettings, seed: int) -> TapEstimate:
    """Return the response of as many good hits as asked; what is left out is made again, as a person does."""
    record = tap(tool, settings, seed)
    for turn in range(1, _TRIES):
        missing = settings.hits - sum(not hit.reason for hit in judged_hits(record))
        if missing <= 0:
            break
        more = tap(tool, replace(settings, hits=missing), seed + 7919 * turn)
        record = replace(
            record,
            force=np.concatenate([record.force, more.force]),
            response=np.concatenate([record.response, more.response]),
            truth=(*record.truth, *more.truth),
        )
    return estimate_response(record)


def recorded_tap(path: Path) -> TapEstimate:
    """Return the response of recorded hits. The file has columns of time, force and response with their units; hits may follow each other.

    Raises :class:`RecordingError` where a column is missing or no hit stands out.
    """
    try:
        text = path.read_text(encoding="utf-8-sig", errors="replace")
    except FileNotFoundError:
        raise RecordingError("there is no such file.", place=str(path)) from None
    header, _, body = text.partition("\n")
    mark = next((item for item in (";", "\t", ",") if item in header), ",")
    names = [name.strip().strip('"') for name in header.split(mark)]
    try:
        table = np.loadtxt(body.splitlines(), delimiter=mark, ndmin=2)
    except ValueError as error:
        raise RecordingError(f"the rows cannot be read: {error}.", place=str(path)) from None
    if table.shape[1] != len(names):
        raise RecordingError(f"{len(names)} names stand over {table.shape[1]} columns.", place=str(path), remedy="Name each column once.")
    time, force = _column(names, table, "time", "s", path), _column(names, table, "force", "N", path)
    sensor = next((word for word in SENSORS if any(name.lower().startswith(word) for name in names)), None)
    if sensor is None:
        raise RecordingError("no column is a displacement, velocity or acceleration.", place=str(path), remedy="Name it so, with its unit.")
    quantity, unit, _ = SENSORS[sensor]
    response = _column(names, table, sensor, unit, path)
    steps = np.diff(time)
    if len(steps) < 64 or not (steps > 0.0).all() or steps.max() > 1.5 * np.median(steps):
        raise RecordingError("the time does not rise evenly.", place=str(path), remedy="Give one row a sample.")
    rate = 1.0 / float(np.median(steps))
    return estimate_response(_split(force, response, rate, quantity, path))


def _column(names: list[str], table: FloatArray, word: str, unit: str, path: Path) -> FloatArray:
    for place, name in enumerate(names):
        if name.lower().startswith(word):
            told = re.search(r"\[(.*)\]", name)
            factor = quantity(f"1 {told[1]}", unit) if told else 1.0
            return np.asarray(table[:, place] * factor)
    raise RecordingError(f"no column is named '{word}'.", place=str(path), remedy=f"Name one '{word} [{unit}]'.")


def _split(force: FloatArray, response: FloatArray, rate: float, quantity: Quantity, path: Path) -> TapRecord:
    """Return the hits of a recording, each with the silence before it, all as long as the shortest distance."""
    top = float(force.max())
    above = force > 0.25 * top
    starts = np.flatnonzero(above & ~np.concatenate([[False], above[:-1]]))
    gap = int(0.1 * rate)
    firsts = [int(start) for place, start in enumerate(starts) if place == 0 or start - starts[place - 1] > gap]
    if not firsts or top <= 0.0:
        raise RecordingError("no hit stands out in the force.", place=str(path), remedy="Check the sign and the column of the force.")
    before = min(int(0.01 * rate), firsts[0])
    length = min([second - first for first, second in itertools.pairwise(firsts)] + [len(force) - firsts[-1]])
    if length < 64:
        raise RecordingError("the last hit is too close to the end.", place=str(path), remedy="Record longer.")
    pieces = [slice(first - before, first - before + length) for first in firsts]
    return TapRecord(np.stack([force[piece] for piece in pieces]), np.stack([response[piece] for piece in pieces]), rate, quantity)
