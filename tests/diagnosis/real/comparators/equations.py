"""The recordings as equations: a filtered channel, what the lesson says of it, and what else moves.

A comparator knows no simulator. It is given the force (or current) that the motion needs, what a command drives, and how two sensors of
one motion differ, each filtered alike on both sides (inverse dynamics; M. Gautier, P. Khosla, Exciting trajectories, 1992). Filters run
forward and backward, and what is left is thinned to the rate that they let through.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, filtfilt

from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.recording_mapping import mapping_of
from lathesim.lessons.simulate import prepare
from lathesim.plugins import load_registry
from lathesim.record import Record
from lathesim.recordings.mapping import map_recording
from lathesim.recordings.raw_table import read_recording
from tests.diagnosis.real.cases import Case

Array = NDArray[np.float64]
Filter = Callable[[Array], Array]


@dataclass(frozen=True)
class Equation:
    """A channel at a part, the columns that the lesson gives it with value and relative doubt, and the motion that it may depend on.

    A lateness is in every equation of motion, as rows are never taken at one instant; it has a name from more than half a row on.

    ``kind`` is "force", "drive" or "difference": which candidates there are. ``smooth`` filters a full column and thins it.
    """

    kind: str
    part: str
    unit: str
    values: Array
    given: Mapping[str, tuple[Array, float, float]]
    time: Array
    position: Array
    velocity: Array
    command: Array
    smooth: Filter

    @property
    def period(self) -> float:
        """The time between rows [s]."""
        return float(self.time[1] - self.time[0])


@dataclass(frozen=True)
class Reading:
    """How the equations of a case are read: parts, channels and the band [Hz] in which the motion shows."""

    band: float
    part: str
    position: str
    force: str
    given: Mapping[str, tuple[float, float]]
    """Inertia and damping of the lesson, with their relative doubts."""
    gain: float = 1.0
    drive: tuple[str, str] = ("", "")
    """Part and channel of the voltage that drives a current."""
    other: str = ""
    """A second sensor of the motion."""


MOTOR = {"inertia": (4.5e-6, 0.2), "viscous": (8e-6, 0.5)}
ARM = {"inertia": (1500.0, 0.3), "viscous": (2050.0, 0.3)}
TABLE = {"inertia": (6316.547, 0.05), "viscous": (4737.41, 0.15)}
READINGS = {
    "laas_slow": Reading(150.0, "spindle", "spindle_encoder.angle", "spindle.torque", MOTOR, other="spindle.speed"),
    "laas_fast": Reading(40.0, "spindle", "spindle_encoder.angle", "spindle.torque", MOTOR, other="spindle.speed"),
    "kuka": Reading(15.0, "spindle", "spindle_encoder.angle", "spindle.torque", ARM, other="second_encoder.angle"),
    "half": Reading(15.0, "spindle", "spindle_encoder.angle", "spindle.torque", ARM, other="second_encoder.angle"),
    "rack": Reading(40.0, "x_axis", "x_axis.velocity", "x_axis.force", {"inertia": (24.7, 0.05), "viscous": (20.0, 1.0)}),
    "flexible": Reading(12.0, "spindle", "spindle_encoder.angle", "drive.voltage", {"inertia": (0.43, 0.5), "viscous": (5.7, 0.6)}),
    "lift": Reading(3.0, "x_axis", "x_axis.reference", "x_axis.current", {"inertia": (0.01, 100.0), "viscous": (0.05, 0.5)}),
    "a0": Reading(
        30.0, "x_axis", "x_encoder.position", "x_drive.current", TABLE, 439.823, ("x_drive", "x_dac.voltage"), "x_scale.position"
    ),
}  # fmt: skip


def equations(case: Case) -> list[tuple[Equation, Equation]]:
    """Return the equations of a case, each from the fitted and from the held-out recording (halves of one where there is one alone)."""
    reading = next(one for start, one in READINGS.items() if case.name.startswith(start))
    records = [_read(case, name) for name in (case.fitted, case.validation) if name]
    if len(records) == 1:
        half = len(records[0].time) // 2
        records = [_part(records[0], slice(0, half)), _part(records[0], slice(half, None))]
    fitted, held_out = (_of_record(record, reading) for record in records)
    return list(zip(fitted, held_out, strict=True))


Columns = Mapping[str, Array]


@dataclass(frozen=True)
class _Rows:
    time: Array
    channels: Columns


def _part(rows: _Rows, where: slice) -> _Rows:
    return _Rows(rows.time[where] - rows.time[where][0], {name: values[where] for name, values in rows.channels.items()})


def _read(case: Case, name: str) -> _Rows:
    registry = load_registry()
    lesson = load_lesson(case.file(case.lesson))
    mapping = mapping_of(lesson, prepare(lesson, registry).machinery)
    record: Record = map_recording(read_recording(case.file(name), registry.readers.values()), mapping).record
    return _Rows(np.asarray(record.time), {signal.target: np.asarray(record[signal.target]) for signal in mapping.signals})


def _of_record(rows: _Rows, reading: Reading) -> list[Equation]:
    """Return the force, the drive and the difference of sensors as far as the case records them."""
    period = float(rows.time[1] - rows.time[0])
    low = butter(3, min(0.9, 2.0 * period * reading.band))
    step = max(1, round(0.25 / (period * reading.band)))
    edge = min(len(rows.time) // 20, round(1.0 / (period * reading.band)))

    def filtered(values: Array) -> Array:
        return np.asarray(filtfilt(*low, values))

    def smooth(values: Array) -> Array:
        return filtered(values)[edge : len(values) - edge : step]

    def late(values: Array) -> tuple[Array, float, float]:
        return -np.gradient(filtered(values), period)[edge : len(values) - edge : step], 0.0, np.inf

    measured = rows.channels[reading.position]
    if reading.position.endswith("velocity"):
        velocity = filtered(measured)
        position = np.cumsum(velocity) * period
    else:
        position = measured
        velocity = np.gradient(filtered(measured), period)
    force = reading.gain * rows.channels[reading.force]
    common = {"time": rows.time, "position": position, "velocity": velocity, "smooth": smooth}
    doubts = {"inertia": np.gradient(velocity, period), "viscous": velocity}
    given = {name: (smooth(column), *reading.given[name]) for name, column in doubts.items()}
    made = [Equation("force", reading.part, "force", smooth(force), {**given, "late": late(force)}, command=force, **common)]  # type: ignore[arg-type]
    if reading.drive[0]:
        voltage, current = rows.channels[reading.drive[1]], rows.channels[reading.force]
        given = {"gain": (smooth(voltage), 7.5, 0.1), "speed": (smooth(velocity), -1304.0, 0.1)}
        made.append(Equation("drive", reading.drive[0], "A", smooth(current), given, command=voltage, **common))  # type: ignore[arg-type]
    if reading.other:
        moved = velocity if reading.other.endswith("speed") else position
        values = smooth(rows.channels[reading.other] - moved)
        part = reading.other.partition(".")[0]
        given = {"zero": (np.ones(len(values)), 0.0, np.inf), "late": late(moved)}
        made.append(Equation("difference", part, "", values, given, command=moved, **common))  # type: ignore[arg-type]
    return made
