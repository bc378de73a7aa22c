"""Way-points of a machine: where it was at times that need not be even, and which part program it was running.

A control whose clock wanders against the program: the deviations it makes are related, and are taken apart before they are fitted.

A control rounds each block up to its own cycle, or waits for a buffer. Block by block it is ahead or behind by a little more. An axis at
speed v is then off by v tau, and tau walks at random:

    deviation(t) = v(t) tau(t) + e(t),   d tau ~ N(0, q dt),   e ~ N(0, s^2)

Taken as noise of one size, such deviations would pull values of the machine, most of all in fast programs. The Kalman filter gives what is
new in each deviation, which is white if q and s are right, and the likelihood of both. Source: A. C. Harvey, Forecasting, Structural Time
Series Models and the Kalman Filter (1989), sections 3.2 and 3.4.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lathesim.engine.assembly import FloatArray
from lathesim.errors import LessonError, RecordingError
from lathesim.lessons.lesson import Lesson, find_program
from lathesim.lessons.recording_mapping import mapping_of
from lathesim.lessons.simulate import Prepared, prepare
from lathesim.plugins import Registry
from lathesim.recordings.mapping import rows_as_taken
from lathesim.recordings.raw_table import Finding, read_recording
from lathesim.units import in_unit

_BEGINS = (-1e-9, 3600.0)
"""Times [s] at which way-points may begin: of a program, and not of the day."""
LEAST_WAYPOINTS = 20
"""Fewer way-points say nothing about a machine; assumed."""
_STILL = 1e-9
"""A channel [SI] that moves less than this stands still."""


@dataclass(frozen=True, eq=False)
class Waypoints:
    """Way-points of one run: ``time`` (n,) [s] since the program began, ``values`` channel -> (n,) [SI], NaN where nothing was written.

    ``prepared`` is the lesson's machine on the program that was run; ``resolution`` [SI] is what the lesson tells of a channel.
    """

    name: str
    file: Path
    prepared: Prepared
    time: FloatArray
    values: dict[str, FloatArray]
    resolution: dict[str, float]
    findings: tuple[Finding, ...]

    @property
    def channels(self) -> tuple[str, ...]:
        """The channels, in the order of the lesson."""
        return tuple(self.values)

    @property
    def duration(self) -> float:
        """Time of the last way-point [s]."""
        return float(self.time[-1])


def read_waypoints(lesson: Lesson, given: str, registry: Registry) -> Waypoints:
    """Return the way-points of ``FILE``, or of ``PROGRAM=FILE`` where PROGRAM is a variant of the lesson or a part program.

    Without ``PROGRAM=`` a file that is called as a variant or as the part program of one is a run of that. Otherwise it is one of the
    lesson's own program. Raises :class:`RecordingError` where the file tells too little, :class:`LessonError` where no program fits.
    """
    named, _, text = given.rpartition("=")
    file = Path(text)
    prepared = _prepared(lesson, named, file, registry)
    findings: list[Finding] = []
    mapping = mapping_of(lesson, prepared.machinery)
    time, values = rows_as_taken(read_recording(file, registry.readers), mapping, findings)
    present = {name: column for name, column in values.items() if np.isfinite(column).any()}
    keep = np.isfinite(time) & np.any([np.isfinite(column) for column in present.values()] or [np.zeros(len(time), bool)], axis=0)
    time, present = time[keep], {name: column[keep] for name, column in present.items()}
    if len(time) < LEAST_WAYPOINTS:
        fact = f"the recording has {len(time)} way-point{'s' if len(time) != 1 else ''}."
        raise RecordingError(fact, place=str(file), remedy=f"Record at least {LEAST_WAYPOINTS}, while the axes move.")
    order = np.argsort(time, kind="stable")
    if (np.diff(order) < 0).any():
        findings.append(Finding("order", "", "rows were out of order in time", "they were sorted"))
        time, present = time[order], {name: column[order] for name, column in present.items()}
    if time[0] < _BEGINS[0] or time[0] > _BEGINS[1]:
        findings.append(
            Finding("clock", "", f"the clock begins at {time[0]:.6g} s", "the first way-point is taken as the program's beginning")
        )
        time = time - time[0]
    if all(np.nanmax(column) - np.nanmin(column) < max(_STILL, 0.0) for column in present.values()):
        raise RecordingError("nothing moves in the recording.", place=str(file), remedy="Record a program that moves the axes.")
    resolution = {signal.target: signal.resolution for signal in mapping.signals if signal.resolution}
    name = named if named in lesson.variants else Path(named or file).stem
    return Waypoints(name, file, prepared, time, present, resolution, tuple(findings))


def _prepared(lesson: Lesson, named: str, file: Path, registry: Registry) -> Prepared:
    """Return the lesson's machine on the program that a recording is a run of."""
    if named in lesson.variants:
        return prepare(lesson, registry, named)
    if named:
        program = find_program(named, lesson.path.parent)
        if program is None:
            known = ", ".join(lesson.variants)
            remedy = f"The lesson has the variants {known}." if known else "Write the way to a part program."
            raise LessonError(f"'{named}' is neither a variant of the lesson nor a part program.", place=f"{named}={file}", remedy=remedy)
        return prepare(lesson, registry, program=program)
    for variant in lesson.variants:
        program_named = lesson.settings.variants[variant].program
        if file.stem == variant or (program_named and Path(program_named).stem == file.stem):
            return prepare(lesson, registry, variant)
    beside = file.with_suffix(".nc")
    return prepare(lesson, registry, program=beside) if beside.is_file() else prepare(lesson, registry)


