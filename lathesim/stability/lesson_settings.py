"""The tap test that a lesson describes, and hits that were recorded elsewhere.

The tool point and the cut that a lesson gives under ``tool_point:``.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lathesim.errors import LessonError, RecordingError
from lathesim.lessons.lesson import Lesson
from lathesim.lessons.part_values import si_of
from lathesim.record import FloatArray
from lathesim.recordings.delimited_text import read_text
from lathesim.stability.stability_thresholds import ROUNDING, SHORT, TAP
from lathesim.stability.tap import TapEstimate, TapRecord, TapSettings, estimate_response, judged_hits, tap
from lathesim.stability.tool_point import FrequencyResponse, Mode, Quantity, ToolPoint, ends_too_low
from lathesim.units import in_unit, quantity

if TYPE_CHECKING:
    from lathesim.lessons.schema import ResponseEntry, ToolPointEntry
    from lathesim.recordings.raw_table import RawTable
    from lathesim.stability.choose_modes import FoundModes

_FAR, _WELL_DAMPED = 3.0, 0.5
"""Frequency over the end of the band, and damping ratio, of the mode that represents a residual term (assumed so that it does not chatter
first)."""
_NO_REST = 1e-3
"""Share of the response at its chatter frequency below which a residual term is left out (assumed)."""
RPM = 60.0 / (2.0 * math.pi)
"""Revolutions a minute of a radian per second."""


@dataclass(frozen=True)
class Milling:
    """Milling with straight teeth: teeth, force per chip area along and across [Pa], angles of entry and leave [rad]."""

    teeth: int
    tangential: float
    normal: float
    entry: float
    leave: float


@dataclass(frozen=True, eq=False)
class Cut:
    """A tool point and the cut: Ks [N/m^2], process damping [N/m], diameter [m], share of a turn in the cut.

    ``tool`` is the modes, or a response measured in a ``direction`` [rad] from the normal, with the ``factor`` of the force on it.
    ``chosen`` is the speed [rpm] and width [m] of the lesson's own cut.
    """

    tool: ToolPoint | FrequencyResponse
    stiffness: float
    process_damping: float = 0.0
    diameter: float = 0.036
    share: float = 1.0
    milling: Milling | None = None
    factor: float = 1.0
    direction: float = 0.0
    chosen: tuple[float, float] | None = None


def cut_of(lesson: Lesson) -> Cut:
    """Return the tool point and cut that a lesson gives; :class:`LessonError` where it gives none, or one that cannot be."""
    entry = lesson.settings.tool_point
    if entry is None:
        remedy = "Add 'tool_point:' with modes and cutting_stiffness."
        raise LessonError("the lesson has no tool point.", place=str(lesson.path), remedy=remedy)
    place = lesson.source.place(("tool_point",), key=True)
    value = partial(si_of, place=place)
    angle = value(entry.force_angle, "rad")
    tool: ToolPoint | FrequencyResponse
    factor, direction = 1.0, 0.0
    if entry.response is not None:
        tool = _measured(entry.response, lesson.path.parent)
        direction = value(entry.response.direction, "rad")
        factor = math.cos(angle - direction) * math.cos(direction)
        tool = replace(tool, findings=(*tool.findings, *ends_too_low(tool, factor)))
    elif entry.assembly is not None:
        from lathesim.stability.assembly_file import load_assembly, tip_response

        tool, factor = tip_response(load_assembly(lesson.path.parent / entry.assembly)), math.cos(angle)
    else:
        tool = ToolPoint.of(_modes(lesson, entry, value), angle)
    milling = None
    if entry.milling is not None:
        mill = entry.milling
        milling = Milling(
            mill.teeth, value(mill.tangential, "Pa"), value(mill.normal, "Pa"), value(mill.entry, "rad"), value(mill.leave, "rad")
        )
    chosen = None
    if entry.speed is not None and entry.width is not None:
        chosen = (value(entry.speed, "rad/s") * RPM, value(entry.width, "m"))
    cut = Cut(
        tool,
        value(entry.cutting_stiffness, "Pa") if entry.cutting_stiffness is not None else 0.0,
        value(entry.process_damping, "N/m"),
        value(entry.diameter, "m"),
        value(entry.interrupted, "1"),
        milling,
        factor,
        direction,
        chosen,
    )
    _check_cut(cut, place)
    return cut


def _measured(entry: ResponseEntry, folder: Path) -> FrequencyResponse:
    from lathesim.stability.response_files import read_response

    return read_response(folder / entry.file, entry.quantity, entry.unit)


def _check_cut(cut: Cut, place: str) -> None:
    words = [("diameter", cut.diameter)]
    if cut.milling is None:
        words.append(("cutting stiffness", cut.stiffness))
    for word, found in words:
        if not found > 0.0:
            raise LessonError(f"the {word} is {found:g}.", place=place, remedy="Give a value above 0.")
    if cut.process_damping < 0.0:
        raise LessonError(f"the process damping is {cut.process_damping:g} N/m.", place=place, remedy="Give 0 or more.")
    if not 0.0 < cut.share <= 1.0:
        raise LessonError(f"the share of a turn in the cut is {cut.share:g}.", place=place, remedy="Give one above 0 and at most 1.")
    if cut.milling is not None and (cut.process_damping > 0.0 or cut.share < 1.0):
        word = "process damping" if cut.process_damping > 0.0 else "slotted bar"
        raise LessonError(f"milling takes no {word}.", place=place, remedy="Take the key out.")
    if cut.milling is not None and not 0.0 <= cut.milling.entry < cut.milling.leave <= 2.0 * math.pi + ROUNDING:
        raise LessonError("a tooth leaves the cut before it enters.", place=place, remedy="Give entry below leave, from 0 to 360 deg.")


def natural_frequencies(cut: Cut) -> tuple[float, ...]:
    """Return the natural frequencies [Hz] of a cut's tool point; of a measured response those within its band."""
    return tuple(mode.frequency for mode in (cut.tool.modes if isinstance(cut.tool, ToolPoint) else _fitted(cut.tool)[0]))


