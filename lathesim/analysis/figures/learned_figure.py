"""A stability map that cuts have taught, as a figure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from lathesim.analysis.figures.figure_style import ALERT, CYCLE, INK, SIMULATED, dress, legend, new_figure


def learned_figure(
    title: str,
    speeds: Sequence[float],
    widths: Any,
    stable: Any,
    quantiles: Any,
    cuts: Sequence[tuple[float, float, bool]],
    proposed: Sequence[tuple[float, float]],
    others: Mapping[str, Any],
) -> Any:
    """Draw the probability of being stable over speed [rpm] and width [mm], (widths, speeds), the limit with its bounds, cuts and
    proposals.

    ``others`` are the probabilities by other learners, of which the line of one half is drawn.
    """
    figure = new_figure(8.0, 5.0)
    panel = figure.subplots()
    area = panel.pcolormesh(speeds, widths, stable, cmap="RdYlGn", vmin=0.0, vmax=1.0, alpha=0.55, shading="auto", rasterized=True)
    figure.colorbar(area, ax=panel, label="probability to be stable", pad=0.01)
    top = float(np.max(widths))
    panel.plot(speeds, np.minimum(quantiles[1], 2 * top), color=SIMULATED, linewidth=1.6, label="limit, median")
    for row, name in ((quantiles[0], "95 %"), (quantiles[2], "")):
        panel.plot(speeds, np.minimum(row, 2 * top), color=SIMULATED, linewidth=0.8, linestyle=":", label=name or None)
    for number, (name, values) in enumerate(others.items()):
        lines = panel.contour(speeds, widths, values, levels=[0.5], colors=[CYCLE[3 + number]], linewidths=1.2, linestyles="--")
        if lines.levels is not None:
            panel.plot([], [], color=CYCLE[3 + number], linestyle="--", linewidth=1.2, label=name)
    for was, mark, color, name in ((True, "o", INK, "stable"), (False, "x", ALERT, "chattered")):
        points = [(speed, width) for speed, width, good in cuts if good is was]
        if points:
            panel.plot(*zip(*points, strict=True), mark, color=color, markersize=6, label=name)
    if proposed:
        panel.plot(*zip(*proposed, strict=True), "*", color=CYCLE[0], markeredgecolor="white", markersize=13, label="next")
    panel.set_ylim(0.0, top)
    panel.set_xlim(min(speeds), max(speeds))
    dress(panel, "chip width [mm]", "spindle speed [rpm]")
    figure.suptitle(title, fontsize=10, color=INK, fontweight="bold", x=0.02, ha="left")
    legend(panel, ncols=4)
    return figure
