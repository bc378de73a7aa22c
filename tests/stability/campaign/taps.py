"""Tap tests of a tool point with three modes, and of one with a close pair: errors, intervals, double hits, numbers of modes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.stability.choose_modes import find_modes
from lathesim.stability.lesson_settings import tap_until_good
from lathesim.stability.tap import TapSettings, judged_hits, tap
from lathesim.stability.tool_point import Mode, ToolPoint
from tests.stability.campaign.results import collected

THREE = ToolPoint((Mode(150.0, 0.02, 8e6), Mode(420.0, 0.035, 3e7), Mode(1180.0, 0.012, 9e7)), (1.0, 1.0, 1.0))
PAIR = ToolPoint((Mode(150.0, 0.02, 8e6), Mode(154.5, 0.02, 8e6)), (1.0, 1.0))
_DOUBLE_HITS = 0.25
NAMES = ("frequency", "damping", "stiffness")


def measured(group: str, number: int) -> dict[str, Any]:
    """Return what a tap test taught: ``three`` modes, a close ``pair``, or ``hits`` that may be double ones."""
    seed = 20_000 + number
    if group == "hits":
        record = tap(THREE, TapSettings(double_hits=_DOUBLE_HITS, length=0.5, hits=5), seed)
        return {"told": [bool(hit.reason) for hit in judged_hits(record)], "true": [bool(double) for double in record.truth]}
    tool = PAIR if group == "pair" else THREE
    # the number of modes given, the search for it is saved: the last fit is the same
    count = len(tool.modes) if group == "intervals" else None
    found = find_modes(tap_until_good(tool, TapSettings(double_hits=_DOUBLE_HITS), seed).response, count)
    rows = []
    if len(found.modes) == len(tool.modes):
        for mode, true in zip(found.modes, tool.modes, strict=True):
            estimates = [getattr(mode, name) for name in NAMES]
            values = [getattr(true, name) for name in NAMES]
            rows.append(
                [
                    [e.value / value - 1.0, bool(e.low <= value <= e.high), e.high / e.low - 1.0]
                    for e, value in zip(estimates, values, strict=True)
                ]
            )
    return {"modes": len(found.modes), "estimates": rows}


def run(draws: Sequence[int], path: Path, only: str = "") -> None:
    """Measure so many draws of each kind and print what they show; ``intervals`` alone are those of three modes, their number given."""
    if only == "intervals":
        _print("three modes, their number given", collected(path, ((only, number) for number in draws), measured), 3)
        return
    hits = collected(path, (("hits", number) for number in draws), measured)
    three = collected(path, (("three", number) for number in draws), measured)
    pair = collected(path, (("pair", number) for number in draws), measured)
    told = np.concatenate([row["told"] for row in hits]).astype(bool)
    true = np.concatenate([row["true"] for row in hits]).astype(bool)
    print(f"double hits: {np.sum(told & true)} of {np.sum(true)} found; {np.sum(told & ~true)} of {np.sum(~true)} single hits left out")
    _print("three modes", three, 3)
    _print("close pair", pair, 2)


def _print(title: str, rows: list[dict[str, Any]], right: int) -> None:
    if rows:
        count = sum(row["modes"] == right for row in rows)
        print(f"{title}: {count} of {len(rows)} draws told as {right}")
        table = np.array([row["estimates"] for row in rows if row["modes"] == right], dtype=np.float64)
        if not len(table):
            return
        for place, name in enumerate(NAMES):
            errors = 100.0 * np.abs(table[:, :, place, 0])
            held = 100.0 * table[:, :, place, 1].mean()
            print(f"  {name:<10} median error {np.median(errors):.2g} %, largest {errors.max():.2g} %; intervals hold {held:.1f} %")
        print(f"  all intervals hold {100.0 * table[..., 1].mean():.1f} %")
