"""The path of a part program as a figure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from lathesim.analysis.figures.figure_style import dress, new_figure

Piece = tuple[str, list[float], list[float]]
"""Kind of a move (rapid, feed, thread), its z and its x [mm]."""


_MARGIN = 0.12
"""Share of the cut's size that is shown around it."""


def program_figure(title: str, pieces: Sequence[Piece]) -> Any:
    """Draw the moves of a program in the plane of Z and X (a radius): rapid moves dashed, cuts solid, threads thick.

    The view is that of the cuts; rapid moves that come from further away run out of it.
    """
    figure = new_figure(8.0, 4.5)
    panel = figure.subplots()
    styles = {"rapid": ("C7", "--", 0.8), "thread": ("C3", "-", 2.0)}
    named: set[str] = set()
    for kind, z, x in pieces:
        colour, line, width = styles.get(kind, ("C0", "-", 1.4))
        label = kind if kind not in named else None
        named.add(kind)
        panel.plot(z, x, color=colour, linestyle=line, linewidth=width, label=label)
    cuts = [(z, x) for kind, z, x in pieces if kind != "rapid"] or [(z, x) for _, z, x in pieces]
    if cuts:
        z, x = [value for piece in cuts for value in piece[0]], [value for piece in cuts for value in piece[1]]
        margin = _MARGIN * max(max(z) - min(z), max(x) - min(x), 1.0)
        panel.set_xlim(min(z) - margin, max(z) + margin)
        panel.set_ylim(min(x) - margin, max(x) + margin)
    panel.axhline(0.0, color="C7", linewidth=0.8, linestyle="-.", zorder=0)
    panel.set_aspect("equal", adjustable="datalim")
    panel.set_title(title, fontsize=10)
    if named:
        panel.legend(fontsize=8)
    dress(panel)
    panel.set_xlabel("Z [mm]")
    panel.set_ylabel("X (radius) [mm]")
    return figure
