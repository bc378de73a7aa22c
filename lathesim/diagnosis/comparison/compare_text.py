"""A comparison as a person reads it: tables, where the mismatch sits, and what it depends on."""

from __future__ import annotations

import math
from collections.abc import Sequence

from lathesim.analysis.display_unit import known_share, shown_with_unit, text_table
from lathesim.diagnosis.comparison.compare import Comparison
from lathesim.diagnosis.explanations.one_speed import ONE_SPEED
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
        lines += [f"  {_bar(item.share)} {item.share:4.0%}  {item.variable}" for item in comparison.explained_by]
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


def _bar(share: float) -> str:
    return f"{'#' * round(20 * min(1.0, share)):<20}"
