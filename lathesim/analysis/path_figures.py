"""Figures of paths: the circular test, and the path of a part program."""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from lathesim.analysis.circular_test import Circle
from lathesim.analysis.display_unit import display_unit
from lathesim.analysis.figure_style import CYCLE, GRID, INK, QUIET, REFERENCE, dress, label, legend, new_figure

_ROUNDING = 1e-9


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
    step = next(power * factor for factor in (5.0, 2.0, 1.0) if power * factor <= largest * (1.0 + _ROUNDING))
    return [float(step)]


Piece = tuple[str, list[float], list[float]]
"""Kind of a move (rapid, feed, thread), its z and its x [mm]."""
Line = tuple["array[float]", "array[float]"]
"""z and x [mm]."""

_MARGIN = 0.12
"""Share of the cut's size that is shown around it."""
_LONGEST = 10_000
"""Largest number of points of one line (assumed): the renderer of matplotlib fails on lines that cross too many cells."""
_STYLES = {"rapid": ("C7", "--", 0.8), "thread": ("C3", "-", 2.0)}
_FEED = ("C0", "-", 1.4)


def program_figure(title: str, pieces: Iterable[Piece]) -> Any:
    """Draw the moves of a program in the plane of Z and X (a radius): rapid moves dashed, cuts solid, threads thick.

    Moves of one kind are one line with gaps, so that long programs are drawn quickly. The view shows the cuts; rapid moves from further
    away leave it.
    """
    figure = new_figure(8.0, 4.5)
    panel = figure.subplots()
    panel.axhline(0.0, color="C7", linewidth=0.8, linestyle="-.", zorder=0)
    lines = _lines(pieces)
    for kind, (z, x) in lines.items():
        colour, line, width = _STYLES.get(kind, _FEED)
        for first in range(0, max(1, len(z) - 1), _LONGEST):
            part = slice(first, first + _LONGEST + 1)
            panel.plot(z[part], x[part], color=colour, linestyle=line, linewidth=width, label=kind if first == 0 else None)
    panel.set_aspect("equal", adjustable="datalim")
    _show_cuts(panel, [line for kind, line in lines.items() if kind != "rapid"] or list(lines.values()))
    panel.set_title(title, fontsize=10, loc="left")
    legend(panel)
    dress(panel)
    panel.set_xlabel("Z [mm]")
    panel.set_ylabel("X (radius) [mm]")
    return figure


def _lines(pieces: Iterable[Piece]) -> dict[str, Line]:
    """Return z and x [mm] of all moves of each kind, with NaN as a gap if a move does not begin at the end of the previous one."""
    lines: dict[str, Line] = {}
    for kind, z, x in pieces:
        if kind == "dwell":
            continue
        line = lines.setdefault(kind, (array("d"), array("d")))
        goes_on = bool(line[0]) and (line[0][-1], line[1][-1]) == (z[0], x[0])
        for values, more in zip(line, (z, x), strict=True):
            if not goes_on and values:
                values.append(math.nan)
            values.extend(more[1:] if goes_on else more)
    return lines


def _show_cuts(panel: Any, lines: list[Line]) -> None:
    """Set the view around the given lines; it may still grow along one axis, because both axes have the same scale."""
    if not lines:
        return
    z, x = (np.concatenate([np.asarray(line[axis]) for line in lines]) for axis in (0, 1))
    z_low, z_high, x_low, x_high = np.nanmin(z), np.nanmax(z), np.nanmin(x), np.nanmax(x)
    margin = _MARGIN * max(z_high - z_low, x_high - x_low, 1.0)
    panel.set_xlim(z_low - margin, z_high + margin, auto=True)
    panel.set_ylim(x_low - margin, x_high + margin, auto=True)
