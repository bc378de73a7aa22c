"""The half section of the part being turned, drawn in characters: material, paths and tool over the spindle's axis."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from lathesim.record import FloatArray
from lathesim.tui.drawing.axis_ticks import axis_ticks
from lathesim.tui.drawing.braille import BRAILLE, braille_codes, trace
from lathesim.tui.drawing.lathe_scene import LatheScene, Motion

NOTHING, REFERENCE, ACTUAL, TOOL, LABEL, EDGE = range(6)
"""What a character belongs to; where several meet, the tool stands in front of the actual path and that in front of the reference."""
_EIGHTHS = " ▁▂▃▄▅▆▇"
_DASH = (3, 3)
_MARGIN = 0.03
_TOOL_DOTS = 14
_MOST_POINTS = 20_000
_ROWS_A_TICK, _COLUMNS_A_TICK = 4, 14
"""Rows and columns of the picture for each mark of a scale."""
_Z_LABEL = " Z [mm]"
_SHARE_OF_PAIR = 0.6
"""Share of a zoomed picture that the drawn tip and its reference may take up between them."""

Cells = np.ndarray[Any, Any]


@dataclass(frozen=True)
class View:
    """How to look: ``gain`` magnifies the error, ``zoom`` [m] is the width shown around the tip (0 shows all), X as radius or diameter."""

    gain: float = 1.0
    zoom: float = 0.0
    as_diameter: bool = False


@dataclass(frozen=True)
class Picture:
    """Characters (rows, columns), what each belongs to, where there is material, and the size of a dot [m]."""

    text: Cells
    layer: Cells
    material: Cells
    dot: float

    def as_text(self) -> str:
        """Return the picture without colour: material is shown as ``█`` where no other character stands."""
        shown = np.where(self.material & (self.text == " "), "█", self.text)
        return "\n".join("".join(row).rstrip() for row in shown)


def draw(scene: LatheScene, motion: Motion | None, until: int, columns: int, rows: int, view: View | None = None) -> Picture:
    """Return the picture after ``until`` samples, ``columns`` by ``rows`` characters; a dot is as wide as it is high.

    With a gain above 1 the actual path is drawn at reference + gain x (actual - reference); the stock stays as it is.
    """
    view = view or View()
    until = min(until, len(motion)) if motion is not None else 0
    frame = _frame(scene, motion, until, columns, rows, view)
    reference, actual, tool = (np.zeros((4 * rows, 2 * columns), dtype=bool) for _ in range(3))
    trace(reference, *frame.dots(scene.path_z, scene.path_x), dash=_DASH)
    material, height = _material(scene, motion, until, frame, columns, rows)
    if motion is not None and until:
        stride = max(1, until // _MOST_POINTS)
        taken = np.append(np.arange(0, until - 1, stride), until - 1)
        x, z = motion.x[taken], motion.z[taken]
        if view.gain > 1.0:
            x = motion.x_reference[taken] + view.gain * (x - motion.x_reference[taken])
            z = motion.z_reference[taken] + view.gain * (z - motion.z_reference[taken])
        trace(actual, *frame.dots(z, x))
        _draw_tool(tool, *(float(item[-1]) for item in frame.dots(z[-1:], x[-1:])))
    text, layer = _edges(material, height)
    for dots, number in ((reference, REFERENCE), (actual, ACTUAL), (tool, TOOL)):
        codes = braille_codes(dots)
        there = codes > 0
        text[there] = (codes[there].astype(np.int32) + BRAILLE).view("<U1") if there.any() else text[there]
        layer[there] = number
        material |= there & (height >= 0.5)
    _label(text, layer, frame, rows, view)
    return Picture(text, layer, material, frame.dot)


@dataclass(frozen=True)
class _Frame:
    """Where the picture lies: the place of its lower left corner and the size of a dot [m]."""

    z: float
    x: float
    dot: float

    def dots(self, z: Any, x: Any) -> tuple[Any, Any]:
        return (np.asarray(z) - self.z) / self.dot, (np.asarray(x) - self.x) / self.dot


def _frame(scene: LatheScene, motion: Motion | None, until: int, columns: int, rows: int, view: View) -> _Frame:
    wide, high = 2.0 * columns, 4.0 * rows
    if view.zoom > 0.0 and motion is not None and until:
        return _near_the_tip(motion, until - 1, wide, high, view)
    z_low, z_high, x_low, x_high = scene.bounds()
    margin = _MARGIN * max(z_high - z_low, x_high - x_low, 1e-6)
    z_low, z_high, x_high = z_low - margin, z_high + margin, x_high + 2.0 * margin
    x_low = x_low - margin if x_low < 0.0 else 0.0
    dot = max((z_high - z_low) / wide, (x_high - x_low) / high)
    return _Frame(z_low - 0.5 * (wide * dot - (z_high - z_low)), x_low, dot)


def _near_the_tip(motion: Motion, sample: int, wide: float, high: float, view: View) -> _Frame:
    """Return a frame about the tip as it is drawn and its reference, as wide as the zoom or as both need."""
    here, there = (float(motion.z[sample]), float(motion.x[sample])), (float(motion.z_reference[sample]), float(motion.x_reference[sample]))
    if view.gain == 1.0 or not all(map(math.isfinite, there)):
        there = here
    apart = [view.gain * (actual - reference) for actual, reference in zip(here, there, strict=True)]
    dot = max(view.zoom / wide, abs(apart[0]) / (_SHARE_OF_PAIR * wide), abs(apart[1]) / (_SHARE_OF_PAIR * high))
    z, x = (reference + 0.5 * gap for reference, gap in zip(there, apart, strict=True))
    return _Frame(z - 0.5 * dot * wide, x - 0.5 * dot * high, dot)


def _material(scene: LatheScene, motion: Motion | None, until: int, frame: _Frame, columns: int, rows: int) -> tuple[Cells, Cells]:
    """Return where material fills a character wholly, and how high it stands in each (0 to 1)."""
    if scene.carved is None:
        return np.zeros((rows, columns), dtype=bool), np.zeros((rows, columns))
    if motion is not None:
        scene.carved.cut(motion.x, motion.z, until)
    places: FloatArray = frame.z + (np.arange(columns, dtype=np.float64) + 0.5) * 2.0 * frame.dot
    top = (scene.carved.at(places) - frame.x) / (4.0 * frame.dot)
    bottom = -frame.x / (4.0 * frame.dot)
    up = np.arange(rows)[::-1, None]
    height = np.clip(top[None, :] - up, 0.0, 1.0)
    height = np.where((up + 1.0 <= bottom) | (top[None, :] <= bottom), 0.0, height)
    return height >= 15.0 / 16.0, height


def _edges(material: Cells, height: Cells) -> tuple[Cells, Cells]:
    """Return the characters at the surface, filled in eighths, and which those are."""
    eighths = np.where(material, 0, np.floor(height * 8.0 + 0.5).astype(int))
    text = np.array(list(_EIGHTHS))[np.clip(eighths, 0, 7)]
    return text, np.where(eighths > 0, EDGE, NOTHING)


def _draw_tool(dots: Cells, z: float, x: float) -> None:
    """Set the dots of the tool: a wedge whose tip stands at (z, x) in dots."""
    height, width = dots.shape
    for up in range(_TOOL_DOTS):
        row = height - 1 - (int(np.floor(x)) + up)
        first = int(np.floor(z))
        last = first + up // 2 + 1
        if 0 <= row < height:
            dots[row, max(first, 0) : max(min(last, width), 0)] = True


def _label(text: Cells, layer: Cells, frame: _Frame, rows: int, view: View) -> None:
    """Write the scales: X up the left edge, Z along the bottom."""
    factor, name = (2.0, "Ø") if view.as_diameter else (1.0, "R")
    columns = text.shape[1]
    wide, high = 2.0 * frame.dot * 1e3, 4.0 * frame.dot * factor * 1e3
    left, bottom = frame.z * 1e3, frame.x * factor * 1e3
    _write(text, layer, 0, 0, f"X {name} [mm]")
    for tick, label in zip(*axis_ticks(bottom, bottom + rows * high, max(1, rows // _ROWS_A_TICK)), strict=True):
        row = rows - 1 - int((tick - bottom) / high)
        if 0 < row < rows - 1:
            _write(text, layer, row, 0, f"{label}╴")
    end = columns - len(_Z_LABEL)
    _write(text, layer, rows - 1, end, _Z_LABEL)
    for tick, label in zip(*axis_ticks(left, left + columns * wide, max(1, columns // _COLUMNS_A_TICK)), strict=True):
        column = int((tick - left) / wide) - (len(label) - 1) // 2
        if column >= 0 and column + len(label) < end:
            _write(text, layer, rows - 1, column, label)


def _write(text: Cells, layer: Cells, row: int, column: int, words: str) -> None:
    """Write words where they find room."""
    if 0 <= row < text.shape[0] and column >= 0 and column + len(words) <= text.shape[1]:
        text[row, column : column + len(words)] = list(words)
        layer[row, column : column + len(words)] = LABEL
