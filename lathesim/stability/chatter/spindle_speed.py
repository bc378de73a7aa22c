"""The speed of the spindle, found better than it was told, from what repeats with it.

What repeats every turn stays in the mean of all turns, and only at the right speed. Only low orders are asked: near a high one any
vibration is a whole multiple of some speed close by. Source: P. D. McFadden, Mech. Syst. Signal Process. 1 (1987), averaging in step.
"""

from __future__ import annotations

import math

import numpy as np

from lathesim.record import FloatArray
from lathesim.stability.chatter.thresholds import LINES
from lathesim.stability.chatter.turn_memory import turn_shares

_ORDERS = 6.0
_PER_TURN = 24
"""Values of a turn after the low pass, for so many orders."""


def refined_speed(values: FloatArray, rate: float, turning: float) -> float:
    """Return the revolutions a second near ``turning`` at which most power repeats every turn, or every second turn with the sign changed;
    the given one where none stands out."""
    low, slow = _low_orders(values, rate, turning)
    turns = len(low) * turning / slow
    if turns < 4.0:
        return turning
    # at the highest order the ends of the record are out of step by a quarter of a vibration between two trials
    step = 0.25 / (_ORDERS * turns)
    count = max(1, math.ceil(LINES.speed_reach / step))
    trials = turning * (1.0 + LINES.speed_reach * np.arange(-count, count + 1) / count)
    shares = [min(sum(turn_shares(low, slow, float(trial))), 1.0 - 1e-9) for trial in trials]
    best = int(np.argmax(shares))
    gained = 0.5 * turns * math.log((1.0 - shares[count]) / (1.0 - shares[best]))
    return float(trials[best]) if gained > LINES.speed_sure else turning


def _low_orders(values: FloatArray, rate: float, turning: float) -> tuple[FloatArray, float]:
    """Return a signal of low orders alone, and its sample rate."""
    slow = _PER_TURN * turning
    if slow >= rate:
        return values, rate
    spectrum = np.fft.rfft(values)
    spectrum[np.fft.rfftfreq(len(values), 1.0 / rate) > (_ORDERS + 0.5) * turning] = 0.0
    low = np.fft.irfft(spectrum, len(values))
    count = int(len(values) * slow / rate)
    return np.interp(np.arange(count) * rate / slow, np.arange(len(values)), low), slow
