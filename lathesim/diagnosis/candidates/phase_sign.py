"""Which waves to tell half a turn on: one of negative size is the same wave of positive size, with its phase turned by pi."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from lathesim.identification.records import Candidate


def phases_to_turn(candidate: Candidate, values: Mapping[str, float]) -> list[str]:
    """Return the phases (free names) of the waves whose size, or the largest of its sizes by what is usual, is negative.

    The sizes of such a wave change their sign and its phase is turned, see :attr:`Term.waves`; what the effect gives stays what it was.
    """
    usual = dict(zip(candidate.parameters, np.abs(candidate.points).max(axis=0, initial=0.0), strict=True))
    found = []
    for phase, sizes in candidate.waves.items():
        names = [name for name in sizes if name in values and usual[name] > 0.0]
        if names and values[max(names, key=lambda name: abs(values[name]) / usual[name])] < 0.0:
            found.append(phase)
    return found
