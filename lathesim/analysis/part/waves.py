"""The waves that chatter leaves on a turned part, over the angle of the part, from a record of a cut in the loop."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from lathesim.analysis.figures.figure_style import MEASURED, QUIET, SIMULATED, common_unit, dress, label, legend, new_figure
from lathesim.analysis.metrics.metric import MissingChannelError, NoValueError, find_channel
from lathesim.record import FloatArray, Record

_SHOWN = 3
"""Turns that are shown, the last ones."""
_CELLS = 720
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
    wave, angle = find_channel(record, "cut.wave", ".wave"), find_channel(record, "spindle.angle", ".angle")
    if wave is None or angle is None:
        raise MissingChannelError("cut.wave", "spindle.angle")
    turned, height = record[angle][:until], record[wave][:until]
    if not len(turned) or turned[-1] - turned[0] < _TURN:
        raise NoValueError("the part has not turned once")
    count = min(turns, int((turned[-1] - turned[0]) / _TURN))
    places = (np.arange(_CELLS) + 0.5) * _TURN / _CELLS
    # each cell was last passed less than a turn ago
    latest = turned[-1] - np.mod(turned[-1] - places, _TURN)
    rows = [np.interp(latest - back * _TURN, turned, height) for back in reversed(range(count))]
    return Waves(places, np.stack(rows))


def wave_roughness(record: Record) -> float:
    """Return the average roughness R_a that chatter left around the part in the last turn [m]."""
    return waves_on_part(record, turns=1).roughness


def waves_figure(record: Record, title: str = "") -> Any:
    """Draw the waves of the last turns over the angle of the part, one turn over the other. Raises :class:`RecordError` without any."""
    waves = waves_on_part(record)
    figure = new_figure(8.0, 3.0)
    panel = figure.subplots()
    factor, unit = common_unit([waves.height], "m")
    colours = [QUIET, MEASURED, SIMULATED][-len(waves.height) :]
    for back, (row, colour) in enumerate(zip(waves.height, colours, strict=True)):
        turns = len(waves.height) - 1 - back
        name = "last turn" if turns == 0 else "the turn before" if turns == 1 else f"{turns} turns before"
        panel.plot(np.degrees(waves.angle), row / factor, color=colour, linewidth=1.2, label=name)
    panel.set_xlim(0.0, 360.0)
    dress(panel, label("height", unit), label("angle of the part", "deg"), title or "Waves on the part")
    legend(panel)
    return figure
