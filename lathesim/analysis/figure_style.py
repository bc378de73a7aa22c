"""How the figures look: colours, axes, labels with units, thinning of long signals. Only figures import matplotlib, and without pyplot."""

from __future__ import annotations

import io
import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from lathesim.analysis.display_unit import display_unit, pretty_unit
from lathesim.record import FloatArray, stretches

INK = "#22262b"
QUIET = "#8a929c"
GRID = "#e4e7eb"
CONTACT = "#fdf0d5"
MATERIAL = "#e3e7ec"
STOCK = "#f3f5f7"
REFERENCE = "#4a525c"
SIMULATED = "#0b6fa8"
MEASURED = "#d1570b"
RESIDUAL = "#7a3b8f"
ALERT = "#c0272d"
CYCLE = ("#0b6fa8", "#d1570b", "#2c8a4b", "#7a3b8f", "#b8860b", "#c0397b", "#3f4fa8", "#6b5b4b")
"""Colours of equal weight that stay apart for colour-blind eyes."""

_DRAWN = 6000
"""Points a line keeps: more than a page has dots across, so thinning is not seen."""


def new_figure(width: float = 8.0, height: float = 5.0) -> Any:
    """Return an empty figure of a size in inches; its panels are laid out without overlap, and start about where they will stand.

    A notebook shows it: IPython calls ``_repr_png_`` of a result, where it does not know the type.
    """
    from matplotlib.figure import Figure
    from matplotlib.gridspec import SubplotParams

    about = SubplotParams(left=0.6 / width, right=1.0 - 0.05 / width, bottom=0.42 / height, top=1.0 - 0.27 / height, hspace=0.22)
    figure: Any = Figure(figsize=(width, height), layout="constrained", subplotpars=about, facecolor="white")
    figure._repr_png_ = partial(_as_png, figure)
    return figure


def _as_png(figure: Any) -> bytes:
    file = io.BytesIO()
    write_figure(figure, file, "png")
    return file.getvalue()


def dress(panel: Any, ylabel: str = "", xlabel: str = "", title: str = "") -> None:
    """Style a panel: no frame, quiet grid, labels in ink."""
    for side in ("top", "right"):
        panel.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        panel.spines[side].set_color(QUIET)
        panel.spines[side].set_linewidth(0.8)
    panel.grid(True, color=GRID, linewidth=0.7)
    panel.set_axisbelow(True)
    panel.tick_params(color=QUIET, labelcolor=INK, labelsize=8.5, width=0.8, length=3)
    panel.set_ylabel(ylabel, fontsize=9, color=INK)
    panel.set_xlabel(xlabel, fontsize=9, color=INK)
    if title:
        panel.set_title(title, fontsize=10, color=INK, loc="left", fontweight="bold", pad=6)


def legend(panel: Any, **options: Any) -> None:
    """Put a legend without a frame above the panel, at the right, where it covers no line."""
    handles, labels = panel.get_legend_handles_labels()
    if not handles:
        return
    place = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "ncols": min(len(labels), 5), "borderaxespad": 0.2} | options
    panel.legend(handles, labels, frameon=False, fontsize=8.5, labelcolor=INK, handlelength=1.6, columnspacing=1.2, **place)


def label(quantity: str, unit: str) -> str:
    """Return ``"contour error [mm]"``, with proper signs for a figure."""
    pretty = pretty_unit(unit)
    return f"{quantity} [{pretty}]" if pretty else quantity


def common_unit(values: Iterable[FloatArray], unit: str) -> tuple[float, str]:
    """Return the display unit in which all of these signals read well."""
    largest = 0.0
    for signal in values:
        finite = np.abs(signal[np.isfinite(signal)])
        largest = max(largest, float(finite.max()) if len(finite) else 0.0)
    return display_unit(unit, largest)


