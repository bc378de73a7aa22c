"""The figure of a sweep: a metric over one parameter as a line, over two as a map; the best run is marked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from lathesim.analysis.display_unit import plain_number
from lathesim.analysis.figures.figure_style import ALERT, INK, SIMULATED, common_unit, dress, label, legend, new_figure
from lathesim.errors import RecordError
from lathesim.record import FloatArray


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
    panels = figure.subplots(len(metrics), 1, squeeze=False)[:, 0]
    for panel, (name, unit, values) in zip(panels, metrics, strict=True):
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
    panel.plot(axis.values, values, color=SIMULATED, linewidth=1.3, marker="o", markersize=3.5 if len(values) <= 60 else 0)
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
