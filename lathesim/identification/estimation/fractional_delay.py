"""A delay that got stuck at a whole number of samples.

What is read at the sample instants changes by a whole sample where a delay comes to one: there the slope of a fit is a wall, and on which
side of it the best value lies it cannot see. In the middle between two samples it can.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lathesim.identification.noise.noise_model import whitened_power
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.records.fit import Fitted, Free, with_start
from lathesim.identification.replay.experiment import Experiment

_NEIGHBOURS = range(-1, 2)
"""Samples before and after the one in which a delay ended whose middles are looked at."""


def between_samples(experiment: Experiment, fitted: Fitted, candidates: Sequence[Candidate], *, full_band: bool) -> list[Free] | None:
    """Return the free parameters of a fit with a delay in the middle between two samples, where that leaves less than the fit does; none
    where it does nowhere."""
    period = experiment.machine.assembly.sample_period
    names = [
        f"{candidate.part}.{candidate.effect.identification.whole_samples}"
        for candidate in candidates
        if candidate.effect.identification.whole_samples
    ]
    free = with_start(fitted)
    found = None
    for name in (name for name in names if name in fitted.by_name):
        ended = fitted.by_name[name]
        middles = [(np.floor(ended / period) + by + 0.5) * period for by in _NEIGHBOURS]
        asked = list(fitted.by_name)
        rows = np.array([[value if one == name else fitted.by_name[one] for one in asked] for value in (ended, *middles) if value > 0.0])
        left = [whitened_power(residual, fitted.noise, full_band=full_band) for residual in experiment.sensed.residuals(asked, rows)]
        best = int(np.argmin(left))
        if best:
            start = float(rows[best, asked.index(name)])
            found = [replace(item, start=start) if item.name == name else item for item in found or free]
    return found
