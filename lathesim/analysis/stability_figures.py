"""Figures of stability: lobes, the map that cuts have taught, a frequency response, the vibration of a cut."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from lathesim.analysis.figure_style import ALERT, CYCLE, GRID, INK, MEASURED, QUIET, SIMULATED, dress, legend, new_figure, thinned

_SLOWEST = 0.3
"""Order of the spindle below which feed and shape show."""


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


def response_figure(
    title: str, frequency: Any, receptance: Any, *, model: Any = None, coherence: Any = None, band: Any = None, modes: Any = ()
) -> Any:
    """Draw a receptance [m/N] over frequency [Hz], with that of a fitted ``model`` and the natural frequencies of its ``modes``.

    ``band`` are the bounds of its size, (2, lines).
    """
    figure = new_figure(8.0, 6.4 if coherence is not None else 5.4)
    panels = figure.subplots(4 if coherence is not None else 3, 1, sharex=True)
    micro = 1e6
    name = "computed" if model is None and coherence is None else "measured"
    for panel, part, label in ((panels[0], np.real, "Re H [µm/N]"), (panels[1], np.imag, "Im H [µm/N]"), (panels[2], np.abs, "|H| [µm/N]")):
        panel.plot(frequency, micro * part(receptance), color=MEASURED, linewidth=1.2, label=name)
        if model is not None:
            panel.plot(frequency, micro * part(model), color=SIMULATED, linewidth=1.0, linestyle="--", label="fitted modes")
        for place in modes:
            panel.axvline(place, color=QUIET, linewidth=0.7, zorder=0)
        dress(panel, label)
    panels[2].set_yscale("log")
    if band is not None:
        panels[2].fill_between(frequency, micro * band[0], micro * band[1], color=SIMULATED, alpha=0.2, linewidth=0, label="95 %")
    if coherence is not None:
        panels[3].plot(frequency, coherence, color=ALERT, linewidth=0.8)
        panels[3].set_ylim(0.0, 1.05)
        dress(panels[3], "coherence")
    panels[-1].set_xlabel("frequency [Hz]", fontsize=9)
    dress(panels[0], "Re H [µm/N]", title=title)
    legend(panels[2] if band is not None else panels[0])
    return figure


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
    keep = (frequency <= highest) & (frequency > _SLOWEST * turning)
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
