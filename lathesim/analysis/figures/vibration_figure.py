"""The vibration of a cut as a figure: over time, and its spectrum with orders and lines."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from lathesim.analysis.figures.figure_style import ALERT, GRID, MEASURED, QUIET, SIMULATED, dress, legend, new_figure, thinned


def vibration_figure(title: str, values: Any, rate: float, turning: float, lines: Sequence[tuple[float, float]], decided: float) -> Any:
    """Draw a signal sampled at ``rate`` [Hz] and its spectrum; ``lines`` are (frequency, share), ``decided`` the frequency that decides."""
    figure = new_figure(8.0, 5.4)
    above, below = figure.subplots(2, 1)
    time = np.asarray(np.arange(len(values)) / rate, dtype=np.float64)
    above.plot(*thinned(time, np.asarray(values, dtype=np.float64)), color=MEASURED, linewidth=0.6)
    dress(above, "signal less its trend", "time [s]", title)
    count = len(values)
    size = np.abs(np.fft.rfft(values * np.hanning(count))) * 4.0 / count
    size = np.asarray(size, dtype=np.float64)
    frequency = np.asarray(np.fft.rfftfreq(count, 1.0 / rate), dtype=np.float64)
    highest = min(0.5 * rate, max([12.0 * turning, *(1.6 * item for item, _ in lines)]))
    keep = (frequency <= highest) & (frequency > 0.3 * turning)
    for order in range(1, math.floor(highest / turning) + 1):
        below.axvline(order * turning, color=GRID, linewidth=0.8, zorder=0, label="orders of the spindle" if order == 1 else None)
    below.semilogy(*thinned(frequency[keep], size[keep]), color=SIMULATED, linewidth=0.8, label="amplitude")
    for place, (item, _) in enumerate(lines):
        if item <= highest:
            at = float(np.interp(item, frequency, size))
            below.plot([item], [at], "v", color=QUIET, markersize=4, label="lines" if place == 0 else None)
    if math.isfinite(decided):
        below.axvline(decided, color=ALERT, linewidth=1.0, linestyle="--", label=f"{decided:.1f} Hz decides")
    top = float(size[keep].max())
    below.set_ylim(max(1e-4 * top, float(size[keep].min()) * 0.5), 3.0 * top)
    dress(below, "amplitude", "frequency [Hz]")
    legend(below)
    return figure
