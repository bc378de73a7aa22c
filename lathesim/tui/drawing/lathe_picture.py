"""The lathe as a picture of braille dots: the stock as it is cut, chuck and centre line, the path asked for, and the motion of the tool."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from lathesim.analysis.failed_run import RawStock
from lathesim.analysis.metric import find_channel
from lathesim.record import FloatArray, Record
from lathesim.tui.drawing.canvas import (
    ACTUAL,
    BRAILLE,
    CENTRE,
    CHUCK,
    CUT,
    EDGE,
    NOTHING,
    REFERENCE,
    TOOL,
    Cells,
    LathePicture,
    axis_ticks,
    braille_codes,
    stepped,
    trace,
    write,
)
from lathesim.units import from_si

if TYPE_CHECKING:
    from lathesim.lessons.simulate import Prepared


_CELLS = 2000
_HALF_FULL = 0.5
"""Share of a character from which it counts as material."""


class CarvedStock:
    """Radius over z of a stock that is cut sample by sample; it may be followed forwards, and backwards from the start again.

    The rules are those of :class:`lathesim.components.stock.Stock`. The tip runs straight from sample to sample, rapid or not, and
    every cell it passes is cut to its radius. Feeding towards the axis, the edge takes along what stands towards the free end. Left out:
    the nose.
    """

    def __init__(self, stock: RawStock) -> None:
        self.stock = stock
        self.radius: FloatArray = np.full(_CELLS, stock.stock_radius)
        self._cell = stock.stock_length / _CELLS
        self._done = 0

    def cut(self, x: FloatArray, z: FloatArray, until: int) -> FloatArray:
        """Return the radius [m] (cells,) after the first ``until`` samples of the tip's radius and place, x and z [m]."""
        if until < self._done:
            self.radius = np.full(_CELLS, self.stock.stock_radius)
            self._done = 0
        if until > self._done:
            begin = max(0, self._done - 1)
            self._carve(x[begin:until], z[begin:until])
            self._done = until
        return self.radius

    def at(self, z: FloatArray) -> FloatArray:
        """Return the radius at places z [m]: the smallest between neighbouring places, 0 outside the stock."""
        edges = (np.asarray(z) - self.stock.face) / self._cell
        half = 0.5 * (edges[1] - edges[0]) if len(edges) > 1 else 0.5
        first = np.floor(edges - half).astype(int)
        last = np.maximum(np.ceil(edges + half).astype(int), first + 1)
        radius = np.zeros(len(edges))
        for place in np.flatnonzero((edges >= 0.0) & (edges <= _CELLS)):
            part = self.radius[max(first[place], 0) : min(last[place], _CELLS)]
            radius[place] = part.min() if len(part) else 0.0
        return radius

    def _carve(self, x: FloatArray, z: FloatArray) -> None:
        usable = np.isfinite(x) & np.isfinite(z)
        x, z = x[usable], z[usable]
        if not len(x):
            return
        places = np.clip((z - self.stock.face) / self._cell, -1.0, _CELLS + 1.0)
        along, height = stepped(np.maximum(np.ceil(np.abs(np.diff(places))).astype(int), 1), places, x)
        cells = np.floor(along).astype(int)
        touched = (cells >= 0) & (cells < _CELLS) & (height < self.stock.stock_radius)
        np.minimum.at(self.radius, cells[touched], np.maximum(height[touched], 0.0))
        self._carve_beside(x, z, places)

    def _carve_beside(self, x: FloatArray, z: FloatArray, places: FloatArray) -> None:
        """Let the edge take along what stands between the tip and the free end while it feeds towards the axis."""
        edge = int(self.stock.edge_length / self._cell)
        if edge <= 0 or len(x) < 2:
            return
        side = -1 if self.stock.free_end < 0.0 else 1
        for sample in np.flatnonzero((np.diff(x) < 0.0) & (-np.diff(x) > np.abs(np.diff(z)))) + 1:
            cell = int(places[sample])
            if 0 <= cell < _CELLS and x[sample] < self.stock.stock_radius:
                first, last = (cell - edge, cell) if side < 0 else (cell + 1, cell + 1 + edge)
                beside = self.radius[max(first, 0) : min(last, _CELLS)]
                np.minimum(beside, max(x[sample], 0.0), out=beside)


