"""The path of a part program as a figure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from lathesim.analysis.figure_style import dress, new_figure

Piece = tuple[str, list[float], list[float]]
"""Kind of a move (rapid, feed, thread), its z and its x [mm]."""


def program_figure(title: str, pieces: Sequence[Piece]) -> Any:
    """Draw the moves of a program in the plane of Z and X (a radius): rapid moves dashed, cuts solid, threads thick."""
    figure = new_figure(8.0, 4.5)
    panel = figure.subplots()
    styles = {"rapid": ("C7", "--", 0.8), "thread": ("C3", "-", 2.0)}
    named: set[str] = set()
    for kind, z, x in pieces:
        colour, line, width = styles.get(kind, ("C0", "-", 1.4))
        label = kind if kind not in named else None
        named.add(kind)
        panel.plot(z, x, color=colour, linestyle=line, linewidth=width, label=label)
    panel.set_aspect("equal", adjustable="datalim")
    panel.set_xlabel("Z [mm]")
    panel.set_ylabel("X (radius) [mm]")
    panel.set_title(title, fontsize=10)
    if named:
        panel.legend(fontsize=8)
    dress(panel)
    return figure
