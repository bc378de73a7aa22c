"""The path of a part program as a figure."""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterable
from typing import Any

import numpy as np

from lathesim.analysis.figures.figure_style import dress, legend, new_figure

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