def _fitted(response: FrequencyResponse) -> tuple[list[Mode], FoundModes]:
    """Return the modes of a response with a positive stiffness, and the whole fit. Raises :class:`LessonError` if there is no such mode."""
    from lathesim.stability.choose_modes import find_modes

    found = find_modes(replace(response, hits=None) if response.force_noise == 0.0 else response)
    inside = [item.mode for item in found.modes if item.stiffness.value > 0.0]
    if not inside:
        raise LessonError("no mode could be fitted to the response.", remedy="Use the method 'frequency', which takes it as it is.")
    return inside, found


def with_modes(cut: Cut) -> tuple[ToolPoint, str]:
    """Return the modes of a cut, and a sentence if they were fitted to a response.

    Modes outside the band of the response count too. Poles that the data determine become modes. One stiff, well damped mode far above
    represents the rest: it gives the same real part at the lowest point of the real part, where chatter begins.
    """
    if isinstance(cut.tool, ToolPoint):
        return cut.tool, ""
    inside, found = _fitted(cut.tool)
    known = [item.mode for item in found.outside if item.stiffness.value > 0.0 and item.is_known]
    modes, lines = [*inside, *known], cut.tool.frequency
    plain = ToolPoint(tuple(modes), tuple(1.0 for _ in modes))
    whole = found.model.response(lines, windowed=False)
    first = int(np.argmin(cut.factor * whole.real))
    rest = float((whole - plain.receptance(lines)).real[first])
    factors = [cut.factor for _ in modes]
    if abs(rest) > _NO_REST * abs(whole[first]):
        far = _FAR * cut.tool.highest
        modes.append(Mode(far, _WELL_DAMPED, 1.0 / abs(rest) / (1.0 - float(lines[first] / far) ** 2)))
        factors.append(math.copysign(cut.factor, cut.factor * rest))
    sentence = f"Modes fitted to the response: {', '.join(f'{mode.frequency:.1f} Hz' for mode in inside)}"
    if len(modes) > len(inside):
        ends = f"{cut.tool.frequency[0]:.3g} to {cut.tool.highest:.0f} Hz"
        sentence += f"; the residual term outside {ends} is kept" + "".join(f", as a mode near {mode.frequency:.0f} Hz" for mode in known)
    return ToolPoint(tuple(replace(mode, direction=cut.direction) for mode in modes), tuple(factors)), f"{sentence}."


