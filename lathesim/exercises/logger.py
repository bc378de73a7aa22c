"""The columns of a recording that is made: which output of the machine each logs, in which unit, and how finely."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from lathesim.effects.effect import Effect
from lathesim.engine.assembly import Assembly, FloatArray, Place
from lathesim.errors import LessonError
from lathesim.identification.signal import SLOPE_ROUNDING
from lathesim.lessons.lesson import Lesson
from lathesim.lessons.recording_mapping import mapping_of
from lathesim.lessons.schema import ColumnEntry
from lathesim.units import si_factor

_ROUND_STEPS = (1.0, 2.0, 5.0)
LOGGER_BITS = 16
"""Bits of the logger of a channel whose resolution nobody gives (assumed)."""
TIME = "time"


@dataclass(frozen=True)
class LoggedColumn:
    """A column: its name and unit in the file (one there is ``scale`` of the unit), and the output ``channel`` of the machine it logs.

    ``target`` is the input it drives or the output it is compared with; ``resolution`` [SI] the step it is rounded to, 0 where none is;
    ``sensor`` the part that counts it in steps, where one does.
    """

    name: str
    unit: str
    scale: float
    channel: str
    target: str
    role: Literal["drive", "compare"]
    resolution: float
    sensor: str

    def over(self, values: FloatArray) -> LoggedColumn:
        """Return the column with a resolution: its own, or that of a logger over the range of ``values`` [SI]."""
        if self.resolution > 0.0 or self.role == "drive":
            return self
        largest = float(np.max(np.abs(values), initial=0.0))
        return replace(self, resolution=_round_step(2.0 * largest / 2.0**LOGGER_BITS)) if largest > 0.0 else self

    def floor(self, noise: float) -> float:
        """Return what the column cannot resolve [SI], with noise of ``noise`` steps."""
        return max(self.resolution * math.sqrt(1.0 / 12.0 + noise * noise), 1e-300)

    def logged(self, values: FloatArray, noise: float, rng: np.random.Generator) -> FloatArray:
        """Return what is written down [SI]: with noise where no sensor had it before, rounded to the resolution."""
        if self.role == "drive" or self.resolution <= 0.0:
            return values
        noisy = values if self.sensor else values + noise * self.resolution * rng.standard_normal(len(values))
        return np.asarray(self.resolution * np.round(noisy / self.resolution))

    def in_file(self, values: FloatArray) -> FloatArray:
        """Return SI values in the unit of the file."""
        return np.asarray(values / (self.scale * si_factor(self.unit)[0]))

    @property
    def decimals(self) -> int | None:
        """Decimals that the file needs for one step of the resolution; none where nothing is rounded."""
        if self.resolution <= 0.0:
            return None
        step = abs(self.resolution / (self.scale * si_factor(self.unit)[0]))
        return max(0, 1 - math.floor(math.log10(step) + 1e-9))


def _round_step(step: float) -> float:
    """Return the 1, 2 or 5 times a power of ten at or below ``step``."""
    power = 10.0 ** math.floor(math.log10(step))
    return max(power * factor for factor in _ROUND_STEPS if power * factor <= step * (1.0 + SLOPE_ROUNDING))


def logged_columns(lesson: Lesson, assembly: Assembly, signals: Mapping[str, FloatArray]) -> list[LoggedColumn]:
    """Return the columns that a lesson maps; without a mapping the commands, and the readings and voltages they lead to.

    ``signals`` holds the inputs that are driven from outside. Refused (:class:`LessonError`) where a driven input is fed by nothing that
    moves: then there is nothing to record.
    """
    recordings = lesson.settings.recordings
    if recordings is None:
        return _usual(assembly)
    mapping_of(lesson, assembly)
    columns = [_driven(name, entry, assembly, signals) for name, entry in recordings.drive.items()]
    return columns + [_compared(name, entry, assembly) for name, entry in recordings.compare.items()]


def recordings_entry(lesson: Lesson, columns: list[LoggedColumn]) -> dict[str, object]:
    """Return what stands under ``recordings:`` in the lesson for the class."""
    settings = lesson.settings.recordings
    if settings is not None:
        kept = dict(lesson.source.data["recordings"])
        kept["time"] = {"column": TIME if settings.time.column is None else settings.time.column, "unit": settings.time.unit}
        return {"file": "recording.csv", **{name: value for name, value in kept.items() if name != "file"}}
    entry: dict[str, object] = {"file": "recording.csv", "time": {"column": TIME, "unit": "s"}}
    for role in ("drive", "compare"):
        signals = {column.target: {"column": column.name, "unit": column.unit} for column in columns if column.role == role}
        if signals:
            entry[role] = signals
    return entry


def _driven(name: str, entry: ColumnEntry, assembly: Assembly, signals: Mapping[str, FloatArray]) -> LoggedColumn:
    source = f"recorded_{name.replace('.', '_')}.value" if name in signals else assembly.sources.get(name, "")
    if not source:
        remedy = "Wire it to an interpolator that follows a part program, or give a recording that holds it, with --drive FILE."
        raise LessonError(f"nothing that moves feeds {name}, which the recordings of the lesson drive.", remedy=remedy)
    return LoggedColumn(entry.column, entry.unit, entry.scale, source, name, "drive", 0.0, "")


def _compared(name: str, entry: ColumnEntry, assembly: Assembly) -> LoggedColumn:
    part, sensor_step = _sensor(name, assembly)
    declared = _declared_resolution(entry, assembly, name)
    return LoggedColumn(entry.column, entry.unit, entry.scale, name, name, "compare", declared or sensor_step, part)


def _declared_resolution(entry: ColumnEntry, assembly: Assembly, name: str) -> float:
    from lathesim.units import quantity

    return quantity(entry.resolution, assembly.declared(name).unit) if entry.resolution is not None else 0.0


def _sensor(channel: str, assembly: Assembly) -> tuple[str, float]:
    """Return the sensor whose reading a channel is, with its resolution [SI], where it counts in steps."""
    name, item = Place.of(channel)
    ports = assembly.ports(name)
    if item != ports.get("reading") or "resolution" not in ports or "measured" not in ports:
        return "", 0.0
    step = assembly.by_name[name].value(ports["resolution"])
    return (name, step) if step > 0.0 else ("", 0.0)


def _usual(assembly: Assembly) -> list[LoggedColumn]:
    """Return the columns for a lesson that maps none: what the controllers are asked for, their voltages, and what the sensors read."""
    columns = []
    own = [part for part in assembly.parts if not issubclass(part.component, Effect)]
    for part in own:
        ports = part.component.ports
        asked, measured = ports.get("drive"), ports.get("measured")
        if asked and measured and asked != measured and (source := assembly.sources.get(f"{part.name}.{asked}")):
            columns.append(_column(source, f"{part.name}.{asked}", "drive", assembly))
    for part in own:
        ports = part.component.ports
        if "reading" in ports and "measured" in ports and ports.get("drive") != ports["measured"]:
            channel = f"{part.name}.{ports['reading']}"
            columns.append(_column(channel, channel, "compare", assembly))
    if not any(column.role == "compare" for column in columns):
        remedy = "Add 'recordings:' with 'compare:' to the lesson."
        raise LessonError("the machine has no sensor and no controller to record.", remedy=remedy)
    return columns


def _column(channel: str, target: str, role: Literal["drive", "compare"], assembly: Assembly) -> LoggedColumn:
    sensor, step = _sensor(channel, assembly)
    return LoggedColumn(target.replace(".", "_"), assembly.declared(channel).unit, 1.0, channel, target, role, step, sensor)
