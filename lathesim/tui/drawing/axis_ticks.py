"""Places and labels of the marks along an axis."""

from __future__ import annotations

import math

_STEPS = (1.0, 2.0, 5.0, 10.0)
_APART = (2, 3, 4, 5, 6)
"""Rows from mark to mark."""
_FEW = 8


def axis_ticks(low: float, high: float, most: int) -> tuple[list[float], list[str]]:
    """Return at most ``most`` marks from ``low`` to ``high`` at steps of 1, 2 or 5 times a power of ten, and their labels.

    All labels have the same number of decimals, as few as tell the marks apart.
    """
    span = high - low
    if not math.isfinite(span) or span <= 0.0 or most < 1:
        return [], []
    rough = span / most
    power = math.floor(math.log10(rough))
    for factor in (*_STEPS, 20.0):
        step = factor * 10.0**power
        first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
        if last - first + 1 <= most:
            break
    ticks = [place * step for place in range(first, last + 1)]
    return ticks, labels_of(ticks)


def labels_of(ticks: list[float]) -> list[str]:
    """Return the labels of marks, all with the same number of decimals, as few as tell the marks apart."""
    step = ticks[1] - ticks[0] if len(ticks) > 1 else abs(ticks[0]) if ticks and ticks[0] else 1.0
    decimals = max(0, -math.floor(math.log10(step) + 1e-9))
    return [f"{tick:.{decimals}f}" if tick else f"{0.0:.{decimals}f}" for tick in ticks]


def even_axis(low: float, high: float, rows: int) -> tuple[float, float, list[float]]:
    """Return limits around ``low`` and ``high`` and marks that all lie a whole number of rows apart, each in the middle of its row.

    A plot has few rows: with any limits marks are rounded to rows, and look as if the axis were bent. The limits grow by a third at most.
    Fewer than 8 rows are too few for that: the limits stay, and marks are rounded.
    """
    span = high - low
    if not math.isfinite(span) or span <= 0.0 or rows < 3:
        return low, high, []
    if rows < _FEW:
        return low, high, axis_ticks(low, high, max(2, rows // 2))[0]
    power = math.floor(math.log10(span / rows))
    choices = sorted(
        (factor * 10.0**power * ten / apart, factor * 10.0**power * ten) for ten in (1, 10) for factor in _STEPS[:3] for apart in _APART
    )
    scale, step = next(choice for choice in choices if (_lowest_row(low, choice[0]) + rows - 0.5) * choice[0] >= high)
    below = _lowest_row(low, scale)
    spare = int(((below + rows - 0.5) * scale - high) / scale / 2.0)
    bottom, top = (below - spare - 0.5) * scale, (below - spare + rows - 0.5) * scale
    first, last = math.ceil(bottom / step), math.floor(top / step)
    return bottom, top, [place * step for place in range(first, last + 1)]


def _lowest_row(low: float, scale: float) -> int:
    return math.floor(low / scale + 0.5 + 1e-9)
