"""The figure of a comparison: the worst channels with their residuals, and what the mismatch depends on."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from lathesim.analysis.display_unit import plain_number
from lathesim.analysis.figure_style import (
    ALERT,
    INK,
    MATERIAL,
    MEASURED,
    QUIET,
    RESIDUAL,
    SIMULATED,
    common_unit,
    dress,
    label,
    legend,
    new_figure,
    thinned,
)
from lathesim.diagnosis.comparison.compare import ChannelResidual, Comparison, Dependence

_MOST = {"channels": 3, "bars": 6}
_HEIGHTS = {"titles": 1.0, "channel": 2.3, "bar": 0.34, "frame": 1.0}
"""Heights of what is drawn [inch]; the bars have a frame around them."""


def compare_figure(comparison: Comparison) -> Any:
    """Draw a comparison on one page: channels at the left, what explains them at the right."""
    shown = comparison.channels[: _MOST["channels"]]
    bars = comparison.explained_by[: _MOST["bars"]]
    right = _HEIGHTS["frame"] + _HEIGHTS["bar"] * len(bars) if bars else 0.0
    figure = new_figure(11.0 if bars else 8.0, _HEIGHTS["titles"] + max(_HEIGHTS["channel"] * len(shown), right))
    if bars:
        left_part, right_part = figure.subfigures(1, 2, width_ratios=[1.55, 1.0])
    else:
        left_part, right_part = figure, None
    panels = left_part.subplots(2 * len(shown), 1, sharex=True, squeeze=False, gridspec_kw={"height_ratios": [1.5, 1.0] * len(shown)})[:, 0]
    for place, item in enumerate(shown):
        _draw_channel(panels[2 * place], panels[2 * place + 1], item, comparison.off)
    panels[-1].set_xlabel(label("time", "s"), fontsize=9, color=INK)
    title = f"{comparison.lesson} against {comparison.recording}"
    figure.suptitle(title, fontsize=11, color=INK, x=0.01, ha="left", fontweight="bold")
    if right_part is not None:
        _draw_bars(right_part.subplots(), bars)
    return figure


def _draw_channel(upper: Any, lower: Any, item: ChannelResidual, off: float) -> None:
    factor, unit = common_unit([item.recorded, item.simulated], item.unit)
    upper.plot(*thinned(item.time, item.recorded / factor), color=MEASURED, linewidth=1.8, label="recorded")
    upper.plot(*thinned(item.time, item.simulated / factor), color=SIMULATED, linewidth=1.0, label="simulated")
    dress(upper, label("", unit).strip(), "", item.channel)
    legend(upper)
    factor, unit = common_unit([3.0 * item.residual], item.unit)
    lower.axhspan(-item.floor / factor, item.floor / factor, color=MATERIAL, linewidth=0, zorder=0)
    lower.axvspan(*item.worst, color="#fbe3e2", linewidth=0, zorder=0)
    lower.plot(*thinned(item.time, item.residual / factor), color=RESIDUAL, linewidth=0.9)
    dress(lower, label("residual", unit))
    lower.text(
        1.0, 1.02, f"{plain_number(item.over_floor, 3)} times the noise", transform=lower.transAxes, ha="right", va="bottom", fontsize=8.5,
        color=ALERT if item.over_floor > off else QUIET,
    )  # fmt: skip


def _draw_bars(panel: Any, chosen: Sequence[Dependence]) -> None:
    places = np.arange(len(chosen))
    panel.barh(places + 0.2, [100.0 * item.share for item in chosen], height=0.32, color=ALERT)
    for place, item in zip(places, chosen, strict=True):
        panel.text(0.0, place - 0.06, item.variable, fontsize=8.5, color=INK, va="bottom")
    panel.set_ylim(len(chosen) - 0.4, -0.6)
    panel.set_xlim(0.0, 100.0)
    dress(panel, "", "share of what is missing [%]", "Depends on")
    panel.grid(False, axis="y")
    panel.set_yticks([])
