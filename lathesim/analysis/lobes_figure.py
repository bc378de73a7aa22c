"""Stability lobes as a figure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from lathesim.analysis.figure_style import dress, new_figure


def lobes_figure(title: str, speeds: Sequence[float], widths: Sequence[float], smallest: float) -> Any:
    """Draw the limit of the chip width [mm] over the speed [rpm]; above the line the cut chatters."""
    figure = new_figure(8.0, 4.5)
    panel = figure.subplots()
    shown = np.where(np.isfinite(widths), widths, np.nan)
    top = 4.0 * smallest if np.isfinite(smallest) else float(np.nanmax(shown))
    panel.plot(speeds, shown, color="C0")
    panel.fill_between(speeds, shown, top, color="C3", alpha=0.12, label="chatter")
    panel.axhline(smallest, color="C7", linestyle="--", linewidth=0.8, label=f"stable at every speed below {smallest:.3g} mm")
    panel.set_ylim(0.0, top)
    panel.legend(fontsize=8)
    dress(panel, "chip width [mm]", "spindle speed [rpm]", title)
    return figure
