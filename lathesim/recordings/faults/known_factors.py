"""Factors that mistaken units leave behind, by name."""

from __future__ import annotations

import math

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
