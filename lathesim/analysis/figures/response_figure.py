"""A frequency response as a figure: real and imaginary part, size, and coherence where it is known."""

from __future__ import annotations

from typing import Any

import numpy as np

from lathesim.analysis.figures.figure_style import ALERT, MEASURED, QUIET, SIMULATED, dress, legend, new_figure


def response_figure(
    title: str, frequency: Any, receptance: Any, *, model: Any = None, coherence: Any = None, band: Any = None, modes: Any = ()
) -> Any:
    """Draw a receptance [m/N] over frequency [Hz], with that of a fitted ``model`` and the natural frequencies of its ``modes``.

    ``band`` are the bounds of its size, (2, lines).
    """
    figure = new_figure(8.0, 6.4 if coherence is not None else 5.4)
    panels = figure.subplots(4 if coherence is not None else 3, 1, sharex=True)
    micro = 1e6
    name = "computed" if model is None and coherence is None else "measured"
    for panel, part, label in ((panels[0], np.real, "Re H [µm/N]"), (panels[1], np.imag, "Im H [µm/N]"), (panels[2], np.abs, "|H| [µm/N]")):
        panel.plot(frequency, micro * part(receptance), color=MEASURED, linewidth=1.2, label=name)
        if model is not None:
            panel.plot(frequency, micro * part(model), color=SIMULATED, linewidth=1.0, linestyle="--", label="fitted modes")
        for place in modes:
            panel.axvline(place, color=QUIET, linewidth=0.7, zorder=0)
        dress(panel, label)
    panels[2].set_yscale("log")
    if band is not None:
        panels[2].fill_between(frequency, micro * band[0], micro * band[1], color=SIMULATED, alpha=0.2, linewidth=0, label="95 %")
    if coherence is not None:
        panels[3].plot(frequency, coherence, color=ALERT, linewidth=0.8)
        panels[3].set_ylim(0.0, 1.05)
        dress(panels[3], "coherence")
    panels[-1].set_xlabel("frequency [Hz]", fontsize=9)
    dress(panels[0], "Re H [µm/N]", title=title)
    legend(panels[2] if band is not None else panels[0])
    return figure
