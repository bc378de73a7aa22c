"""The circular test as a figure: polar, magnified, quadrants marked, both directions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from lathesim.analysis.display_unit import display_unit
from lathesim.analysis.figures.figure_style import CYCLE, GRID, INK, QUIET, REFERENCE, label, legend, new_figure
from lathesim.analysis.metrics.circular_test import Circle


def circle_figure(title: str, named: Sequence[tuple[str, Circle]]) -> Any:
    """Draw circles over each other: the programmed one of radius 1, each deviation magnified alike so that the largest fills a third."""
    largest = max(float(np.max(np.abs(circle.radial))) for _, circle in named)
    magnified = 0.35 / max(largest, 1e-12)
    factor, unit = display_unit("m", largest)
    figure = new_figure(6.4, 6.6)
    panel = figure.subplots()
    around = np.linspace(0.0, 2.0 * np.pi, 721)
    panel.plot(np.sin(around), np.cos(around), color=REFERENCE, linewidth=1.0, label="programmed")
    for step in _rings(largest / factor):
        for side in (-1.0, 1.0):
            size = 1.0 + side * step * factor * magnified
            panel.plot(size * np.sin(around), size * np.cos(around), color=GRID, linewidth=0.8, zorder=0)
        panel.annotate(f"{step:+.3g}", (0.0, 1.0 + step * factor * magnified), color=QUIET, fontsize=7.5, ha="center", va="bottom")
    for name, text in (("+X", (0, 1)), ("+Z", (1, 0)), ("-X", (0, -1)), ("-Z", (-1, 0))):
        panel.plot([0.5 * text[0], 1.45 * text[0]], [0.5 * text[1], 1.45 * text[1]], color=GRID, linewidth=0.8, zorder=0)
        panel.annotate(name, (1.52 * text[0], 1.52 * text[1]), color=INK, fontsize=9, ha="center", va="center")
    for colour, (name, circle) in zip(CYCLE, named, strict=False):
        drawn = 1.0 + magnified * circle.radial
        panel.plot(drawn * np.sin(circle.angle), drawn * np.cos(circle.angle), color=colour, linewidth=1.4, label=name)
    panel.set_aspect("equal")
    panel.set_axis_off()
    panel.set_xlim(-1.6, 1.6)
    panel.set_ylim(-1.6, 1.75)
    panel.set_title(f"{title}\n{label('radial deviation', unit)}", fontsize=10, color=INK, loc="left", fontweight="bold")
    legend(panel, loc="upper center", bbox_to_anchor=(0.5, 0.02), ncols=3)
    return figure


def _rings(largest: float) -> list[float]:
    """Return one or two round numbers up to the largest."""
    power = 10.0 ** np.floor(np.log10(max(largest, 1e-12)))
    step = next(power * factor for factor in (5.0, 2.0, 1.0) if power * factor <= largest * (1.0 + 1e-9))
    return [float(step)]
