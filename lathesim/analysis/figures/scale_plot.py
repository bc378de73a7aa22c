"""The figure of how the cost of simulating grows with axes, program time and runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from lathesim.analysis.figures.figure_style import CYCLE, INK, QUIET, dress, new_figure


def scale_figure(series: Mapping[str, tuple[Sequence[float], Sequence[float], float]]) -> Any:
    """Return a figure with one log panel a series: name -> (sizes, CPU seconds, slope); a grey line of slope 1 shows proportion."""
    figure = new_figure(3.6 * len(series), 3.4)
    panels = np.atleast_1d(figure.subplots(1, len(series)))
    for number, (panel, (name, (sizes, seconds, slope))) in enumerate(zip(panels, series.items(), strict=True)):
        dress(panel, "CPU time [s]" if number == 0 else "", name, f"slope {slope:.3f}")
        panel.set_xscale("log")
        panel.set_yscale("log")
        middle = len(sizes) // 2
        along = np.array([sizes[0], sizes[-1]], dtype=float)
        panel.plot(along, seconds[middle] * along / sizes[middle], color=QUIET, linewidth=1.0, linestyle="--")
        panel.plot(sizes, seconds, color=CYCLE[number % len(CYCLE)], marker="o", markersize=4.5, linewidth=1.4)
        for size, value in zip(sizes, seconds, strict=True):
            panel.annotate(f"{value:.3g}", (size, value), (4, -9), textcoords="offset points", fontsize=7, color=INK)
    return figure