_ARC_POINTS = 32
_NEAR = 0.5
"""Share of the length of the stock, beyond its ends, within which the path is always shown; across it is twice as much of the radius."""
MOST_POINTS = 20_000
_CHUCK_WIDTH, _CHUCK_RADIUS = 0.08, 1.3
"""Of the chuck as it is drawn, over the length and the radius of the stock."""


@dataclass
class LatheScene:
    """A stock, if there is one, and the path asked for: ``path_x`` (a radius) and ``path_z`` [m]."""

    stock: RawStock | None
    path_x: FloatArray
    path_z: FloatArray
    record: Record | None = None
    """A record of a cut in the loop, whose waves on the part are shown where there is no path."""
    carved: CarvedStock | None = field(init=False)

    def __post_init__(self) -> None:
        self.carved = CarvedStock(self.stock) if self.stock is not None else None

    @property
    def is_empty(self) -> bool:
        """Whether there is nothing to show."""
        return self.stock is None and not len(self.path_x)

    @property
    def _chuck(self) -> tuple[float, float, float]:
        """The ends of the chuck along z, and its radius [m]; it holds the stock at the end that is not free. Its size is assumed."""
        assert self.stock is not None
        length = self.stock.stock_length
        first = self.stock.face + (length if self.stock.free_end < 0.0 else -_CHUCK_WIDTH * length)
        return first, first + _CHUCK_WIDTH * length, _CHUCK_RADIUS * self.stock.stock_radius

    def chuck(self, z: FloatArray, x: FloatArray) -> Cells:
        """Return where places z (columns,) and heights x (rows,) [m] lie in the chuck, (rows, columns)."""
        if self.stock is None:
            return np.zeros((len(x), len(z)), dtype=bool)
        first, last, radius = self._chuck
        found: Cells = (z > first) & (z < last) & (x[:, None] > 0.0) & (x[:, None] < radius)
        return found

    def bounds(self) -> tuple[float, float, float, float]:
        """Return the smallest and largest z and the smallest and largest x [m] of stock and path; the axis of the spindle is inside.

        Of a path that comes from far away only what lies near the stock counts.
        """
        usable = np.isfinite(self.path_x) & np.isfinite(self.path_z)
        if self.stock is not None:
            length, radius = self.stock.stock_length, self.stock.stock_radius
            near = (self.path_z > self.stock.face - _NEAR * length) & (self.path_z < self.stock.face + (1.0 + _NEAR) * length)
            usable &= near & (np.abs(self.path_x) < (1.0 + 2.0 * _NEAR) * radius)
        z = [*self.path_z[usable]]
        x = [0.0, *self.path_x[usable]]
        if self.stock is not None:
            z += [self.stock.face, self.stock.face + self.stock.stock_length, *self._chuck[:2]]
            x.append(self._chuck[2])
        return (min(z), max(z), min(x), max(x)) if z else (0.0, 1.0, 0.0, 1.0)


@dataclass(frozen=True)
class ToolMotion:
    """What was recorded of the tool up to a sample: actual and reference radius and place [m], each (samples,)."""

    x: FloatArray
    z: FloatArray
    x_reference: FloatArray
    z_reference: FloatArray

    @classmethod
    def of(cls, record: Record) -> ToolMotion | None:
        """Return the motion in a record, or None where it has no two axes."""
        stock = RawStock.of(record)
        x = stock.x if stock is not None else find_channel(record, "x_axis.position", "x_position")
        z = stock.z if stock is not None else find_channel(record, "z_axis.position", "z_position")
        if x is None or z is None:
            return None
        x_reference, z_reference = find_channel(record, "x_reference"), find_channel(record, "z_reference")
        if x_reference is None or z_reference is None:
            return cls(record[x], record[z], record[x], record[z])
        return cls(record[x], record[z], record[x_reference], record[z_reference])

    def __len__(self) -> int:
        return len(self.x)


