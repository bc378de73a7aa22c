"""Channels of a recording: how one moves, how noisy it is, and what channels that show one motion twice must agree in."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lathesim.engine.assembly import Place
from lathesim.record import FloatArray, Record
from lathesim.recordings.mapping import RecordingMapping
from lathesim.recordings.raw_table import Finding
from lathesim.recordings.recording_thresholds import MOTION, ROUNDING

_SECOND_DIFFERENCE = np.sqrt(6.0)
"""Standard deviation of the second difference of white noise of standard deviation one."""


@dataclass(frozen=True, eq=False)
class RecordedChannel:
    """A channel (samples,) in its SI ``unit``; ``driven`` says whether it is an input of the machine; ``group`` is what it belongs to.

    The group is the part's name up to the first underscore: ``x`` for ``x_controller.reference``, ``x_encoder.position`` and so on.
    """

    name: str
    unit: str
    values: FloatArray
    driven: bool

    @property
    def part(self) -> str:
        """The part of the machine whose input or output it is."""
        return Place.of(self.name).part

    @property
    def group(self) -> str:
        """The axis or unit a channel belongs to."""
        return self.part.partition("_")[0]

    @cached_property
    def steps(self) -> FloatArray:
        """Differences from sample to sample (samples - 1,)."""
        return np.diff(self.values)

    @cached_property
    def span(self) -> float:
        """Largest less smallest value."""
        return float(self.values.max() - self.values.min())

    @cached_property
    def constant(self) -> bool:
        """Whether it never moves; the last bits of a computed constant do not count."""
        return self.span <= ROUNDING * float(np.abs(self.values).max())

    @cached_property
    def roughness(self) -> float:
        """Standard deviation of what is new in every sample (noise and rounding), from second differences, robust."""
        second = np.diff(self.values, 2)
        return max(1.4826 * float(np.median(np.abs(second))), float(np.quantile(np.abs(second), 0.9)) / 1.645) / float(_SECOND_DIFFERENCE)

    @cached_property
    def usual_step(self) -> float:
        """The largest step that is usual: exceeded by one in a thousand."""
        return float(np.quantile(np.abs(self.steps), 0.999))


def channels_of(record: Record, mapping: RecordingMapping) -> list[RecordedChannel]:
    """Return the mapped channels that hold numbers throughout."""
    found = []
    for signal in mapping.signals:
        values = record[signal.target]
        if len(values) > 2 and np.isfinite(values).all():
            found.append(RecordedChannel(signal.target, signal.si_unit, values, signal.role == "drive"))
    return found


_FACTORS: tuple[tuple[float, str], ...] = (
    (2.0, "a diameter read as a radius"),
    (10.0, "a factor of ten"),
    (100.0, "a factor of a hundred"),
    (1e3, "a lost or doubled milli"),
    (1e6, "a lost or doubled micro"),
    (25.4, "inches and millimetres"),
    (0.0254, "inches and metres"),
    (2.0 * math.pi, "turns and radians"),
    (math.pi, "half turns and radians"),
    (180.0 / math.pi, "degrees and radians"),
    (360.0, "degrees and turns"),
    (60.0, "minutes and seconds"),
    (6e4, "mm/min and m/s"),
    (30.0 / math.pi, "turns a minute and rad/s"),
    (9.80665, "kilograms and newtons"),
    (4.4482216, "pounds and newtons"),
)
_NEAR = 0.03


def known_factor(ratio: float, near: float = _NEAR) -> str:
    """Return which mistaken unit leaves a factor like ``ratio`` (or its inverse), within the share ``near``; empty where none does."""
    size = abs(ratio)
    if size == 0.0 or not math.isfinite(size):
        return ""
    found = [
        (abs(math.log(size / known)), name)
        for factor, name in _FACTORS
        for known in (factor, 1.0 / factor)
        if abs(size / known - 1.0) < near
    ]
    return min(found)[1] if found else ""


MOTION_UNITS = ("m", "rad", "m/s", "rad/s")
_ALIKE = 0.98
"""Correlation from which on two channels count as one motion."""


@dataclass(frozen=True, eq=False)
class Pair:
    """Two channels of one axis that should show the same motion: ``second`` = ``slope`` * ``first`` + constant.

    ``expected`` is what ``first`` says the second one is (the channel itself, or its rate of change); ``correlation`` says how alike
    they are.
    """

    first: RecordedChannel
    second: RecordedChannel
    expected: FloatArray
    slope: float
    correlation: float


def pairs(channels: list[RecordedChannel], period: float) -> list[Pair]:
    """Return the pairs of channels that should show the same motion, the driven one first."""
    found = []
    ordered = sorted((channel for channel in channels if channel.unit in MOTION_UNITS and not channel.constant), key=lambda c: not c.driven)
    for position, first in enumerate(ordered):
        for second in ordered[position + 1 :]:
            if first.group != second.group or second.driven:
                continue
            if first.unit == second.unit:
                if first.part == second.part:
                    continue
                found.append(_pair(first, second, first.values))
            elif second.unit == f"{first.unit}/s":
                found.append(_pair(first, second, rate(first.values, period)))
            elif first.unit == f"{second.unit}/s":
                found.append(_pair(second, first, rate(second.values, period)))
    return found


def rate(values: FloatArray, period: float, half: int = 5) -> FloatArray:
    """Return the rate of change, the slope over 2 ``half`` + 1 samples."""
    half = min(half, (len(values) - 1) // 2)
    weights = np.arange(-half, half + 1.0)
    ends = np.concatenate([np.full(half, values[0]), values, np.full(half, values[-1])])
    slope: FloatArray = np.convolve(ends, -weights, mode="valid") / (period * float(weights @ weights))
    return slope


def _pair(first: RecordedChannel, second: RecordedChannel, expected: FloatArray) -> Pair:
    correlation = correlated(expected, second.values)
    spread = float(np.std(expected))
    slope = np.copysign(float(np.std(second.values)) / spread, correlation) if spread > 0.0 else 0.0
    return Pair(first, second, expected, float(slope), correlation)


def correlated(first: FloatArray, second: FloatArray) -> float:
    """Return the correlation of two signals; 0 where one of them is constant."""
    one, other = (_of_size_one(values - values.mean()) for values in (first, second))
    size = float(np.sqrt(np.square(one).sum() * np.square(other).sum()))
    return float((one * other).sum()) / size if size > 0.0 else 0.0


def _of_size_one(values: FloatArray) -> FloatArray:
    """Return values divided by the largest magnitude, so that no square overflows or underflows."""
    largest = float(np.abs(values).max(initial=0.0))
    return values / largest if largest > 0.0 else values


def wrong_factors(found_pairs: list[Pair]) -> list[Finding]:
    """Find channels that follow another one of the same axis with a constant factor far from one, or with the opposite sign.

    Where two measured channels agree with each other and not with their reference, the reference is the one that is wrong.
    """
    wrong = [pair for pair in found_pairs if abs(pair.correlation) > _ALIKE and _is_wrong(pair)]
    right = [pair for pair in found_pairs if abs(pair.correlation) > _ALIKE and not _is_wrong(pair)]
    findings: list[Finding] = []
    for pair in wrong:
        agreeing = any(pair.second in (other.first, other.second) for other in right)
        lonely = not any(pair.first in (other.first, other.second) for other in right)
        blamed, other = (pair.first, pair.second) if agreeing and lonely else (pair.second, pair.first)
        if any(finding.channel in (blamed.name, other.name) for finding in findings):
            continue
        slope = pair.slope if blamed is pair.second else 1.0 / pair.slope
        whom = other.name if other.unit == blamed.unit else f"the rate of change of {other.name}"
        if other.unit != blamed.unit and blamed is pair.first:
            whom = f"what {other.name} says"
        if pair.slope < 0.0 and MOTION.smaller < abs(slope) < MOTION.larger:
            findings.append(Finding("sign", blamed.name, f"it moves against {whom} throughout", "check the sign of its scale", True))
            continue
        name = known_factor(slope)
        cause = f", as a mix-up of {name} leaves" if " and " in name else f", as {name} leaves" if name else ""
        fact = f"it is {slope:.5g} times {whom} throughout{cause}"
        findings.append(Finding("unit", blamed.name, fact, "check its unit and scale in the lesson", True))
    return findings


def _is_wrong(pair: Pair) -> bool:
    size = abs(pair.slope)
    far = not MOTION.smaller < size < MOTION.larger and (bool(known_factor(size)) or abs(pair.correlation) > MOTION.exact)
    places = pair.first.driven or pair.first.unit != pair.second.unit or pair.first.unit in ("m", "rad")
    return far or (pair.slope < 0.0 and places)


def swapped_columns(channels: list[RecordedChannel], period: float) -> list[Finding]:
    """Find channels of one axis whose columns were exchanged: another one does what this one should do, and this one does not."""
    findings = []
    for reference in (channel for channel in channels if channel.driven and channel.unit in MOTION_UNITS and not channel.constant):
        group = [channel for channel in channels if channel.group == reference.group and not channel.driven and not channel.constant]
        same = [channel for channel in group if channel.unit == reference.unit]
        others = [channel for channel in group if channel.unit not in MOTION_UNITS]
        for channel in same:
            likeness = abs(correlated(reference.values, channel.values))
            best = max(others, key=lambda other: abs(correlated(reference.values, other.values)), default=None)
            if best is not None and likeness < MOTION.alike and abs(correlated(reference.values, best.values)) > _ALIKE:
                fact = f"{best.name} follows {reference.name} and {channel.name} does not, so the two columns look swapped"
                findings.append(Finding("swapped", f"{channel.name}, {best.name}", fact, "exchange them in the lesson", True))
        findings += [finding for channel in same if (finding := _leading(reference, channel)) is not None]
    return findings + _swapped_speed(channels, period)


def _leading(reference: RecordedChannel, measured: RecordedChannel) -> Finding | None:
    """Find a reference that follows what it should lead, and has the noise that the measured channel should have."""
    if correlated(reference.values, measured.values) < _ALIKE or reference.roughness < MOTION.rougher * measured.roughness:
        return None
    ahead = [correlated(reference.values[shift:], measured.values[: len(measured.values) - shift]) for shift in (0, 2, 5)]
    behind = [correlated(measured.values[shift:], reference.values[: len(reference.values) - shift]) for shift in (0, 2, 5)]
    if max(ahead[1:]) <= ahead[0] or max(behind[1:]) >= behind[0]:
        return None
    fact = f"{reference.name} comes after {measured.name} and is the rougher of the two, so the two columns look swapped"
    return Finding("swapped", f"{reference.name}, {measured.name}", fact, "exchange them in the lesson", True)


def _swapped_speed(channels: list[RecordedChannel], period: float) -> list[Finding]:
    """Find an angle that is the rate of change of a speed signal, instead of the other way round."""
    findings = []
    places = [channel for channel in channels if channel.unit in ("rad", "m") and not channel.driven and not channel.constant]
    speeds = [channel for channel in channels if channel.unit in ("rad/s", "m/s", "V") and not channel.driven and not channel.constant]
    for place in places:
        for speed in speeds:
            if place.group != speed.group and (len(places) > 1 or len(speeds) > 1):
                continue
            right = abs(correlated(rate(place.values, period, 25), speed.values))
            wrong = abs(correlated(rate(speed.values, period, 25), place.values))
            if wrong > _ALIKE and right < MOTION.loosely:
                fact = f"{place.name} is the rate of change of {speed.name}, so the two columns look swapped"
                findings.append(Finding("swapped", f"{place.name}, {speed.name}", fact, "exchange them in the lesson", True))
    return findings
