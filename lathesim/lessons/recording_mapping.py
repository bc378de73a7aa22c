"""What a lesson says under ``recordings:``, with the units of the machine's inputs and outputs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Literal

from lathesim.component import Declaration
from lathesim.engine.assembly import Assembly, Place
from lathesim.engine.wiring import wire
from lathesim.errors import LessonError
from lathesim.lessons.lesson import Lesson
from lathesim.lessons.part_values import si_in
from lathesim.lessons.schema import ColumnEntry, DrivingSignal
from lathesim.lessons.yaml_source import Location
from lathesim.recordings.mapping import BetweenRows, RecordingMapping, SignalMapping
from lathesim.recordings.sample_grid import Threshold
from lathesim.units import is_count

_LASTING = 10e-3
_MEASURED = ("N", "N*m", "A")
"""Units of forces, torques and currents, which are usually measured."""
_EXAMPLE = "recordings: {time: {column: t, unit: s}, drive: {x_controller.reference: {column: r, unit: m}}, compare: {...}}"


def mapping_of(lesson: Lesson, assembly: Assembly) -> RecordingMapping:
    """Return how the columns of a recording map to the machine, each entry with its place in the lesson.

    A driven input may also be read from a column called as the output that feeds it in the machine, as records of runs have it.
    Raises :class:`LessonError` where the lesson maps no recording or compares nothing; names and units were checked with the lesson.
    """
    recordings = lesson.settings.recordings
    if recordings is None:
        raise LessonError(
            "the lesson does not say what the columns of a recording mean.", place=str(lesson.path), remedy=f"Add {_EXAMPLE}."
        )
    if not recordings.compare:
        place = lesson.source.place(("recordings",), key=True)
        raise LessonError(
            "the lesson compares nothing with the recording.", place=place, remedy="Add compare: {x_encoder.position: {...}}."
        )
    declared = {f"{part.name}.{name}": item for part in assembly.parts for name, item in part.component.declarations.items()}
    sources = assembly.sources
    signals = [
        _signal(lesson, "drive", name, entry, declared, (sources[name],) if sources.get(name) else (), 0.0)
        for name, entry in recordings.drive.items()
    ]
    signals = [_between_rows(signal, entry, assembly) for signal, entry in zip(signals, recordings.drive.values(), strict=True)]
    steps = _steps(assembly)
    signals += [_signal(lesson, "compare", name, entry, declared, (), steps.get(name, 0.0)) for name, entry in recordings.compare.items()]
    time = recordings.time
    rate = None if time.rate is None else si_in(lesson.source, ("recordings", "time", "rate"), time.rate, "Hz")
    place = lesson.source.place(("recordings", "time", "column" if time.column is not None else "rate"))
    if rate is not None and rate <= 0.0:
        raise LessonError(f"the rate is {time.rate}.", place=place, remedy="Write a rate above 0 Hz.")
    return RecordingMapping(time.column, time.unit, rate, tuple(signals), place, time.mean_of, assembly.sample_period)


def _signal(
    lesson: Lesson,
    role: Literal["drive", "compare"],
    name: str,
    entry: ColumnEntry,
    declared: Mapping[str, Declaration],
    also: tuple[str, ...],
    step: float,
) -> SignalMapping:
    """Return the mapping of one column; ``step`` is the size [SI] of a count of the sensor that gives it, 0 where nothing counts."""
    location: Location = ("recordings", role, name)
    unit = declared[name].unit
    resolution = None if entry.resolution is None else si_in(lesson.source, (*location, "resolution"), entry.resolution, unit)
    place = lesson.source.place((*location, "column"))
    if entry.scale == 0.0:
        raise LessonError(
            "the scale is 0.", place=lesson.source.place((*location, "scale")), remedy="Leave it out, or write another number."
        )
    threshold = _threshold(lesson, entry, unit, location) if isinstance(entry, DrivingSignal) else None
    written, scale = entry.unit, entry.scale
    if threshold is None and is_count(written) and unit != "1":
        count = resolution or step
        if not count:
            where = lesson.source.place((*location, "unit"))
            remedy = f"Add the size of one count, as in resolution: {'0.036 deg' if unit == 'rad' else '1 um'}."
            raise LessonError(f"nothing says what one of the counts of {name} is worth.", place=where, remedy=remedy)
        written, scale, resolution = unit, scale * count, count
    return SignalMapping(name, entry.column, written, scale, resolution, role, unit, also=also, place=place, threshold=threshold)


def _between_rows(signal: SignalMapping, entry: DrivingSignal, assembly: Assembly) -> SignalMapping:
    """Return a driving signal with its course between two rows (``moves``), and whether that course is assumed.

    A force, torque or current on a moving part was measured, unless a controller or a converter of the machine gives it. A voltage was
    commanded, and so was the input of a controller or a converter.
    """
    if entry.held is not None or signal.threshold is not None:
        return replace(signal, between=BetweenRows(moves=entry.held is False, held=entry.held is True))
    ports = assembly.ports(signal.target)
    pushes = Place.of(signal.target).port in (ports.get("effort"), ports.get("drive")) and "measured" not in ports
    given = any(not wire(assembly).moves_between_samples(source) for source in signal.also)
    if not pushes or given or signal.si_unit not in (*_MEASURED, "V"):
        return signal
    moves = "flow" in ports and signal.si_unit in _MEASURED
    return replace(signal, between=BetweenRows(moves=moves, held=not moves, assumed=True))


def _steps(assembly: Assembly) -> dict[str, float]:
    """Return the size [SI] of one count for the reading of each sensor that counts."""
    steps = {}
    for part in assembly.parts:
        ports = part.component.ports
        if "reading" in ports and "resolution" in ports:
            steps[f"{part.name}.{ports['reading']}"] = part.value(ports["resolution"])
    return steps


def _threshold(lesson: Lesson, entry: DrivingSignal, unit: str, location: Location) -> Threshold | None:
    if entry.above is None or entry.value is None:
        return None
    above = si_in(lesson.source, (*location, "above"), entry.above, entry.unit)
    until_below = above if entry.until_below is None else si_in(lesson.source, (*location, "until_below"), entry.until_below, entry.unit)
    lasting = _LASTING if entry.lasting is None else si_in(lesson.source, (*location, "lasting"), entry.lasting, "s")
    value = si_in(lesson.source, (*location, "value"), entry.value, unit)
    if value == 0.0:
        place = lesson.source.place((*location, "value"))
        raise LessonError("the value is 0, on as well as off.", place=place, remedy="Write what the input is while it is on.")
    return Threshold(above, until_below, lasting, value)
