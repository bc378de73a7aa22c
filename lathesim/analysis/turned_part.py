"""The turned part as its record shows it: its shape, its surface, and the waves that chatter left."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from lathesim.analysis.figure_style import MEASURED, QUIET, SIMULATED, common_unit, dress, label, legend, new_figure
from lathesim.analysis.metric import MissingChannelError, NoValueError, find_channel, signal
from lathesim.component import ON
from lathesim.errors import RecordError
from lathesim.record import FloatArray, Record

_CELLS = 1500


@dataclass(frozen=True)
class PartShape:
    """Radius over z: ``stock_radius`` before, ``radius`` (cells,) after cutting, at the places ``z`` (cells,); all in metres."""

    z: FloatArray
    radius: FloatArray
    stock_radius: float


def part_shape(record: Record) -> PartShape | None:
    """Return the shape that the tip leaves, or None where the record does not tell what was cut.

    The tip runs straight from sample to sample; over each place the smallest radius it reached inside the stock counts. Left out: the
    nose radius, and material the tool never came near.
    """
    stock, inside = find_channel(record, "material_radius"), find_channel(record, "inside_stock")
    x, z = "x_axis.position", "z_axis.position"
    if stock is None or inside is None or x not in record or z not in record or len(record) < 2:
        return None
    within = record[inside] > ON
    stock_radius = float(record[stock].max())
    if stock_radius <= 0.0 or not within.any():
        return None
    places, radii = record[z], record[x]
    low, high = float(places[within].min()), float(places[within].max())
    if high <= low:
        return None
    cells = np.linspace(low, high, _CELLS)
    shape = np.full(_CELLS, stock_radius)
    width = cells[1] - cells[0]
    for begin in np.flatnonzero(within[:-1] | within[1:]):
        here, there = sorted(((places[begin], radii[begin]), (places[begin + 1], radii[begin + 1])))
        first, last = int(np.ceil((here[0] - low) / width)), int(np.floor((there[0] - low) / width))
        first, last = max(first, 0), min(last, _CELLS - 1)
        if first > last:
            continue
        passed = np.interp(cells[first : last + 1], (here[0], there[0]), (here[1], there[1]))
        shape[first : last + 1] = np.minimum(shape[first : last + 1], np.maximum(passed, 0.0))
    return PartShape(cells, shape, stock_radius)


_ROUGHNESS_CELLS = 600


@dataclass(frozen=True)
class Surface:
    """Roughness R_a over z, both in metres, (cells,); NaN where nothing was cut."""

    z: FloatArray
    roughness: FloatArray


def roughness_along(record: Record, cells: int = _ROUGHNESS_CELLS) -> Surface:
    """Return the average roughness the tool left at each place, the last cut counting.

    Between two samples in the cut the tool passes all cells from one z to the next. Raises :class:`RecordError` where the record has no
    roughness or no z position.
    """
    roughness, z = signal(record, "roughness"), signal(record, "z_axis.position")
    cut = roughness > 0.0
    if not cut.any():
        return Surface(np.zeros(0), np.zeros(0))
    low, high = float(z[cut].min()), float(z[cut].max())
    width = (high - low) / cells or 1.0
    left = np.full(cells, np.nan)
    places = np.clip(((z - low) / width).astype(int), 0, cells - 1)
    for sample in np.flatnonzero(cut):
        before = places[sample - 1] if sample and cut[sample - 1] else places[sample]
        first, last = sorted((int(before), int(places[sample])))
        left[first : last + 1] = roughness[sample]
    return Surface(low + (np.arange(cells, dtype=np.float64) + 0.5) * width, left)


def surface_figure(record: Record, title: str = "") -> Any:
    """Draw the roughness of the finished part along z. Raises :class:`RecordError` where nothing was cut."""
    surface = roughness_along(record)
    if not len(surface.z):
        raise RecordError("the surface cannot be drawn: nothing was cut.")
    figure = new_figure(8.0, 2.8)
    panel = figure.subplots()
    factor, unit = common_unit([surface.roughness], "m")
    panel.plot(surface.z * 1e3, surface.roughness / factor, color=SIMULATED, linewidth=1.2, drawstyle="steps-mid")
    panel.set_ylim(bottom=0.0)
    dress(panel, label("roughness R_a", unit), label("Z", "mm"), title or "Surface of the finished part")
    return figure


_SHOWN = 3
"""Turns that are shown, the last ones."""
_TURN_CELLS = 720
_TURN = 2.0 * math.pi


@dataclass(frozen=True, eq=False)
class Waves:
    """Height of the surface that the tool met in each of the last turns [m], (turns, cells), over the angle of the part [rad], (cells,).

    The last row is the latest turn. The height is that over the surface that a stiff tool would have left.
    """

    angle: FloatArray
    height: FloatArray

    @property
    def roughness(self) -> float:
        """Average roughness R_a around the part in the latest turn [m]: the mean distance from the mean height."""
        return float(np.mean(np.abs(self.height[-1] - self.height[-1].mean())))


def waves_on_part(record: Record, until: int | None = None, turns: int = _SHOWN) -> Waves:
    """Return the waves of the last whole turns before a sample, the last where it is left out.

    Raises :class:`MissingChannelError` where the record holds no cut in the loop, and :class:`NoValueError` before its first turn.
    """
    wave, angle = find_channel(record, "wave"), find_channel(record, "angle")
    if wave is None or angle is None:
        raise MissingChannelError("wave", "angle")
    turned, height = record[angle][:until], record[wave][:until]
    if not len(turned) or turned[-1] - turned[0] < _TURN:
        raise NoValueError("the part has not turned once")
    count = min(turns, int((turned[-1] - turned[0]) / _TURN))
    places = (np.arange(_TURN_CELLS) + 0.5) * _TURN / _TURN_CELLS
    # each cell was last passed less than a turn ago
    latest = turned[-1] - np.mod(turned[-1] - places, _TURN)
    return Waves(places, np.stack([np.interp(latest - back * _TURN, turned, height) for back in reversed(range(count))]))


def wave_roughness(record: Record) -> float:
    """Return the average roughness R_a that chatter left around the part in the last turn [m]."""
    return waves_on_part(record, turns=1).roughness


def waves_figure(record: Record, title: str = "") -> Any:
    """Draw the waves of the last turns over the angle of the part, one turn over the other. Raises :class:`RecordError` without any."""
    waves = waves_on_part(record)
    figure = new_figure(8.0, 3.0)
    panel = figure.subplots()
    factor, unit = common_unit([waves.height], "m")
    for back, (row, colour) in enumerate(zip(waves.height, [QUIET, MEASURED, SIMULATED][-len(waves.height) :], strict=True)):
        turns = len(waves.height) - 1 - back
        name = "last turn" if turns == 0 else "the turn before" if turns == 1 else f"{turns} turns before"
        panel.plot(np.degrees(waves.angle), row / factor, color=colour, linewidth=1.2, label=name)
    panel.set_xlim(0.0, 360.0)
    dress(panel, label("height", unit), label("angle of the part", "deg"), title or "Waves on the part")
    legend(panel)
    return figure
