"""Time offsets between channels, from what they have in common: their motion, or the noise that one hands on to the other."""

from __future__ import annotations

import itertools

import numpy as np
import numpy.typing as npt

from lathesim.record import FloatArray
from lathesim.recordings.finding import Finding
from lathesim.recordings.recorded_channel import MOTION_UNITS, Pair, RecordedChannel, rate

_LATE = 4
"""Samples by which a command may lag the measurement it is made from."""
_LONGEST = 400
"""Samples to either side among which a shift is looked for."""
_SHORT, _HALF = 10.0, 0.5
"""Samples up to which a shift is held against how far apart the two are, and what share of it that must show."""
_ROUNDED = 5.0
"""Largest prediction error that the rounding of a converter causes [steps] (assumed)."""
_CLEAR, _STRONG = 12.0, 0.4
"""A peak of the correlation of noise stands this many times above what chance leaves, and is this high."""


def shifted_channels(channels: list[RecordedChannel], found_pairs: list[Pair], period: float) -> list[Finding]:
    """Return the time offsets between measured channels that show one motion, and between a measured channel and the command made from it.

    They are told with their value and are no fault by themselves: a slow sensor is late too.
    """
    findings = []
    for pair in found_pairs:
        first, second = pair.first, pair.second
        if first.driven or second.driven or pair.correlation < 0.9:
            continue
        late = motion_shift(pair.expected, second.values, first.unit == second.unit)
        if late is not None and abs(late) > 1.0 and _is_as_far_apart(pair, late):
            findings.append(Finding("shift", second.name, f"it comes {_told(late, period)} {first.name}", ""))
        skew = _skew(pair)
        if skew is not None:
            fact = f"its clock runs {1e6 * abs(skew):.0f} ppm {'slower' if skew > 0 else 'faster'} than that of {first.name}"
            findings.append(Finding("skew", second.name, fact, ""))
    for command in channels:
        if command.driven or command.unit != "V":
            continue
        places = [channel for channel in channels if channel.unit in MOTION_UNITS and channel.group == command.group and not channel.driven]
        if _is_rounding(command):
            continue
        shifts = [(height, late, place) for place in places for late, height in [noise_shift(place.values, command.values)]]
        if shifts and (best := max(shifts, key=lambda item: item[0]))[0] > _STRONG and abs(best[1]) >= _LATE:
            fact = f"its noise comes {_told(best[1], period)} that of {best[2].name}, from which it is made"
            done = "no controller knows the noise to come; shift one of the columns" if best[1] < 0 else ""
            findings.append(Finding("shift", command.name, fact, done, best[1] < 0))
    return findings


def _is_rounding(command: RecordedChannel) -> bool:
    """Return whether the prediction errors of a command are within the steps of the converter behind which it was recorded. Such noise is
    the rounding of the converter and comes from no other channel."""
    new, sizes = _whitened(command.values), np.abs(command.steps)
    changes = sizes[sizes > 1e-12 * float(np.abs(command.values).max())]
    if new is None or not len(changes):
        return True
    size = 1.4826 * float(np.median(np.abs(new))) * float(np.abs(np.diff(command.values, 2)).max())
    return size < _ROUNDED * float(changes.min())


def _is_as_far_apart(pair: Pair, late: float) -> bool:
    """Return whether two places differ as a shift by so many samples would make them.

    Rates of two staircases may be alike at any shift, while the places themselves are never a count apart.
    """
    if abs(late) > _SHORT or pair.first.unit != pair.second.unit:
        return True
    speed = rate(pair.expected, 1.0)
    apart = pair.expected - pair.second.values
    apart = apart - apart.mean()
    shown = float(apart @ speed) / max(float(speed @ speed), 1e-300)
    return shown * late > _HALF * late * late


def _told(late: float, period: float) -> str:
    return f"{abs(late) * period:.4g} s ({abs(late):.1f} samples) {'after' if late > 0.0 else 'before'}"


