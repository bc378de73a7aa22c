"""The figure of a comparison: the worst channels with their residuals, what the mismatch depends on, and the residual's spectra."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from lathesim.analysis.figure_style import (
    ALERT,
    GRID,
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
from lathesim.diagnosis.comparison.compare import ChannelLines, ChannelResidual, Comparison, Dependence
from lathesim.diagnosis.comparison.compare_text import line_text
from lathesim.diagnosis.location.order_spectrum import Spectrum

_MOST = {"channels": 3, "spectra": 2, "bars": 6}
_HEIGHTS = {"titles": 1.0, "channel": 2.3, "spectrum": 1.7, "bar": 0.34, "frame": 1.0}
"""Heights of what is drawn [inch]; the bars have a frame around them."""


def compare_figure(comparison: Comparison) -> Any:
    """Draw a comparison on one page: channels at the left, what explains them at the right."""
    shown = comparison.channels[: _MOST["channels"]]
    # the channel that lines tell most of; where there is none, that which is off most
    worst = max(comparison.spectra, key=lambda item: max((line.share for line in item.lines), default=0.0), default=None)
    spectra = _chosen(worst) if worst is not None else []
    bars = comparison.explained_by[: _MOST["bars"]]
    heights = [_HEIGHTS["frame"] + _HEIGHTS["bar"] * len(bars)] * bool(bars) + [_HEIGHTS["spectrum"]] * len(spectra)
    right = len(heights)
    figure = new_figure(11.0 if right else 8.0, _HEIGHTS["titles"] + max(_HEIGHTS["channel"] * len(shown), sum(heights)))
    if right:
        left_part, right_part = figure.subfigures(1, 2, width_ratios=[1.55, 1.0])
    else:
        left_part, right_part = figure, None
    panels = left_part.subplots(2 * len(shown), 1, sharex=True, squeeze=False, gridspec_kw={"height_ratios": [1.5, 1.0] * len(shown)})[:, 0]
    for place, item in enumerate(shown):
        _draw_channel(panels[2 * place], panels[2 * place + 1], item, comparison.off)
    panels[-1].set_xlabel(label("time", "s"), fontsize=9, color=INK)
    title = f"{comparison.lesson} against {comparison.recording}"
    figure.suptitle(title, fontsize=11, color=INK, x=0.01, ha="left", fontweight="bold")
    if right_part is not None and worst is not None:
        drawn = list(np.atleast_1d(right_part.subplots(right, 1, gridspec_kw={"height_ratios": heights})))
        if bars:
            _draw_bars(drawn.pop(0), bars)
        for panel, spectrum in zip(drawn, spectra, strict=True):
            _draw_spectrum(panel, spectrum, worst, next(item.unit for item in comparison.channels if item.channel == worst.channel))
    return figure


def _chosen(worst: ChannelLines) -> list[Spectrum]:
    """Return the spectra to draw: in time, and against the way that holds the strongest line (or the first one)."""
    against = [line.variable for line in worst.lines if line.variable != "time"]
    ways = [item for item in worst.spectra if item.variable != "time"]
    ways.sort(key=lambda item: item.variable not in against[:1])
    return [item for item in worst.spectra if item.variable == "time"] + ways[: _MOST["spectra"] - 1]


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
        1.0, 1.02, f"{item.over_floor:.3g} floors", transform=lower.transAxes, ha="right", va="bottom", fontsize=8.5,
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


def _draw_spectrum(panel: Any, spectrum: Spectrum, worst: ChannelLines, amplitude_unit: str) -> None:
    scale, unit, quantity = axis_of(spectrum.variable, spectrum.unit)
    inside = spectrum.frequency > 0.0
    panel.loglog(spectrum.frequency[inside] * scale, np.maximum(spectrum.amplitude[inside], 1e-300), color=RESIDUAL, linewidth=0.8)
    top = float(spectrum.amplitude[inside].max(initial=1e-300))
    panel.set_ylim(top * 1e-4, top * 30.0)
    own = [line for line in worst.lines if line.variable == spectrum.variable]
    for place, line in enumerate(sorted(own, key=lambda line: line.frequency)):
        where, height = line.frequency * scale, top * 12.0 / 3.5 ** (place % 3)
        panel.axvline(where, color=ALERT, linewidth=1.0, alpha=0.35)
        panel.annotate(line_text(line), (where, height), (3, 0), textcoords="offset points", fontsize=8, color=ALERT, va="center")
    dress(panel, label("amplitude", amplitude_unit), label(quantity, unit), f"Spectrum, {worst.channel}")
    panel.grid(True, which="major", color=GRID, linewidth=0.7)


def axis_of(variable: str, unit: str) -> tuple[float, str, str]:
    """Return the factor from cycles per SI unit to what is shown, its unit, and what the axis is called."""
    if unit == "s":
        return 1.0, "Hz", "frequency"
    if unit == "rad":
        return 2.0 * math.pi, "1/turn", f"orders of {variable.partition(' of ')[2]}"
    return 1e-3, "1/mm", f"lines along {variable.partition(' of ')[2]}"
