"""Hits to a frequency response: H1, H2 and coherence; double hits and overloads are found and left out.

    H1 = sum X F* / sum |F|^2,   H2 = sum |X|^2 / sum F X*,   coherence = |sum X F*|^2 / (sum |F|^2 sum |X|^2)

The force is set to 0 outside its pulse. Where a response has not died out at the end of its record, force and response are weighted by an
exponential window exp(-r t); the response is then that at j w + r, exactly, and its rate r is kept so that it can be taken from the
damping. Source: D. J. Ewins, Modal Testing (2000), chapter 3. Left out: noise that force and response share.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from lathesim.errors import RecordingError
from lathesim.record import FloatArray
from lathesim.stability.tool_point.frequency_response import Complex, FrequencyResponse, to_receptance
from lathesim.stability.tool_point.tap import TapRecord

SECOND_PULSE = 0.04
"""Share of the first pulse from which a later one counts as a double hit."""
NOISE_LEVELS = 8.0
"""Standard deviations of the noise that a second pulse has to stand out by."""
_FLAT_TOP = 3
"""Equal samples at the top of a pulse that tell an overload."""
_FORCE_FLOOR = 0.01
"""The response is kept where the spectrum of the force is above this share of its largest."""
_USABLE_BAND = 0.25
"""Frequencies up to this share of the sample rate are kept: filters fall off above."""
_MARGIN = 12
"""Samples kept before and behind a pulse."""
_DIED_OUT = 3.0
"""A response has died out when its end is within so many times its noise."""
_LEFT_AT_END = 1e-3


@dataclass(frozen=True)
class Hit:
    """What was found of a hit: its number from 1, its peak [N], and why it is left out; nothing where it is kept."""

    number: int
    peak: float
    reason: str = ""


@dataclass(frozen=True, eq=False)
class TapEstimate:
    """The response by H1 with coherence and single hits, that by H2 (lines,), and what was found of each hit."""

    response: FrequencyResponse
    by_h2: Complex
    hits: tuple[Hit, ...]


def estimate_response(record: TapRecord) -> TapEstimate:
    """Return the response of the hits that can be used; :class:`RecordingError` where none can."""
    hits = judged_hits(record)
    good = [hit.number - 1 for hit in hits if not hit.reason]
    if not good:
        told = "; ".join(f"hit {hit.number}: {hit.reason}" for hit in hits)
        raise RecordingError(f"no hit can be used: {told}.", remedy="Tap again, once at a time and not too hard.")
    count = record.force.shape[1]
    rate = _window_rate(record, good)
    window = np.exp(-rate * np.arange(count) / record.rate)
    pulses = [_pulse(record.force[at]) for at in good]
    forces = np.zeros((len(good), count))
    for row, (at, (begin, end)) in enumerate(zip(good, pulses, strict=True)):
        forces[row, begin:end] = record.force[at, begin:end] * window[begin:end]
    noise = math.sqrt(sum(_noise(record.force[at]) ** 2 for at in good) / len(good))
    responses = (record.response[good] - _zero(record, good)[:, None]) * window
    frequency = np.asarray(np.fft.rfftfreq(count, 1.0 / record.rate), dtype=np.float64)
    f, x = np.fft.rfft(forces) / record.rate, np.fft.rfft(responses) / record.rate
    power = (np.abs(f) ** 2).sum(axis=0)
    keep = (frequency > 0.0) & (frequency <= _USABLE_BAND * record.rate)
    first_low = np.flatnonzero(keep & (power < _FORCE_FLOOR**2 * power.max()))
    if len(first_low):
        keep &= frequency < frequency[first_low[0]]
    frequency, f, x, power = frequency[keep], f[:, keep], x[:, keep], power[keep]
    cross, answer = (x * f.conj()).sum(axis=0), (np.abs(x) ** 2).sum(axis=0)
    coherence = np.abs(cross) ** 2 / np.maximum(power * answer, 1e-300) if len(good) > 1 else None

    def receptance(values: Any) -> Complex:
        return to_receptance(frequency, values, record.quantity)[1]

    response = FrequencyResponse(
        frequency,
        receptance(cross / power),
        coherence,
        np.stack([receptance(row) for row in x / f]),
        np.sqrt(power / len(good)),
        record.quantity,
        rate,
        max(end - begin for begin, end in pulses) / record.rate,
        _lead(forces, pulses) / record.rate,
        noise / math.sqrt(record.rate),
        "tap test",
        tuple(f"hit {hit.number} is left out: {hit.reason}" for hit in hits if hit.reason),
    )
    return TapEstimate(response, receptance(answer / np.where(cross == 0.0, 1.0, cross.conj())), hits)


def judged_hits(record: TapRecord) -> tuple[Hit, ...]:
    """Return the hits with what is wrong with each."""
    return tuple(_judged(record, number) for number in range(len(record.force)))


def _judged(record: TapRecord, number: int) -> Hit:
    """Return a hit with what is wrong with it."""
    force = record.force[number]
    top = int(np.argmax(force))
    peak = float(force[top])
    noise = _noise(force)
    if not peak > NOISE_LEVELS * noise or peak <= 0.0:
        return Hit(number + 1, peak, "no pulse stands out of the noise")
    at_top = int(np.count_nonzero(force >= peak * (1.0 - 1e-9)))
    if peak >= record.force_range * (1.0 - 1e-9) or at_top >= _FLAT_TOP:
        return Hit(number + 1, peak, f"the force is overloaded at {peak:.0f} N")
    answer = record.response[number]
    highest = np.abs(answer).max()
    if int(np.count_nonzero(np.abs(answer) >= highest * (1.0 - 1e-9))) >= _FLAT_TOP and highest > 0.0:
        return Hit(number + 1, peak, "the response is overloaded")
    again = _second_pulse(force, top, max(SECOND_PULSE * peak, NOISE_LEVELS * noise))
    if again is not None:
        fact = f"a second pulse of {force[again]:.0f} N follows {1e3 * (again - top) / record.rate:.1f} ms later"
        return Hit(number + 1, peak, fact)
    return Hit(number + 1, peak)


def _noise(signal: FloatArray) -> float:
    """Return the standard deviation of a signal's noise, by the median of what is mostly quiet."""
    return float(1.4826 * np.median(np.abs(signal - np.median(signal))))