_QS = np.geomspace(1e-10, 1e-4, 13)
"""Wandering q [s^2/s] that is looked at: 10 us to 10 ms in a second; assumed."""
_SIZES = np.geomspace(0.01, 1.2, 19)
"""White parts that are looked at, as shares of what is left; assumed."""
_SURE = 6.0
"""Gain in twice the logarithm of the likelihood from which on a clock is called wandering: a chance of 1 % with one value more."""


@dataclass(frozen=True, eq=False)
class Wandering:
    """A clock's wandering q [s^2/s], and how fast each channel of each recording changes (channels, times) [SI/s]."""

    spread: float
    rates: tuple[FloatArray, ...]


def whitened(
    deviation: FloatArray, weights: FloatArray, time: FloatArray, rates: FloatArray, spread: float, floor: float
) -> FloatArray:  # fmt: skip
    """Return what is new in deviations (members, channels, times), in standard deviations.

    ``weights`` (channels,) is what a square counts, so that the white part of a channel is ``floor``/sqrt(weight). With no wandering these
    are the deviations in white parts.
    """
    root = np.sqrt(weights)[:, None]
    if spread <= 0.0:
        return deviation * (root / floor)
    return _filtered(deviation * root, time, rates * root, np.array([spread]), np.array([floor]))[0]


