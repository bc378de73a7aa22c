"""The picture of a designed experiment: what differs where between the rivals, and the programs that it was chosen from."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from lathesim.analysis.figures.figure_style import ALERT, CYCLE, QUIET, REFERENCE, common_unit, dress, label, legend, new_figure
from lathesim.record import FloatArray


def experiment_figure(
    title: str, rivals: Sequence[str], channels: Sequence[str], units: Sequence[str], traces: FloatArray, seconds: float,
    floors: FloatArray, tried: Sequence[tuple[str, float, float]], chosen: tuple[float, float],
) -> Any:  # fmt: skip
    """Draw the motion, for each channel how each rival differs from the first, and all programs tried over their length."""
    rows = len(channels) + 2
    figure = new_figure(8.5, 1.9 * rows + 0.5)
    panels = figure.subplots(rows, 1)
    time = np.linspace(0.0, seconds, traces.shape[2])
    factor, unit = common_unit([traces[0, 0]], units[0])
    panels[0].plot(time, traces[0, 0] / factor, color=REFERENCE, linewidth=0.9)
    dress(panels[0], label(channels[0].partition(".")[0], unit), "", f"{title}: the program that tells most")
    for row, (channel, own) in enumerate(zip(channels, units, strict=True)):
        panel = panels[row + 1]
        differences = [traces[number, row] - traces[0, row] for number in range(1, len(rivals))]
        factor, unit = common_unit([*differences, np.array([floors[row]])], own)
        for number, difference in enumerate(differences, 1):
            panel.plot(time, difference / factor, color=CYCLE[number % len(CYCLE)], linewidth=0.9, label=f"{rivals[number]} - {rivals[0]}")
        panel.axhspan(-floors[row] / factor, floors[row] / factor, color=QUIET, alpha=0.3, linewidth=0, label="noise")
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