def _second_pulse(force: FloatArray, top: int, level: float) -> int | None:
    """Return where a second pulse has its top, none where there is none; the first one has to have ended in between.

    The filter of a data logger rings after a short contact: each swing is smaller than the one to the other side before it. A further hit
    pushes the force up by more than it swung down before.
    """
    after = np.flatnonzero(force[top:] < level)
    before = np.flatnonzero(force[: top + 1] < level)
    if not len(after) or not len(before):
        return None
    end, begin = top + int(after[0]), int(before[-1])
    rest = force[end:].copy()
    early = force[:begin]
    swings = [0, *(np.flatnonzero(np.diff(np.signbit(rest))) + 1).tolist(), len(rest)]
    highest = [(int(np.argmax(np.abs(rest[a:b]))) + a) for a, b in itertools.pairwise(swings) if b > a]
    for before_it, at in itertools.pairwise([0, *highest]):
        if rest[at] > max(level, -rest[before_it]):
            return end + at
    return int(np.argmax(early)) if len(early) and early.max() > level else None


def _pulse(force: FloatArray) -> tuple[int, int]:
    """Return where the pulse and the ringing of its filter begin and end."""
    noise = _noise(force)
    top = int(np.argmax(force))
    loud = np.flatnonzero(np.abs(force) > max(6.0 * noise, 1e-5 * force[top]))
    around = loud[np.abs(loud - top) < max(64, int(0.02 * len(force)))]
    return max(0, int(around[0]) - _MARGIN), min(len(force), int(around[-1]) + 1 + _MARGIN)


def _lead(forces: FloatArray, pulses: list[tuple[int, int]]) -> float:
    """Return how many samples before the middle of its pulse each hit is kept from, in the mean."""
    places = np.arange(forces.shape[1])
    middles = [float(places @ row) / float(row.sum()) for row in forces]
    return float(np.mean([middle - begin for middle, (begin, _) in zip(middles, pulses, strict=True)]))


def _zero(record: TapRecord, good: list[int]) -> FloatArray:
    """Return the mean of each response before its hit."""
    found = []
    for at in good:
        top = int(np.argmax(record.force[at]))
        quiet = record.response[at, : max(0, top - 16)]
        found.append(float(quiet.mean()) if len(quiet) >= 16 else 0.0)
    return np.array(found)


def _window_rate(record: TapRecord, good: list[int]) -> float:
    """Return the rate of the exponential window [1/s]; 0 where all responses have died out at the end of their records."""
    count = record.force.shape[1]
    tail = max(16, count // 20)
    duration = count / record.rate
    needed = 0.0
    for at in good:
        top = int(np.argmax(record.force[at]))
        answer = record.response[at]
        quiet = answer[: max(0, top - 16)]
        noise = float(quiet.std()) if len(quiet) >= 16 else 1e-6 * float(np.abs(answer).max())
        end = float(answer[-tail:].std())
        largest = float(np.abs(answer).max())
        if end > _DIED_OUT * noise and end > _LEFT_AT_END * largest:
            needed = max(needed, math.log(end / max(noise, _LEFT_AT_END * largest)) / duration)
    return needed
