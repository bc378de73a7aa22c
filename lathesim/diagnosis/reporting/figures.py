"""The figures of the report, as SVG text that stands in the page: a channel with its residual, and the missing force before and after."""

from __future__ import annotations

import io
import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from lathesim.analysis.figure_style import (
    INK,
    MATERIAL,
    MEASURED,
    QUIET,
    REFERENCE,
    SIMULATED,
    common_unit,
    dress,
    label,
    new_figure,
    thinned,
)
from lathesim.diagnosis.records.diagnosis import ChannelTrace, MissingSignal
from lathesim.engine.assembly import FloatArray

WITHOUT = "#9aa3ad"
SUSPECT = "#fbe3e2"
_POINTS = 900
"""Points a line keeps: the page has fewer dots across than that."""
WHOLE, HALF, _HEIGHT = 7.6, 4.3, 2.25
"""Widths of a figure across the page and across half of it, and its height [inch]."""

Windows = Sequence[tuple[float, float]]


def trace_svg(
    trace: ChannelTrace, floor: float, windows: Windows = (), prefix: str = "trace", width: float = HALF, points: int = _POINTS
) -> str:
    """Draw what was recorded over what was simulated without and with what was found, and the residuals below with the floor."""
    figure = new_figure(width, _HEIGHT)
    upper, lower = figure.subplots(2, 1, sharex=True, gridspec_kw={"height_ratios": [1.3, 1.0]})
    changed = not np.array_equal(trace.after, trace.before, equal_nan=True)
    factor, unit = common_unit([trace.recorded, trace.before, trace.after], trace.unit)
    _line(upper, trace.time, trace.recorded / factor, MEASURED, 2.0, points)
    _line(upper, trace.time, trace.before / factor, WITHOUT if changed else SIMULATED, 1.0, points)
    if changed:
        _line(upper, trace.time, trace.after / factor, SIMULATED, 1.0, points)
    dress(upper, label("", unit).strip(), "", trace.channel)
    upper.tick_params(labelbottom=False)
    without, with_it = trace.recorded - trace.before, trace.recorded - trace.after
    factor, unit = common_unit([3.0 * without, 3.0 * with_it], trace.unit)
    if floor > 0.0:
        lower.axhspan(-floor / factor, floor / factor, color=MATERIAL, linewidth=0, zorder=0)
    _line(lower, trace.time, without / factor, WITHOUT if changed else SIMULATED, 0.9, points)
    if changed:
        _line(lower, trace.time, with_it / factor, SIMULATED, 0.9, points)
    dress(lower, label("error", unit), label("time", "s"))
    _mark(lower, windows)
    _fit(upper, trace.time)
    figure.align_ylabels([upper, lower])
    return svg_text(figure, prefix, f"{trace.channel}: recorded and simulated, error below")


def missing_svg(missing: MissingSignal, windows: Windows = (), prefix: str = "missing", width: float = HALF, points: int = _POINTS) -> str:
    """Draw what is missing at a place before and after, and above them all that acts there."""
    figure = new_figure(width, _HEIGHT)
    upper, lower = figure.subplots(2, 1, sharex=True, gridspec_kw={"height_ratios": [1.0, 1.3]})
    if len(missing.total) == len(missing.time):
        factor, unit = common_unit([missing.total], missing.unit)
        _line(upper, missing.time, missing.total / factor, REFERENCE, 1.0, points)
        dress(upper, label("acts\n", unit), "", f"Missing at {missing.at}")
    upper.tick_params(labelbottom=False)
    factor, unit = common_unit([missing.before, missing.after], missing.unit)
    _line(lower, missing.time, missing.before / factor, WITHOUT, 0.9, points)
    _line(lower, missing.time, missing.after / factor, SIMULATED, 0.9, points)
    # on one line both would run into each other in a figure of half a page
    dress(lower, label("missing\n", unit), label("time", "s"))
    _mark(lower, windows)
    _fit(lower, missing.time)
    figure.align_ylabels([upper, lower])
    return svg_text(figure, prefix, f"what is missing at {missing.at}, before and after")


def _line(panel: Any, time: FloatArray, values: FloatArray, color: str, width: float, points: int) -> None:
    panel.plot(*thinned(time, values, points), color=color, linewidth=width)


def _mark(panel: Any, windows: Windows) -> None:
    for begin, end in windows:
        panel.axvspan(begin, end, color=SUSPECT, linewidth=0, zorder=0)


def _fit(panel: Any, time: FloatArray) -> None:
    if len(time) > 1:
        panel.set_xlim(float(time[0]), float(time[-1]))


def svg_text(figure: Any, prefix: str, title: str) -> str:
    """Return a figure as an SVG element with letters as text; its names begin with ``prefix``, so that no two figures clash."""
    import matplotlib

    style = {"svg.fonttype": "none", "svg.hashsalt": prefix, "font.family": "sans-serif", "text.color": INK, "axes.edgecolor": QUIET}
    with matplotlib.rc_context(style):
        file = io.StringIO()
        figure.savefig(file, format="svg", metadata={"Date": None, "Creator": None, "Title": title})
    text = file.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>|<defs>\s*<style.*?</style>\s*</defs>", "", text, flags=re.S)
    text = re.sub(r'\bid="([^"]+)"', rf'id="{prefix}-\1"', text)
    text = re.sub(r"url\(#", f"url(#{prefix}-", text)
    text = re.sub(r'href="#', f'href="#{prefix}-', text)
    head = r'<svg class="figure" role="img" viewBox="\1" xmlns:xlink="http://www.w3.org/1999/xlink">'
    text = re.sub(r'<svg [^>]*?viewBox="([^"]*)"[^>]*>', head, text, count=1)
    return re.sub(r"\s*\n\s*", "\n", text)