def motion_shift(first: FloatArray, second: FloatArray, same_kind: bool = True) -> float | None:
    """Return by how many samples ``second`` comes after ``first``, from the correlation of their rates; None where they tell nothing."""
    one, other = (rate(first, 1.0), rate(second, 1.0)) if same_kind else (first, second)
    one, other = one - one.mean(), other - other.mean()
    if not (one.any() and other.any()):
        return None
    lags, height = _correlation(one, other)
    near = np.abs(lags) <= _half_period(one)
    lags, height = lags[near], height[near]
    peak = int(np.argmax(height))
    if peak in (0, len(height) - 1):
        return None
    bend = height[peak - 1] - 2.0 * height[peak] + height[peak + 1]
    finer = 0.5 * (height[peak - 1] - height[peak + 1]) / bend if bend < 0.0 else 0.0
    return float(lags[peak] + finer)


def _half_period(values: FloatArray) -> int:
    """Return half the period of a motion in samples, at most the longest shift: where its autocorrelation has its first negative minimum.

    A period later a motion that repeats is like itself again: a shift beyond half of one cannot be told from a shorter one.
    """
    from scipy.signal import fftconvolve

    longest = min(_LONGEST, len(values) // 4)
    alike = fftconvolve(values, values[::-1], mode="full")[len(values) - 1 : len(values) + longest + 1]
    turns = np.flatnonzero((alike[1:-1] < 0.0) & (alike[1:-1] <= alike[:-2]) & (alike[1:-1] < alike[2:])) + 1
    return int(turns[0]) if len(turns) else longest


def noise_shift(first: FloatArray, second: FloatArray) -> tuple[int, float]:
    """Return by how many samples the noise of ``first`` appears later in ``second``, and the correlation there; 0 where it does not."""
    one, other = _whitened(first), _whitened(second)
    if one is None or other is None:
        return 0, 0.0
    lags, height = _correlation(one, other)
    height = np.abs(height)
    peak = int(np.argmax(height))
    chance = 1.4826 * float(np.median(height)) + 1e-300
    return (int(lags[peak]), float(height[peak])) if height[peak] > _CLEAR * chance else (0, 0.0)


def _whitened(values: FloatArray, order: int = 8) -> FloatArray | None:
    """Return what is new in every sample: the error of a linear prediction from the samples before, large ones cut."""
    second = np.diff(values, 2)
    if not second.any():
        return None
    second = second / np.abs(second).max()
    rows = np.column_stack([second[order - lag : len(second) - lag] for lag in range(1, order + 1)])
    target = second[order:]
    if not rows.any():
        return None
    normal = rows.T @ rows + 1e-9 * np.eye(order) * float(np.mean(np.square(rows)) * len(rows))
    new: FloatArray = target - rows @ np.linalg.solve(normal, rows.T @ target)
    limit = 4.0 * 1.4826 * float(np.median(np.abs(new)))
    return np.clip(new, -limit, limit) if limit > 0.0 else None


def _correlation(one: FloatArray, other: FloatArray) -> tuple[npt.NDArray[np.int64], FloatArray]:
    """Return lags and the correlation of the middle of ``one`` with the piece of ``other`` that comes as much later."""
    from scipy.signal import fftconvolve

    longest = min(_LONGEST, len(one) // 4)
    middle = one[longest : len(one) - longest]
    overlap = fftconvolve(other, middle[::-1], mode="valid")
    energy = np.cumsum(np.concatenate([[0.0], np.square(other)]))
    beneath = energy[len(middle) :] - energy[: len(energy) - len(middle)]
    height = overlap / np.sqrt(beneath * float(np.square(middle).sum()) + 1e-300)
    return np.arange(-longest, longest + 1), height


def _skew(pair: Pair, pieces: int = 6) -> float | None:
    """Return the clock skew of the second channel against the first, where the shift grows along the recording without doubt."""
    edges = np.linspace(0, len(pair.expected), pieces + 1).astype(int)
    shifts, middles = [], []
    for begin, end in itertools.pairwise(edges):
        piece = motion_shift(pair.expected[begin:end], pair.second.values[begin:end], pair.first.unit == pair.second.unit)
        if piece is not None and abs(piece) < _LONGEST / 2:
            shifts.append(piece)
            middles.append(0.5 * (begin + end))
    if len(shifts) < pieces - 1:
        return None
    slope, constant = np.polyfit(middles, shifts, 1)
    left = float(np.std(np.asarray(shifts) - (slope * np.asarray(middles) + constant)))
    grown = abs(slope) * len(pair.expected)
    return float(slope) if grown > 1.0 and grown > 10.0 * left else None