def thinned(time: FloatArray, values: FloatArray, points: int = _DRAWN) -> tuple[FloatArray, FloatArray]:
    """Return a signal with at most about ``points`` points, keeping the lowest and highest of each stretch so that no spike is lost, and
    where it has a gap the first number that is none."""
    if len(values) <= points:
        return time, values
    stretch = -(-len(values) * 2 // points)
    whole = len(values) // stretch * stretch
    blocks = values[:whole].reshape(-1, stretch)
    there = np.isfinite(blocks)
    low = np.where(there, blocks, np.inf).argmin(axis=1)
    high = np.where(there, blocks, -np.inf).argmax(axis=1)
    starts = np.arange(len(blocks)) * stretch
    kept = np.sort(np.concatenate([starts + low, starts + high, (starts + there.argmin(axis=1))[~there.all(axis=1)]]))
    kept = np.concatenate([kept, np.arange(whole, len(values))])
    return time[kept], values[kept]


def shade(panel: Any, time: FloatArray, inside: Sequence[bool] | np.ndarray[Any, Any], color: str = CONTACT, name: str = "") -> None:
    """Shade the stretches of time in which a condition holds."""
    for number, (begin, end) in enumerate(zip(*stretches(np.asarray(inside, dtype=bool)), strict=True)):
        panel.axvspan(time[begin], time[end - 1], color=color, linewidth=0, zorder=0, label=name if number == 0 else None)


_DPI = 150
_COMPRESSION = 2
"""A quarter larger than the smallest file, and made in a third of the time."""


def write_figure(figure: Any, place: Path | BinaryIO, form: str) -> None:
    """Write a figure as "png", "svg" or "pdf"."""
    if form != "png":
        figure.savefig(place, dpi=_DPI, format=form)
        return
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    hold_ticks(figure)
    dpi = figure.get_dpi()
    figure.set_dpi(_DPI)
    try:
        FigureCanvasAgg(figure).print_png(place, pil_kwargs={"compress_level": _COMPRESSION})
    finally:
        figure.set_dpi(dpi)


def hold_ticks(figure: Any) -> None:
    """Keep the ticks of plain axes as they are now; else they are chosen anew some ten times while a figure is laid out and drawn."""
    from matplotlib.ticker import AutoLocator, FixedFormatter, FixedLocator, ScalarFormatter

    for panel in figure.axes:
        panel.apply_aspect()
    for axis in [axis for panel in figure.axes for axis in (panel.xaxis, panel.yaxis)]:
        formatter = axis.get_major_formatter()
        if type(axis.get_major_locator()) is not AutoLocator or type(formatter) is not ScalarFormatter:
            continue
        low, high = sorted(axis.get_view_interval())
        places = [place for place in axis.get_majorticklocs() if low <= place <= high]
        labels = formatter.format_ticks(places)
        if not formatter.get_offset():
            axis.set_major_locator(FixedLocator(places))
            axis.set_major_formatter(FixedFormatter(labels))


_TITLE, _NAMES = 100, 110
"""Characters in a row of the title, and in a row of the legend."""


@dataclass(frozen=True)
class DrawnLine:
    """Points in the units of the axes, with their style; ``dash`` is the length of a dash and of a gap [points], no gap means solid."""

    x: FloatArray
    y: FloatArray
    name: str
    colour: str
    dash: tuple[int, int] = (1, 0)


@dataclass(frozen=True)
class PlotPicture:
    """Lines with the labels and limits of both axes, and the x value of the cursor, if there is one."""

    lines: tuple[DrawnLine, ...]
    x_label: str
    y_label: str
    x_limits: tuple[float, float]
    y_limits: tuple[float, float]
    cursor: float | None = None


def picture_figure(picture: PlotPicture, title: str = "") -> Any:
    """Return a figure with all lines of a picture, within its limits."""
    figure = new_figure(8.0, 4.4)
    panel = figure.subplots()
    for line in picture.lines:
        style = (0.0, line.dash) if line.dash[1] else "solid"
        panel.plot(line.x, line.y, color=line.colour, linewidth=1.2, linestyle=style, label=line.name)
    if picture.cursor is not None:
        panel.axvline(picture.cursor, color=QUIET, linewidth=0.8)
    panel.set_xlim(*picture.x_limits)
    panel.set_ylim(*picture.y_limits)
    dress(panel, picture.y_label, picture.x_label)
    longest = max((len(line.name) + 6 for line in picture.lines), default=1)
    legend(panel, ncols=max(1, min(len(picture.lines), _NAMES // longest)))
    if title:
        figure.suptitle(textwrap.fill(title, _TITLE), fontsize=10, color=INK, x=0.01, ha="left", fontweight="bold")
    return figure