def scene_of_case(case: Prepared) -> LatheScene:
    """Return the scene before a run: the raw stock and the programmed path."""
    from lathesim.lessons.program_path import raw_stock
    from lathesim.path_columns import ARC_MOVE, CENTRE_X, CENTRE_Z, END_X, END_Z, KIND, RADIUS, START_ANGLE, START_X, START_Z, SWEEP

    table = next((part.tables["path"] for part in case.machinery.parts if "path" in part.tables), None)
    if table is None:
        return LatheScene(raw_stock(case.plan), np.empty(0), np.empty(0))
    x, z = [table[:1, START_X]], [table[:1, START_Z]]
    for row in table:
        if row[KIND] == ARC_MOVE:
            angle = row[START_ANGLE] + row[SWEEP] * np.linspace(0.0, 1.0, _ARC_POINTS)
            x.append(row[CENTRE_X] + row[RADIUS] * np.sin(angle))
            z.append(row[CENTRE_Z] + row[RADIUS] * np.cos(angle))
        else:
            x.append(row[[END_X]])
            z.append(row[[END_Z]])
    return LatheScene(raw_stock(case.plan), np.concatenate(x), np.concatenate(z))


def scene_of_record(record: Record) -> LatheScene:
    """Return the scene of a record: the stock it names and the reference it followed."""
    motion = ToolMotion.of(record)
    if motion is None:
        has_waves = find_channel(record, "wave") is not None and find_channel(record, "angle") is not None
        return LatheScene(None, np.empty(0), np.empty(0), record if has_waves else None)
    stride = max(1, len(motion) // MOST_POINTS)
    return LatheScene(RawStock.of(record), motion.x_reference[::stride], motion.z_reference[::stride])


_EIGHTHS = " ▁▂▃▄▅▆▇"
_DASH, _CENTRE_DASH = (3, 3), (9, 3, 1, 3)
_FULL, _CHUCK_SIGN = 0xFF, "▒"
_MARGIN = 0.03
_SCALE = 4.0
"""Dots below the picture that the marks along Z take up."""
_TOOL_DOTS = 14
_ROWS_A_TICK, _COLUMNS_A_TICK = 3, 14
"""Rows and columns of the picture for each mark of a scale."""
_Z_LABEL = " Z [mm]"
_SHARE_OF_PAIR = 0.6
"""Share of a zoomed picture that the drawn tip and its reference may take up between them."""


@dataclass(frozen=True)
class View:
    """How to look: ``gain`` magnifies the error, ``zoom`` [m] is the width shown around the tip (0 shows all), X as radius or diameter."""

    gain: float = 1.0
    zoom: float = 0.0
    as_diameter: bool = False


def draw(scene: LatheScene, motion: ToolMotion | None, until: int, columns: int, rows: int, view: View | None = None) -> LathePicture:
    """Return the picture after ``until`` samples, ``columns`` by ``rows`` characters; a dot is as wide as it is high.

    With a gain above 1 the actual path is drawn at reference + gain x (actual - reference); the stock stays as it is.
    """
    view = view or View()
    until = min(until, len(motion)) if motion is not None else 0
    frame = _frame(scene, motion, until, columns, rows, view)
    reference, centre, actual, tool = (np.zeros((4 * rows, 2 * columns), dtype=bool) for _ in range(4))
    trace(reference, *frame.dots(scene.path_z, scene.path_x), dash=_DASH)
    if scene.stock is not None:
        trace(centre, [0.0, 2.0 * columns], np.full(2, frame.dots(0.0, 0.0)[1]), dash=_CENTRE_DASH)
    material, height = _material(scene, motion, until, frame, columns, rows)
    if motion is not None and until:
        taken = np.append(np.arange(0, until - 1, max(1, until // MOST_POINTS)), until - 1)
        x, z = motion.x[taken], motion.z[taken]
        if view.gain > 1.0:
            x = motion.x_reference[taken] + view.gain * (x - motion.x_reference[taken])
            z = motion.z_reference[taken] + view.gain * (z - motion.z_reference[taken])
        trace(actual, *frame.dots(z, x))
        _draw_tool(tool, *(float(item[-1]) for item in frame.dots(z[-1:], x[-1:])))
    text, layer = _edges(material, height)
    surface = layer == EDGE
    along, up = np.arange(columns, dtype=np.float64), np.arange(rows, dtype=np.float64)[::-1]
    held = scene.chuck(frame.z + (along + 0.5) * 2.0 * frame.dot, frame.x + (up + 0.5) * 4.0 * frame.dot)
    text[held], layer[held] = _CHUCK_SIGN, CHUCK
    for dots, number in ((reference, REFERENCE), (centre, CENTRE), (actual, ACTUAL), (tool, TOOL)):
        codes = braille_codes(dots)
        there = codes > 0
        signs = np.where(codes == _FULL, "█", (codes.astype(np.int32) + BRAILLE).view("<U1"))
        if number == CENTRE:
            there &= ~held
        if number == REFERENCE or (number == ACTUAL and view.gain == 1.0):
            # the surface keeps its height, which a character of dots cannot show; where it was cut it is the actual path
            layer[there & surface] = CUT if number == ACTUAL else EDGE
            there &= ~surface
        text[there] = signs[there]
        layer[there] = number
        material |= there & (height >= _HALF_FULL)
    _label(text, layer, frame, rows, view)
    return LathePicture(text, layer, material, frame.dot)


@dataclass(frozen=True)
class _Frame:
    """Where the picture lies: the place of its lower left corner and the size of a dot [m]."""

    z: float
    x: float
    dot: float

    def dots(self, z: Any, x: Any) -> tuple[Any, Any]:
        return (np.asarray(z) - self.z) / self.dot, (np.asarray(x) - self.x) / self.dot


def _frame(scene: LatheScene, motion: ToolMotion | None, until: int, columns: int, rows: int, view: View) -> _Frame:
    wide, high = 2.0 * columns, 4.0 * rows
    if view.zoom > 0.0 and motion is not None and until:
        return _near_the_tip(motion, until - 1, wide, high, view)
    z_low, z_high, x_low, x_high = scene.bounds()
    margin = _MARGIN * max(z_high - z_low, x_high - x_low, 1e-6)
    z_low, z_high, x_high = z_low - margin, z_high + margin, x_high + 2.0 * margin
    x_low = x_low - margin if x_low < 0.0 else 0.0
    dot = max((z_high - z_low) / wide, (x_high - x_low) / max(high - _SCALE, 1.0))
    if scene.stock is not None and x_low == 0.0 and scene.stock.stock_radius >= 4.0 * dot:
        # the raw surface falls between two rows, so that no path near it shares a row with it
        dot = scene.stock.stock_radius / (4.0 * math.floor(scene.stock.stock_radius / (4.0 * dot)))
    return _Frame(z_low - 0.5 * (wide * dot - (z_high - z_low)), x_low - _SCALE * dot, dot)


def _near_the_tip(motion: ToolMotion, sample: int, wide: float, high: float, view: View) -> _Frame:
    """Return a frame about the tip as it is drawn and its reference, as wide as the zoom or as both need."""
    here, there = (float(motion.z[sample]), float(motion.x[sample])), (float(motion.z_reference[sample]), float(motion.x_reference[sample]))
    if view.gain == 1.0 or not all(map(math.isfinite, there)):
        there = here
    apart = [view.gain * (actual - reference) for actual, reference in zip(here, there, strict=True)]
    dot = max(view.zoom / wide, abs(apart[0]) / (_SHARE_OF_PAIR * wide), abs(apart[1]) / (_SHARE_OF_PAIR * high))
    z, x = (reference + 0.5 * gap for reference, gap in zip(there, apart, strict=True))
    return _Frame(z - 0.5 * dot * wide, x - 0.5 * dot * high, dot)


def _material(scene: LatheScene, motion: ToolMotion | None, until: int, frame: _Frame, columns: int, rows: int) -> tuple[Cells, Cells]:
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
    return np.array(list(_EIGHTHS))[np.clip(eighths, 0, 7)], np.where(eighths > 0, EDGE, NOTHING)


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
    wide, high = from_si(2.0 * frame.dot, "mm"), from_si(4.0 * frame.dot * factor, "mm")
    left, bottom = from_si(frame.z, "mm"), from_si(frame.x * factor, "mm")
    write(text, layer, 0, 0, f"X {name} [mm]")
    for tick, label in zip(*axis_ticks(bottom, bottom + rows * high, max(1, rows // _ROWS_A_TICK)), strict=True):
        row = rows - 1 - int((tick - bottom) / high)
        if 0 < row < rows - 1:
            write(text, layer, row, 0, f"{label}╴")
    end = columns - len(_Z_LABEL)
    write(text, layer, rows - 1, end, _Z_LABEL)
    for tick, label in zip(*axis_ticks(left, left + columns * wide, max(1, columns // _COLUMNS_A_TICK)), strict=True):
        column = int((tick - left) / wide) - (len(label) - 1) // 2
        if column >= 0 and column + len(label) < end:
            write(text, layer, rows - 1, column, label)
