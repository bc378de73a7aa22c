"""Kinds of vibration named on cuts of rigs of a tuning and of a test half, false alarms, and how early chatter is told."""

from __future__ import annotations

import collections
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.errors import LatheSimError
from lathesim.stability.diagnose_cut import RecordedCut, cutting_stretch, diagnose_cut, difference_sizes, first_sign
from tests.stability.campaign.results import collected
from tests.stability.campaign.rig_cuts import KINDS, Recording, recording

_CHATTER = ("hopf", "flip")


def as_recorded(made: Recording) -> RecordedCut:
    """Return a recording as the command reads it."""
    first, last = cutting_stretch(made.signal, made.rate, made.speed / 60.0)
    before = made.signal[: max(0, first - int(0.1 * made.rate))]
    return RecordedCut(made.rig.sensor, made.signal[first:last], before, made.rate, made.speed / 60.0)


def measured(half: str, number: int) -> dict[str, Any]:
    """Return what is said of a cut on a rig of a half, with the modes of the rig told (``known``) and not (``untold``)."""
    made = recording(KINDS[number % len(KINDS)], number, half)
    cut = as_recorded(made)
    row: dict[str, Any] = {"kind": made.kind, "sensor": made.rig.sensor, "speed": made.speed}
    try:
        found = diagnose_cut(cut, tuple(mode[0] for mode in made.rig.modes))
        untold = diagnose_cut(cut).judged.kind
    except LatheSimError as error:
        return {**row, "known": str(error), "untold": str(error), "told_share": None}
    vibration = found.vibration
    mean = abs(float(cut.values.mean())) if vibration.modulation > 0.0 else 0.0
    sizes = difference_sizes(vibration.values, cut.rate / vibration.turning)
    chatters = made.kind in _CHATTER
    return {
        **row,
        "known": found.judged.kind,
        "untold": untold,
        "reasons": found.judged.reasons,
        "told_share": found.told_share if np.isfinite(found.told_share) else None,
        "sign": not chatters and first_sign(vibration.values, cut.rate, vibration.turning, mean) is not None,
        "set_in": bool(sizes[0] > np.quantile(sizes, 0.95) / 3.0),
    }


def run(cases: Sequence[int], half: str, path: Path) -> None:
    """Measure so many cuts of a half and print what they show.

    Chatter that is above a third of its final amplitude in the first turns of a recording cannot be told before that, and is counted apart.
    """
    rows = collected(path, ((half, number) for number in cases), measured)
    others = [row for row in rows if row["kind"] not in _CHATTER]
    for told in ("known", "untold"):
        right = sum(row["kind"] == row[told] for row in rows)
        alarms = sum(row[told] in _CHATTER for row in others)
        print(f"{half} rigs, modes {told}: right {right} of {len(rows)} ({100.0 * right / len(rows):.1f} %)")
        print(f"  false alarms {alarms} of {len(others)}")
        wrong = collections.Counter((row["kind"], row[told]) for row in rows if row["kind"] != row[told])
        for (kind, said), count in sorted(wrong.items()):
            print(
                f"  {kind} said to be {said}: {count}   cases {[row['case'] for row in rows if (row['kind'], row[told]) == (kind, said)]}"
            )
    grown = [row for row in rows if row["kind"] in _CHATTER and not row.get("set_in")]
    early = sum(row["told_share"] is not None and row["told_share"] < 1.0 / 3.0 for row in grown)
    print(f"told before a third of the final amplitude: {early} of {len(grown)} whose growth was recorded")
    print(f"early signs in cuts without chatter: {sum(row.get('sign', False) for row in others)} of {len(others)}")
