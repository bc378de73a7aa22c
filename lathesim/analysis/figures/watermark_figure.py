"""The frontier of a watermark: how soon it tells a replay, against what it costs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from lathesim.analysis.figures.figure_style import CYCLE, INK, QUIET, dress, legend, new_figure


def frontier_figure(points: Sequence[tuple[float, float, float]], without: float, false_alarm: float) -> Any:
    """Draw (watermark, cost, delay) as delay over cost; ``without`` is the cost of the loop without a watermark."""
    figure = new_figure(7.5, 4.2)
    panel = figure.subplots()
    panel.plot([cost for _, cost, _ in points], [delay for _, _, delay in points], "o-", color=CYCLE[0], markersize=5)
    for size, cost, delay in points:
        panel.annotate(f"{size:g}", (cost, delay), textcoords="offset points", xytext=(6, 5), fontsize=8.5, color=INK)
    panel.axvline(without, color=QUIET, linestyle="--", linewidth=1.0, label="without a watermark: never told")
    panel.set_yscale("log")
    dress(panel, "mean delay to the alarm [samples]", "E[x²] of honest readings", f"One false alarm in {false_alarm:g} samples")
    legend(panel)
    return figure
