"""Figures of experiments: a sweep, a designed program, an emulation, the frontier of a watermark."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from lathesim.analysis.display_unit import plain_number
from lathesim.analysis.figure_style import ALERT, CYCLE, INK, QUIET, REFERENCE, SIMULATED, common_unit, dress, label, legend, new_figure
from lathesim.engine.assembly import Place
from lathesim.errors import RecordError
from lathesim.record import FloatArray

_MARKED = 60
"""Points of a line that are marked one by one."""
_KNOWN = 10.0
"""Singular value of a direction that is known to 10 %."""


@dataclass(frozen=True)
class SweepAxis:
    """A varied parameter: its name, values in ``unit``, and whether they stand in equal ratios."""

    name: str
    values: Sequence[float]
    unit: str
    logarithmic: bool = False

    @property
    def label(self) -> str:
        """The name with its unit."""
        return label(self.name, "" if self.unit == "1" else self.unit)


def sweep_figure(axes: Sequence[SweepAxis], metrics: Sequence[tuple[str, str, FloatArray]], title: str = "") -> Any:
    """Draw metrics (name, SI unit, values in the order of the grid, the last axis fastest), a panel each.

    Raises :class:`RecordError` for more than two parameters.
    """
    if len(axes) > 2:
        raise RecordError(f"a sweep over {len(axes)} parameters cannot be drawn.", remedy="Vary one or two.")
    wide = len(axes) == 2
    figure = new_figure(7.2, 0.8 + (4.2 if wide else 2.8) * len(metrics))
    for panel, (name, unit, values) in zip(figure.subplots(len(metrics), 1, squeeze=False)[:, 0], metrics, strict=True):
        factor, shown = common_unit([values], unit)
        quantity = label(name.replace("_", " "), shown)
        if wide:
            _map(figure, panel, axes, values / factor, quantity)
        else:
            _line(panel, axes[0], values / factor, quantity)
    if title:
        figure.suptitle(title, fontsize=11, color=INK, x=0.01, ha="left", fontweight="bold")
    return figure


def _line(panel: Any, axis: SweepAxis, values: FloatArray, quantity: str) -> None:
    panel.plot(axis.values, values, color=SIMULATED, linewidth=1.3, marker="o", markersize=3.5 if len(values) <= _MARKED else 0)
    if axis.logarithmic:
        panel.set_xscale("log")
    best = _least(values)
    if best is not None:
        panel.plot([axis.values[best]], [values[best]], marker="o", markersize=6, color=ALERT, linestyle="none", label=_told(values[best]))
    dress(panel, quantity, axis.label)
    legend(panel)


def _map(figure: Any, panel: Any, axes: Sequence[SweepAxis], values: FloatArray, quantity: str) -> None:
    upright, across = axes
    grid = np.ma.masked_invalid(values.reshape(len(upright.values), len(across.values)))
    drawn = panel.pcolormesh(_edges(across), _edges(upright), grid, cmap="viridis_r")
    if across.logarithmic:
        panel.set_xscale("log")
    if upright.logarithmic:
        panel.set_yscale("log")
    best = _least(values)
    if best is not None:
        row, column = divmod(best, len(across.values))
        panel.plot(
            [across.values[column]], [upright.values[row]], marker="o", markersize=7, markerfacecolor="none", markeredgecolor=ALERT,
            markeredgewidth=1.6, linestyle="none", label=_told(values[best]),
        )  # fmt: skip
    dress(panel, upright.label, across.label)
    panel.grid(False)
    bar = figure.colorbar(drawn, ax=panel)
    bar.set_label(quantity, fontsize=9, color=INK)
    bar.outline.set_visible(False)
    bar.ax.tick_params(labelsize=8.5, colors=INK)
    legend(panel)


def _told(value: float) -> str:
    return f"least: {plain_number(float(value), 4)}"


def _least(values: FloatArray) -> int | None:
    finite = np.isfinite(values)
    return int(np.flatnonzero(finite)[values[finite].argmin()]) if finite.any() else None


def _edges(axis: SweepAxis) -> FloatArray:
    """Return the borders of the cells around the values of an axis."""
    values = np.asarray(axis.values, dtype=float)
    if len(values) == 1:
        return np.array([values[0] - 0.5, values[0] + 0.5])
    if axis.logarithmic:
        return np.asarray(np.sign(values[0]) * np.exp(_middles(np.log(np.abs(values)))))
    return _middles(values)


def _middles(values: FloatArray) -> FloatArray:
    inner = 0.5 * (values[1:] + values[:-1])
    return np.concatenate([[2.0 * values[0] - inner[0]], inner, [2.0 * values[-1] - inner[-1]]])


def experiment_figure(
    title: str, rivals: Sequence[str], channels: Sequence[tuple[str, str, float]], traces: FloatArray, seconds: float,
    tried: Sequence[tuple[str, float, float]], chosen: tuple[float, float],
) -> Any:  # fmt: skip
    """Draw the motion, for each channel how each rival differs from the first, and all programs tried over their length.

    ``channels`` have a name, a unit and a floor [SI].
    """
    rows = len(channels) + 2
    figure = new_figure(8.5, 1.9 * rows + 0.5)
    panels = figure.subplots(rows, 1)
    time = np.linspace(0.0, seconds, traces.shape[2])
    factor, unit = common_unit([traces[0, 0]], channels[0][1])
    panels[0].plot(time, traces[0, 0] / factor, color=REFERENCE, linewidth=0.9)
    dress(panels[0], label(Place.of(channels[0][0]).part, unit), "", f"{title}: the program that separates best")
    for row, (channel, own, floor) in enumerate(channels):
        panel = panels[row + 1]
        differences = [traces[number, row] - traces[0, row] for number in range(1, len(rivals))]
        factor, unit = common_unit([*differences, np.array([floor])], own)
        for number, difference in enumerate(differences, 1):
            panel.plot(time, difference / factor, color=CYCLE[number % len(CYCLE)], linewidth=0.9, label=f"{rivals[number]} - {rivals[0]}")
        panel.axhspan(-floor / factor, floor / factor, color=QUIET, alpha=0.3, linewidth=0, label="noise")
        dress(panel, label(channel, unit), "time [s]" if row == len(channels) - 1 else "")
        if row == 0:
            legend(panel)
    last = panels[-1]
    last.plot([item[1] for item in tried], [item[2] for item in tried], ".", color=CYCLE[0], label="programs tried")
    last.plot([chosen[0]], [chosen[1]], "o", color=ALERT, markersize=8, label="chosen")
    last.set_ylim(-0.03, 1.03)
    dress(last, "chance to decide", "length of the program [s]")
    legend(last)
    return figure


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
    drawn[-1].bar(np.arange(1, len(known) + 1), known, color=[CYCLE[0] if size > _KNOWN else QUIET for size in known])
    drawn[-1].axhline(_KNOWN, color=ALERT, linewidth=0.9, linestyle="--", label="known to 10 % above")
    drawn[-1].set_yscale("log")
    dress(drawn[-1], "singular value", "combination of values", "What the way-points tell")
    legend(drawn[-1])
    figure.suptitle(title, fontsize=11, x=0.01, ha="left")
    return figure


def frontier_figure(points: Sequence[tuple[float, float, float]], without: float, false_alarm: float) -> Any:
    """Draw (watermark, cost, delay) as delay over cost; ``without`` is the cost of the loop without a watermark."""
    figure = new_figure(7.5, 4.2)
    panel = figure.subplots()
    panel.plot([cost for _, cost, _ in points], [delay for _, _, delay in points], "o-", color=CYCLE[0], markersize=5)
    for size, cost, delay in points:
        panel.annotate(f"{size:g}", (cost, delay), textcoords="offset points", xytext=(6, 5), fontsize=8.5, color=INK)
    panel.axvline(without, color=QUIET, linestyle="--", linewidth=1.0, label="without a watermark: never found")
    panel.set_yscale("log")
    dress(panel, "mean delay to the alarm [samples]", "E[x²] of honest readings", f"One false alarm in {false_alarm:g} samples")
    legend(panel)
    return figure
