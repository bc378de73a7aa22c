"""The laps of a lesson: its machine with a correction for each axis, run as often as is asked for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lathesim.effects.effect import Effect
from lathesim.effects.lag import CurrentLoopLag, MotorInductance, ServoLag
from lathesim.effects.offset_and_gain import ConverterResolution
from lathesim.effects.position_remedies import LearnedCorrection
from lathesim.effects.remedy import Remedy
from lathesim.effects.sensor_errors import SensorFilter
from lathesim.effects.time_shift import TransportDelay
from lathesim.engine.assembly import FloatArray, Place
from lathesim.engine.batch import Batch
from lathesim.engine.run import Hints, run
from lathesim.engine.wiring import wire
from lathesim.errors import LessonError
from lathesim.identification.position_loops import Loop, level_of, one_or_more, resolution_of
from lathesim.identification.replay.converter_rounding import counts_of
from lathesim.lessons.insertion import Machinery, insert_effect
from lathesim.lessons.simulate import Prepared

_FEWEST = 8
"""Samples of a lap."""

CONTOUR = Place("contour", "contour_error")
"""The distance from the path, where the machine tells it."""
LATE: tuple[type[Effect], ...] = (TransportDelay, SensorFilter, ServoLag, CurrentLoopLag, MotorInductance)
"""Effects that make a loop later and are linear."""


@dataclass(frozen=True)
class Lap:
    """One lap: errors of the axes as their sensors see them [m], shape (axes, samples), and the distance from the path [m]."""

    errors: FloatArray
    contour: FloatArray

    @property
    def rms(self) -> float:
        """Root mean square of the tracking error of all axes together [m]."""
        return float(np.sqrt(np.mean(np.sum(self.errors**2, axis=0))))

    @property
    def largest(self) -> float:
        """Largest distance from the path [m]."""
        return float(np.max(np.abs(self.contour)))

    @property
    def rms_contour(self) -> float:
        """Root mean square of the distance from the path [m]."""
        return float(np.sqrt(np.mean(self.contour**2)))


@dataclass(frozen=True)
class Course:
    """A machine made ready for laps of ``samples`` samples; ``what`` is "voltage" or "reference", to which corrections are added."""

    loops: tuple[Loop, ...]
    machinery: Machinery
    batch: Batch
    what: str
    samples: int
    period: float
    tables: tuple[str, ...]
    normals: tuple[int, ...]

    def lap(self, corrections: FloatArray, overrides: Mapping[str, float] | None = None) -> Lap:
        """Run a lap with a correction for each axis, shape (axes, samples)."""
        return self.laps([corrections], overrides)[0]

    def laps(self, corrections: Sequence[FloatArray], overrides: Mapping[str, float] | None = None) -> list[Lap]:
        """Run laps in one batch, each with corrections of its own."""
        names, row = list(overrides or {}), list((overrides or {}).values())
        given = {name: [one[place][:, None] for one in corrections] for place, name in enumerate(self.tables)}
        return list(self.batch.run(names, np.array([row for _ in corrections]), self._lap, given))

    def _lap(self, record: FloatArray) -> Lap:
        """Return the lap of a record (channels, samples)."""
        asked, read = self._rows("reference"), self._rows("reading")
        errors = record[asked] - record[read]
        place = self._contour()
        contour = record[place] if place is not None else np.sqrt(np.sum(errors**2, axis=0))
        good = np.all(np.isfinite(errors), axis=0) & np.isfinite(contour)
        if good.sum() > 0.5 * self.samples:
            return Lap(np.where(good, errors, 0.0), np.where(good, contour, 0.0))
        return Lap(np.full_like(errors, np.inf), np.full_like(contour, np.inf))

    def tables_of(self, corrections: FloatArray) -> FloatArray:
        """Return where the tables are in a lap with corrections, shape (axes, samples) [m]."""
        return np.asarray(np.nan_to_num(self._record(corrections)[self._rows("table")]))

    def references(self) -> FloatArray:
        """Return what is asked of the axes without correction, shape (axes, samples) [m]."""
        return np.asarray(self._record(np.zeros((len(self.tables), self.samples)))[self._rows("reference")])

    def axes_of_path(self) -> list[str]:
        """Return the word of each axis in a part program: by the output of the reference that it follows."""
        return ["Z" if Place.of(loop.reference).port.startswith("z") else "X" for loop in self.loops]

    def across(self, errors: FloatArray, corrections: FloatArray) -> FloatArray:
        """Return only the part of the errors across the path, where the machine tells the normal."""
        if len(self.normals) != len(self.loops):
            return errors
        normal = np.nan_to_num(self._record(corrections)[list(self.normals)])
        return np.asarray(normal * np.sum(normal * errors, axis=0))

    def exact(self, *, late: bool = False) -> dict[str, float]:
        """Return the values with which converters and encoders count as fine as they can and no effect acts: for the frequency response.

        With ``late``, effects that make a loop later act, as they are linear.
        """
        found: dict[str, float] = {}
        for part in self.machinery.parts:
            acts = late and issubclass(part.component, LATE)
            if issubclass(part.component, Effect) and not issubclass(part.component, Remedy) and not acts:
                found |= {f"{part.name}.{name}": value for name, value in part.component.neutral.items()}
        found |= {name: exact for name, (_, exact) in counts_of(self.machinery).items()}
        return {name: value for name, value in found.items() if name not in self.batch.plan.feeds}

    def _record(self, corrections: FloatArray) -> FloatArray:
        """Return what a lap with corrections records, shape (channels, samples)."""
        given = {name: [corrections[place][:, None]] for place, name in enumerate(self.tables)}
        return np.asarray(self.batch.run([], np.zeros((1, 0)), np.copy, given)[0])

    def floors(self) -> tuple[float, float]:
        """Return one level of the coarsest converter [V] and one count of the coarsest encoder [m]."""
        levels = [level_of(self.machinery, loop.converter) for loop in self.loops]
        rounding = [part for part in self.machinery.parts if issubclass(part.component, ConverterResolution)]
        levels += [part.parameters.get("resolution", 0.0) for part in rounding]
        return max(levels, default=0.0), max([resolution_of(self.machinery, loop.sensor) for loop in self.loops], default=0.0)

    def _rows(self, what: str) -> list[int]:
        channels = self.batch.plan.channels
        return [channels.index(getattr(loop, what)) for loop in self.loops]

    def _contour(self) -> int | None:
        channels = self.batch.plan.channels
        if str(CONTOUR) in channels:
            return channels.index(str(CONTOUR))
        return next((place for place, name in enumerate(channels) if Place.of(name).port == CONTOUR.port), None)


def course_of(prepared: Prepared, what: str) -> Course:
    """Return the course of a prepared lesson, as long as its program runs; raises :class:`LessonError` where no axis is controlled."""
    place = str(prepared.case.lesson.path)
    loops = one_or_more(prepared.machinery, place)
    machinery = replace(prepared.machinery, record=None)
    samples = len(run(wire(machinery), duration=prepared.duration, seed=prepared.case.seed, hints=Hints(prepared.expected_time)))
    if samples < _FEWEST:
        raise LessonError(f"the lap has {samples} samples, too few to learn from.", place=place)
    tables = []
    for loop in loops:
        seat = loop.controller
        if loop.sensor:
            seat = f"{seat}.{machinery.ports(seat)['reading' if what == 'voltage' else 'drive']}"
        name = _free_name(f"{loop.controller.replace('.', '_')}_learned", set(machinery.by_name))
        machinery = insert_effect(machinery, LearnedCorrection, seat, name=name)
        tables.append(f"{name}.samples")
    parts = tuple(
        replace(part, tables={**part.tables, "samples": np.zeros((samples, 1))}) if f"{part.name}.samples" in tables else part
        for part in machinery.parts
    )
    machinery = replace(machinery, parts=parts, record=None)
    plan = wire(replace(machinery, finish=""))
    batch = Batch(plan, samples, seed=prepared.case.seed)
    places = tuple(plan.channels.index(name) for name in ("contour.normal_x", "contour.normal_z") if name in plan.channels)
    return Course(loops, machinery, batch, what, samples, machinery.sample_period, tuple(tables), places)


def _free_name(wanted: str, taken: set[str]) -> str:
    """Return the name of a correction: the wanted one, numbered on where the lesson has learned already."""
    return next(name for name in (wanted, *(f"{wanted}_{number}" for number in range(2, len(taken) + 3))) if name not in taken)