SENSORS: dict[str, tuple[Quantity, str, str]] = {
    "displacement": ("receptance", "m", "2 nm"),
    "velocity": ("mobility", "m/s", "2 um/s"),
    "acceleration": ("accelerance", "m/s^2", "0.02 m/s^2"),
}
"""What a sensor reads -> the response over force, its unit, and its noise where nothing is said."""
_TRIES = 4


def _modes(lesson: Lesson, entry: ToolPointEntry, value: Callable[[str, str], float]) -> list[Mode]:
    """Return the modes that a lesson gives; a wrong one is refused at its place."""
    modes = []
    for number, mode in enumerate(entry.modes):
        at = lesson.source.place(("tool_point", "modes", number))
        try:
            modes.append(
                Mode(value(mode.frequency, "Hz"), value(mode.damping, "1"), value(mode.stiffness, "N/m"), value(mode.direction, "rad"))
            )
        except LessonError as error:
            raise error if error.place else LessonError(error.fact, place=at, remedy=error.remedy) from None
    return modes


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
    value = partial(si_of, place=place)
    modes = _modes(lesson, entry, value)
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
    if settings.length * settings.rate > TAP.values:
        raise LessonError(f"a hit would have {settings.length * settings.rate:.3g} samples.", place=place, remedy="Shorten the record.")
    if settings.length < TAP.shortest:
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
    if not path.is_file():
        raise RecordingError("there is no such file.", place=str(path))
    table = read_text(path)
    time, force = _column(table, "time", "s"), _column(table, "force", "N")
    sensor = next((word for word in SENSORS if any(name.lower().startswith(word) for name in table.columns)), None)
    if sensor is None:
        raise RecordingError("no column is a displacement, velocity or acceleration.", place=str(path), remedy="Name it so, with its unit.")
    quantity, unit, _ = SENSORS[sensor]
    response = _column(table, sensor, unit)
    steps = np.diff(time)
    if len(steps) < SHORT.samples or not (steps > 0.0).all() or steps.max() > TAP.uneven * np.median(steps):
        raise RecordingError("the time does not rise evenly.", place=str(path), remedy="Give one row a sample.")
    return estimate_response(_split(force, response, 1.0 / float(np.median(steps)), quantity, path))


def _column(table: RawTable, word: str, unit: str) -> FloatArray:
    name = next((name for name in table.columns if name.lower().startswith(word)), None)
    if name is None:
        raise RecordingError(f"no column is named '{word}'.", place=str(table.source), remedy=f"Name one '{word} [{unit}]'.")
    values, told = table.columns[name], table.units.get(name)
    if not np.isfinite(values).all():
        raise RecordingError(f"a cell of '{name}' holds no number.", place=str(table.source), remedy="Leave its row out.")
    return np.asarray(values * (quantity(f"1 {told}", unit) if told else 1.0))


def _split(force: FloatArray, response: FloatArray, rate: float, quantity: Quantity, path: Path) -> TapRecord:
    """Return the hits of a recording, each with the silence before it, all as long as the shortest distance."""
    top = float(force.max())
    above = force > TAP.hit * top
    starts = np.flatnonzero(above & ~np.concatenate([[False], above[:-1]]))
    gap = int(0.1 * rate)
    firsts = [int(start) for place, start in enumerate(starts) if place == 0 or start - starts[place - 1] > gap]
    if not firsts or top <= 0.0:
        raise RecordingError("no hit stands out in the force.", place=str(path), remedy="Check the sign and the column of the force.")
    before = min(int(0.01 * rate), firsts[0])
    length = min([second - first for first, second in itertools.pairwise(firsts)] + [len(force) - firsts[-1]])
    if length < SHORT.samples:
        raise RecordingError("the last hit is too close to the end.", place=str(path), remedy="Record longer.")
    pieces = [slice(first - before, first - before + length) for first in firsts]
    return TapRecord(np.stack([force[piece] for piece in pieces]), np.stack([response[piece] for piece in pieces]), rate, quantity)
