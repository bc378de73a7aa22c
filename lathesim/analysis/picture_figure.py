"""Draw the lines of a plot on the screen as a figure."""

from __future__ import annotations

import re
import textwrap
from dataclasses import dataclass
from typing import Any

from lathesim.analysis.figure_style import INK, QUIET, dress, legend, new_figure
from lathesim.record import FloatArray

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
        panel.plot(line.x, line.y, color=line.colour, linewidth=1.2, linestyle=style, label=_signed(line.name))
    if picture.cursor is not None:
        panel.axvline(picture.cursor, color=QUIET, linewidth=0.8)
    panel.set_xlim(*picture.x_limits)
    panel.set_ylim(*picture.y_limits)
    dress(panel, _signed(picture.y_label), _signed(picture.x_label))
    longest = max((len(line.name) + 6 for line in picture.lines), default=1)
    legend(panel, ncols=max(1, min(len(picture.lines), _NAMES // longest)))
    if title:
        figure.suptitle(textwrap.fill(title, _TITLE), fontsize=10, color=INK, x=0.01, ha="left", fontweight="bold")
    return figure


def _signed(text: str) -> str:
    """Return a text with the micro sign in its units: ``um`` becomes ``µm``."""
    return re.sub(r"\bu(?=[msA]\b)", "µ", text)
