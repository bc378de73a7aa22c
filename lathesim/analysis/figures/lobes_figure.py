"""Stability lobes as a figure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from lathesim.analysis.figures.figure_style import ALERT, CYCLE, INK, QUIET, SIMULATED, dress, legend, new_figure


def lobes_figure(
    title: str,
    speeds: Sequence[float],
    widths: Sequence[float],
    smallest: float,
    *,
    band: tuple[Sequence[float], Sequence[float]] | None = None,
    flips: Sequence[bool] = (),
    cuts: Sequence[tuple[float, float, bool | None]] = (),
    chosen: tuple[float, float] | None = None,
) -> Any:
    """Draw the limit of the chip width [mm] over the speed [rpm]; above the line the cut chatters.

    ``band`` are the 95 % bounds of the limit, ``flips`` says where stability is lost by a flip, ``cuts`` are tried ones (speed, width,
    stable) and ``chosen`` is the cut of the lesson.
    """
    figure = new_figure(8.0, 4.5)
    panel = figure.subplots()
    line = np.array(widths, dtype=np.float64)
    finite = line[np.isfinite(line)]
    lowest = smallest if np.isfinite(smallest) else float(finite.min()) if len(finite) else 1.0
    top = max([4.0 * lowest, *(1.15 * cut[1] for cut in cuts), *([1.15 * chosen[1]] if chosen else [])])
    shown = np.where(np.isfinite(line), line, 2.0 * top)
    panel.fill_between(speeds, np.minimum(shown, top), top, color=ALERT, alpha=0.10, linewidth=0, label="chatter")
    if band is not None:
        low, high = (np.minimum(np.where(np.isfinite(edge), edge, top), top) for edge in (np.array(band[0]), np.array(band[1])))
        panel.fill_between(speeds, low, high, color=SIMULATED, alpha=0.18, linewidth=0, label="95 % of what is uncertain")
    panel.plot(speeds, shown, color=SIMULATED, linewidth=1.6, label="limit")
    if any(flips):
        panel.plot(speeds, np.where(np.array(flips), shown, np.nan), color=CYCLE[3], linewidth=2.4, label="lost by a flip")
    if np.isfinite(smallest):
        panel.axhline(smallest, color=QUIET, linestyle="--", linewidth=0.9, label=f"{smallest:.3g} mm at any speed")
    for stable, mark, color, name in ((True, "o", CYCLE[2], "stable cut"), (False, "x", ALERT, "cut that chattered")):
        points = [(speed, width) for speed, width, was in cuts if was is stable]
        if points:
            panel.plot(*zip(*points, strict=True), mark, color=color, markersize=6, label=name)
    if chosen is not None:
        panel.plot(*chosen, "D", color=INK, markersize=6, label="the lesson's cut")
    panel.set_ylim(0.0, top)
    panel.set_xlim(min(speeds), max(speeds) if max(speeds) > min(speeds) else min(speeds) * 1.01)
    dress(panel, "chip width [mm]", "spindle speed [rpm]", title)
    legend(panel, ncols=3)
    return figure
