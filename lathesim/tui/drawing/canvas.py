"""Pictures of characters: braille dots, what each character belongs to, the ticks of axes, and the waves on a part."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from lathesim.analysis.display_unit import pretty_quantities
from lathesim.units import from_si, in_unit

if TYPE_CHECKING:
    from lathesim.analysis.turned_part import Waves

Dots = np.ndarray[Any, np.dtype[np.bool_]]
Codes = np.ndarray[Any, np.dtype[np.uint8]]
Cells = np.ndarray[Any, Any]

NOTHING, REFERENCE, ACTUAL, TOOL, LABEL, EDGE, CUT, CENTRE, CHUCK = range(9)
"""What a character belongs to; where several meet, the tool stands in front of the actual path and that in front of the reference."""

_WEIGHTS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]], dtype=np.uint8)
BRAILLE = 0x2800
"""The first braille character, the one without dots."""
_FEWEST = 3
"""Rows below which an axis has no marks."""


def braille_codes(dots: Dots) -> Codes:
    """Return for each character (rows, columns) the sum of its dots' weights, from dots of shape (4 rows, 2 columns); 0 has no dot."""
    rows, columns = dots.shape[0] // 4, dots.shape[1] // 2
    codes: Codes = (dots.reshape(rows, 4, columns, 2).transpose(0, 2, 1, 3) * _WEIGHTS).sum(axis=(2, 3), dtype=np.uint8)
    return codes


def stepped(steps: Any, *courses: Any) -> list[Any]:
    """Return courses (points,) that run straight from each point to the next in so many ``steps`` (points - 1,)."""
    index = np.repeat(np.arange(len(steps)), steps)
    share = (np.arange(len(index)) - np.repeat(np.cumsum(steps) - steps, steps) + 1) / steps[index] if len(index) else np.empty(0)
    return [np.append(course[0], course[index] + share * np.diff(course)[index]) for course in courses]


def trace(dots: Dots, x: Any, y: Any, *, dash: tuple[int, ...] = (1, 0)) -> None:
    """Set the dots along a polyline, x to the right and y upwards in dots from the lower left corner.

    ``dash`` is how many dots are set and how many are left out in turn; (1, 0) leaves out none.
    """
    x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    usable = np.isfinite(x) & np.isfinite(y)
    x, y = x[usable], y[usable]
    if not len(x):
        return
    height, width = dots.shape
    x, y = np.clip(x, -4.0, width + 4.0), np.clip(y, -4.0, height + 4.0)
    steps = np.maximum(np.ceil(np.maximum(np.abs(np.diff(x)), np.abs(np.diff(y)))).astype(int), 1)
    columns, up = (np.floor(course).astype(int) for course in stepped(steps, x, y))
    rows = height - 1 - up
    if dash[1]:
        moved = np.append(True, (np.diff(columns) != 0) | (np.diff(rows) != 0))
        pattern = np.repeat([place % 2 == 0 for place in range(len(dash))], dash)
        drawn = pattern[(np.cumsum(moved) - 1) % len(pattern)]
        columns, rows = columns[drawn], rows[drawn]
    inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
    dots[rows[inside], columns[inside]] = True


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
    power = math.floor(math.log10(span / most))
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
    if not math.isfinite(span) or span <= 0.0 or rows < _FEWEST:
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


@dataclass(frozen=True)
class LathePicture:
    """Characters (rows, columns), what each belongs to, where there is material, and the size of a dot [m]."""

    text: Cells
    layer: Cells
    material: Cells
    dot: float

    def as_text(self) -> str:
        """Return the picture without colour: material is shown as ``█`` where no other character stands."""
        return "\n".join("".join(row).rstrip() for row in np.where(self.material & (self.text == " "), "█", self.text))


def write(text: Cells, layer: Cells, row: int, column: int, words: str) -> None:
    """Write words where they find room."""
    if 0 <= row < text.shape[0] and column >= 0 and column + len(words) <= text.shape[1]:
        text[row, column : column + len(words)] = list(words)
        layer[row, column : column + len(words)] = LABEL


_RADIUS = 0.38
"""Radius of the circle over the height of the picture."""
_LARGEST = 0.09
"""Waves are magnified until the largest is this share of the height; of a cut without chatter by no more than so many dots a micrometre."""
_DOTS_A_MICROMETRE = 2.0


def draw_waves(waves: Waves, columns: int, rows: int) -> LathePicture:
    """Return the end of the part, ``columns`` by ``rows`` characters; ``dot`` is the height of a wave that moves the line by a dot [m]."""
    height, width = 4 * rows, 2 * columns
    size = min(height, width)
    deviation = waves.height[-1] - waves.height[-1].mean()
    largest = float(np.abs(deviation).max())
    gain = min(_LARGEST * size / largest, from_si(_DOTS_A_MICROMETRE, "um")) if largest > 0.0 else 0.0
    text, layer = np.full((rows, columns), " "), np.full((rows, columns), NOTHING)
    angle = np.append(waves.angle, waves.angle[0])
    circle = np.full(len(angle), _RADIUS * size)
    # a higher surface is one that the tool cut less deep: it stands out
    seen = circle + gain * np.append(deviation, deviation[0])
    for radius, kind, dash in ((circle, REFERENCE, (1, 2)), (seen, ACTUAL, (1, 0))):
        dots = np.zeros((height, width), dtype=np.bool_)
        trace(dots, 0.5 * width + radius * np.cos(angle), 0.5 * height + radius * np.sin(angle), dash=dash)
        codes = braille_codes(dots)
        drawn = codes > 0
        text[drawn] = [chr(BRAILLE + int(code)) for code in codes[drawn]]
        layer[drawn] = kind
    words = f" R_a {pretty_quantities(in_unit(waves.roughness, 'um', '.3g'))} "
    if columns > len(words) and rows > 2:
        write(text, layer, rows // 2, (columns - len(words)) // 2, words)
    return LathePicture(text, layer, np.zeros((rows, columns), dtype=np.bool_), 1.0 / gain if gain > 0.0 else 0.0)
