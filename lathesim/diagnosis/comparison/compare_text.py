"""A comparison as a person reads it: tables, where the mismatch sits, and what it depends on."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from lathesim.analysis.display_unit import known_share, plain_number, shown_with_unit, text_table
from lathesim.analysis.figure_style import (
    ALERT,
    INK,
    MATERIAL,
    MEASURED,
    QUIET,
    RESIDUAL,
    SIMULATED,
    common_unit,
    dress,
    label,
    legend,
    new_figure,
    thinned,
)
from lathesim.diagnosis.comparison.compare import ChannelResidual, Comparison, Dependence
from lathesim.diagnosis.explanations.conditions import ONE_SPEED
from lathesim.diagnosis.records.shown import Shown


def comparison_lines(comparison: Comparison) -> list[str]:
    """Return a comparison as a person reads it."""
    lines = [f"Recording: {text}" for text in comparison.findings]
    lines += [""] * bool(lines)
    lines += text_table(_channel_rows(comparison))
    if any(item.is_lost for item in comparison.channels):
        return [*lines, "", "So the place of the mismatch is unknown."]
    lines += ["", "Every part with the inputs that were recorded:", *text_table(_replay_rows(comparison))]
    if any(math.isnan(item.missing) for item in comparison.replayed):
        lines.append("Not known: the noise of the reading, turned into a force, would be as large.")
    lines += ["", *mismatch_sentences(comparison)]
    if comparison.adds_up:
        lines.append("Each part leaves next to nothing. Run by itself, with no recording to hold it, the simulation adds that up.")
    if comparison.explained_by:
        lines += ["", "What is missing depends on (learned on one half, scored on the other):"]
        lines += [f"  {'#' * round(20 * min(1.0, item.share)):<20} {item.share:4.0%}  {item.variable}" for item in comparison.explained_by]
        lines += [ONE_SPEED] * any(item.or_else for item in comparison.explained_by)
    return lines


def mismatch_sentences(comparison: Comparison) -> list[str]:
    """Return where the mismatch sits, and how much that means."""
    sits = " and in ".join(comparison.suspects)
    if comparison.faults:
        return ["The recording itself is at fault; until that is mended the rest says little of the machine."]
    if not sits:
        return ["No part is off by itself."]
    if comparison.within_floors:
        within = f"Nothing is wrong that this shows: the lesson's own simulation is within {comparison.off:g} times the noise."
        return [f"{within} What little is left sits in {sits}."]
    because = "a load that nobody measured, or another of its uncertain values, may be all of it."
    return [f"The mismatch sits in {sits}. Values are as the lesson has them: {because}"]


def _channel_rows(comparison: Comparison) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = [("channel", "error, rms", "noise", "error / noise", "worst")]
    for item in comparison.channels:
        shown = [shown_with_unit(value, item.unit, 3) for value in (item.rms, item.floor)]
        if item.is_empty or item.is_lost:
            rows.append((item.channel, "-", shown[1], "-", "-"))
        else:
            rows.append((item.channel, *shown, f"{item.over_floor:.3g}", f"{item.worst[0]:.4g} to {item.worst[1]:.4g} s"))
    return rows


def _replay_rows(comparison: Comparison) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = [("channel", "made by", "missing at", "rms", "of what acts there")]
    for item in comparison.replayed:
        known = known_share(item.share)
        share = f"{known:.2%}" if known == known else "-"
        made_by = _chain(item.parts, Shown.nearest_parts)
        size = "not known" if math.isnan(item.missing) else shown_with_unit(item.missing, item.unit, 3)
        rows.append((item.channel, made_by, item.at, size, share))
    return rows


def _chain(parts: Sequence[str], nearest: int) -> str:
    """Return the parts that make a channel, the nearest first; of a whole machine only these."""
    more = len(parts) - nearest
    shown = " <- ".join(parts[:nearest] if more > 1 else parts)
    return f"{shown} <- {more} more" if more > 1 else shown


_MOST = {"channels": 3, "bars": 6}
_HEIGHTS = {"titles": 1.0, "channel": 2.3, "bar": 0.34, "frame": 1.0}
"""Heights of what is drawn [inch]; the bars have a frame around them."""


def compare_figure(comparison: Comparison) -> Any:
    """Draw a comparison on one page: channels at the left, what explains them at the right."""
    shown = comparison.channels[: _MOST["channels"]]
    bars = comparison.explained_by[: _MOST["bars"]]
    right = _HEIGHTS["frame"] + _HEIGHTS["bar"] * len(bars) if bars else 0.0
    figure = new_figure(11.0 if bars else 8.0, _HEIGHTS["titles"] + max(_HEIGHTS["channel"] * len(shown), right))
    if bars:
        left_part, right_part = figure.subfigures(1, 2, width_ratios=[1.55, 1.0])
    else:
        left_part, right_part = figure, None
    panels = left_part.subplots(2 * len(shown), 1, sharex=True, squeeze=False, gridspec_kw={"height_ratios": [1.5, 1.0] * len(shown)})[:, 0]
    for place, item in enumerate(shown):
        _draw_channel(panels[2 * place], panels[2 * place + 1], item, comparison.off)
    panels[-1].set_xlabel(label("time", "s"), fontsize=9, color=INK)
    title = f"{comparison.lesson} against {comparison.recording}"
    figure.suptitle(title, fontsize=11, color=INK, x=0.01, ha="left", fontweight="bold")
    if right_part is not None:
        _draw_bars(right_part.subplots(), bars)
    return figure


def _draw_channel(upper: Any, lower: Any, item: ChannelResidual, off: float) -> None:
    factor, unit = common_unit([item.recorded, item.simulated], item.unit)
    upper.plot(*thinned(item.time, item.recorded / factor), color=MEASURED, linewidth=1.8, label="recorded")
    upper.plot(*thinned(item.time, item.simulated / factor), color=SIMULATED, linewidth=1.0, label="simulated")
    dress(upper, label("", unit).strip(), "", item.channel)
    legend(upper)
    factor, unit = common_unit([3.0 * item.residual], item.unit)
    lower.axhspan(-item.floor / factor, item.floor / factor, color=MATERIAL, linewidth=0, zorder=0)
    lower.axvspan(*item.worst, color="#fbe3e2", linewidth=0, zorder=0)
    lower.plot(*thinned(item.time, item.residual / factor), color=RESIDUAL, linewidth=0.9)
    dress(lower, label("residual", unit))
    lower.text(
        1.0, 1.02, f"{plain_number(item.over_floor, 3)} times the noise", transform=lower.transAxes, ha="right", va="bottom", fontsize=8.5,
        color=ALERT if item.over_floor > off else QUIET,
    )  # fmt: skip


def _draw_bars(panel: Any, chosen: Sequence[Dependence]) -> None:
    places = np.arange(len(chosen))
    panel.barh(places + 0.2, [100.0 * item.share for item in chosen], height=0.32, color=ALERT)
    for place, item in zip(places, chosen, strict=True):
        panel.text(0.0, place - 0.06, item.variable, fontsize=8.5, color=INK, va="bottom")
    panel.set_ylim(len(chosen) - 0.4, -0.6)
    panel.set_xlim(0.0, 100.0)
    dress(panel, "", "share of what is missing [%]", "Depends on")
    panel.grid(False, axis="y")
    panel.set_yticks([])
