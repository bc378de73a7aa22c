"""The roughness of the finished part along z, from a record."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from lathesim.analysis.figures.figure_style import SIMULATED, common_unit, dress, label, new_figure
from lathesim.analysis.metrics.metric import signal
from lathesim.errors import RecordError
from lathesim.record import FloatArray, Record

_CELLS = 600


@dataclass(frozen=True)
class Surface:
    """Roughness R_a over z, both in metres, (cells,); NaN where nothing was cut."""

    z: FloatArray
    roughness: FloatArray


def roughness_along(record: Record, cells: int = _CELLS) -> Surface:
    """Return the average roughness the tool left at each place, the last cut counting.

    Between two samples in the cut the tool passes all cells from one z to the next. Raises :class:`RecordError` where the record has no
    roughness or no z position.
    """
    roughness, z = signal(record, "surface_finish.roughness", ".roughness"), signal(record, "z_axis.position")
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
