"""The picture of an emulation: deviations at the way-points with their band, and how well each combination of values is known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from lathesim.analysis.figures.figure_style import ALERT, CYCLE, QUIET, dress, legend, new_figure
from lathesim.record import FloatArray

Panel = tuple[str, FloatArray, Mapping[str, FloatArray], Mapping[str, FloatArray], Mapping[str, FloatArray]]
"""Name, times [s], way-points, deviations and half widths of the band [m], by channel."""


def emulation_figure(title: str, panels: Sequence[Panel], singular: FloatArray) -> Any:
    """Draw a panel for each recording, and one with the singular values."""
    rows = len(panels) + 1
    figure = new_figure(8.5, 2.6 * rows)
    drawn = figure.subplots(rows, 1, squeeze=False)[:, 0]
    for panel, (name, time, values, deviations, bands) in zip(drawn, panels, strict=False):
        if deviations:
            for number, (channel, deviation) in enumerate(deviations.items()):
                color = CYCLE[number % len(CYCLE)]
                panel.fill_between(time, -1e6 * bands[channel], 1e6 * bands[channel], color=color, alpha=0.12, linewidth=0)
                panel.plot(time, 1e6 * deviation, ".", markersize=3, color=color, label=channel)
            dress(panel, "deviation [µm]", "time [s]", f"{name}, not fitted, with 95 % band")
        else:
            for number, (channel, column) in enumerate(values.items()):
                panel.plot(time, 1e3 * column, ".-", markersize=3, linewidth=0.7, color=CYCLE[number % len(CYCLE)], label=channel)
            dress(panel, "way-points [mm]", "time [s]", name)
        legend(panel)
    known = np.maximum(singular, 1e-10)
    drawn[-1].bar(np.arange(1, len(known) + 1), known, color=[CYCLE[0] if size > 10 else QUIET for size in known])
    drawn[-1].axhline(10.0, color=ALERT, linewidth=0.9, linestyle="--", label="known to 10 % above")
    drawn[-1].set_yscale("log")
    dress(drawn[-1], "singular value", "combination of values", "What the way-points tell")
    legend(drawn[-1])
    figure.suptitle(title, fontsize=11, x=0.01, ha="left")
    return figure