def _filtered(
    deviation: FloatArray, time: FloatArray, rates: FloatArray, spread: FloatArray, floor: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return what is new (members, channels, times) in standard deviations, and these (settings, channels, times).

    ``spread`` and ``floor`` hold one number, or one for each member.
    """
    found, variances = np.empty((max(len(deviation), len(spread)), *rates.shape)), np.empty((len(spread), *rates.shape))
    late, doubt, before = np.zeros(len(found)), np.zeros(len(spread)), 0.0
    for place, now in enumerate(time):
        doubt = doubt + spread * (now - before)
        before = now
        for channel in range(len(rates)):
            slope = rates[channel, place]
            variance = np.square(floor) + slope * slope * doubt
            gain = doubt * slope / variance
            new = deviation[:, channel, place] - slope * late
            late = late + gain * new
            doubt = doubt - gain * slope * doubt
            variances[:, channel, place] = variance
            found[:, channel, place] = new / np.sqrt(variance)
    return found, np.sqrt(variances)


def likely_wandering(
    deviations: Sequence[FloatArray], weights: Sequence[FloatArray], times: Sequence[FloatArray], rates: Sequence[FloatArray]
) -> tuple[float, float]:
    """Return q [s^2/s] and the white part s under which deviations (channels, times) of each recording are most likely, from a grid.

    q is zero where the likelihood does not ask for more.
    """
    rows = [(deviation * np.sqrt(weight)[:, None])[weight > 0.0] for deviation, weight in zip(deviations, weights, strict=True)]
    slopes = [(rate * np.sqrt(weight)[:, None])[weight > 0.0] for rate, weight in zip(rates, weights, strict=True)]
    total = np.concatenate([row.ravel() for row in rows])
    rms = max(float(np.sqrt(np.square(total).mean())), 1e-12)
    spreads, floors = (item.ravel() for item in np.meshgrid(_QS, _SIZES * rms))
    costs = np.zeros(len(spreads))
    for row, slope, time in zip(rows, slopes, times, strict=True):
        new, sizes = _filtered(row[None], time, slope, spreads, floors)
        costs += (np.square(new) + 2.0 * np.log(sizes)).sum(axis=(1, 2))
    best = int(np.argmin(costs))
    if costs[best] < len(total) * (2.0 * np.log(rms) + 1.0) - _SURE:
        return float(spreads[best]), float(floors[best])
    return 0.0, rms


_LEAST_LEAD = 0.05
"""Time [s] by which a clock must be ahead or behind at the end before it is told; assumed: a shorter one is lag or jitter."""
_LEFT = 0.1
"""Share of the power left by a constant shift that a running clock may leave; assumed: other machines leave far more."""


def clocks_apart(recorded: Sequence[Waypoints], simulated: Sequence[FloatArray]) -> Iterator[str]:
    """Yield a sentence for each recording whose clock runs apart from the simulated program's.

    ``simulated`` holds for each recording the readings (channels, times) [SI] of the machine as given at its times. Two fits by least
    squares are compared, y(t) = m(t - d) and y(t) = m(t / (1 + s) - d): a constant shift d is the lag of an axis, a skew s is none. A
    sentence comes where the skew takes away nine tenths of what a shift leaves, and 50 ms or more come together by the end. A control that
    slows down at each corner looks the same, so the recording is not refused.
    """
    for item, readings in zip(recorded, simulated, strict=True):
        if not np.isfinite(readings).all():
            continue
        skew, left = _skew(item, readings)
        late = skew * item.duration
        if abs(late) < _LEAST_LEAD or left > _LEFT:
            continue
        pace, corners = ("fast", "slower") if late > 0.0 else ("slow", "quicker")
        yield (
            f"{item.file.name}: its clock runs {in_unit(abs(skew), '%', '.2g')} {pace} against the program as simulated, "
            f"{in_unit(abs(late), 'ms', '.3g')} after {item.duration:.3g} s. Correct its time column, unless the control is that much "
            f"{corners} at corners."
        )


def _skew(item: Waypoints, readings: FloatArray) -> tuple[float, float]:
    """Return the skew of the clock (0.01: a second lasts 1.01 s) and the power it leaves, as a share of what a shift alone leaves."""
    from scipy.optimize import least_squares

    time, values = item.time, list(item.values.values())

    def deviations(point: FloatArray) -> FloatArray:
        stretched = time / (1.0 + point[1]) - point[0] if len(point) > 1 else time - point[0]
        rows = [column - np.interp(stretched, time, row) for column, row in zip(values, readings, strict=True)]
        return np.asarray(np.nan_to_num(np.concatenate(rows)))

    shift = least_squares(deviations, [0.0], x_scale=0.1, diff_step=1e-3)
    # a descent finds the skew only from nearby, so several starts are tried
    both = min(
        (
            least_squares(deviations, [0.0, start], x_scale=[0.1, 0.01], bounds=([-2.0, -0.2], [2.0, 0.2]))
            for start in (-0.05, -0.01, 0.0, 0.01, 0.05)
        ),
        key=lambda found: float(found.cost),
    )
    return float(both.x[1]), float(both.cost / max(shift.cost, 1e-300))
