"""The anti-aliasing filter of a channel: low-pass of fourth order after Butterworth, as two halves of second order."""

from __future__ import annotations

import math

_NARROW, _WIDE = 0.3826834323650898, 0.9238795325112867
"""Damping ratios of the two pairs of poles of a Butterworth filter of fourth order: the sines of 22.5 and 67.5 degrees."""


def low_passed(
    measured: float, bandwidth: float, first: float, first_rate: float, second: float, second_rate: float
) -> tuple[float, float, float, float]:
    """Return the derivatives of both halves and their rates; ``bandwidth`` is the corner frequency [Hz]."""
    w = 2.0 * math.pi * bandwidth
    return (
        first_rate,
        w * (w * (measured - first) - 2.0 * _WIDE * first_rate),
        second_rate,
        w * (w * (first - second) - 2.0 * _NARROW * second_rate),
    )


def clipped_with_noise(second: float, noise: float, range: float, chance: float) -> float:
    """Return the filter's output with its noise, clipped at the range of the channel."""
    reading = second + noise * chance
    return min(max(reading, -range), range)
