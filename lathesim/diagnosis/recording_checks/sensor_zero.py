"""Where a second sensor of one motion has its zero: nowhere near that of the first one, on most machines, which is no error of either."""

from __future__ import annotations

import numpy as np

from lathesim.analysis.display_unit import shown_with_unit
from lathesim.identification.replay.experiment import Rig

_PLAINLY = 10.0
"""Floors, and times what the two differ by otherwise, from which on the zero is told."""


def zeros_told(rig: Rig) -> list[str]:
    """Give a sentence for each second sensor whose zero plainly lies elsewhere than that of the first."""
    told = []
    for row, (first, apart) in rig.sensed.zeros().items():
        spread = float(np.std(rig.sensed.seen[row][np.isfinite(rig.sensed.seen[row])]))
        if abs(apart) > _PLAINLY * max(spread, float(rig.sensed.seen_floors[row])):
            name, other = rig.machine.compare[row], rig.machine.compare[first]
            shown = shown_with_unit(abs(apart), rig.sensed.plan.unit(rig.sensed.channels[row]), 3)
            told.append(f"{name} has its zero {shown} beside that of {other}; taken for no error of either.")
    return told
