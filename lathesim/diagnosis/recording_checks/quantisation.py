"""Readings in coarser counts than the lesson's sensor has: seen in the recorded values themselves, which then lie on a grid.

A replay cannot show it, as rounding is noise to it. The values tell it at once: all of them are whole multiples of one spacing.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from lathesim.diagnosis.method import STANDARD, Method
from lathesim.engine.assembly import Place
from lathesim.identification.estimation.estimates import Estimate
from lathesim.identification.records import Candidate
from lathesim.identification.replay.experiment import Experiment
from lathesim.identification.signal import FEWEST_LEVELS, OFF_GRID, grid_spacing


def coarse_counts(
    experiments: Sequence[Experiment], known: Collection[Candidate] = (), method: Method = STANDARD
) -> list[tuple[Candidate, Estimate]]:
    """Return each effect whose size is the spacing of what a sensor reads, with that spacing, where all recordings show one that is coarser
    than the lesson's sensor has; ``known`` ones are not given again. A sensor that the lesson takes for exact tells nothing: every
    recording keeps only so many digits."""
    seen = [_on_grids(experiment, method=method) for experiment in experiments]
    found = []
    for candidate in experiments[0].candidates:
        spacings = np.array([grids.get(candidate.part, 0.0) for grids in seen])
        middle, spread = float(np.mean(spacings)), float(np.ptp(spacings))
        if spread < OFF_GRID * middle and all(candidate.part != other.part for other in known):
            error = spread + OFF_GRID * middle / FEWEST_LEVELS
            found.append((candidate, Estimate(middle, error, error)))
    return found


def _on_grids(experiment: Experiment, method: Method = STANDARD) -> dict[str, float]:
    found: dict[str, float] = {}
    period = experiment.machine.assembly.sample_period
    for candidate in (candidate for candidate in experiment.candidates if candidate.effect.identification.spacing):
        ports = experiment.machine.assembly.ports(candidate.at)
        # the rate of an encoder is one count a sample, or several
        for role, counts in (("reading", 1.0), ("rate", period)):
            channel = f"{candidate.at}.{ports.get(role, '')}"
            if channel in experiment.machine.compare and (known := _declared(experiment, channel, counts)) > 0.0:
                spacing = counts * grid_spacing(experiment.record[channel])
                if spacing > method.alike * known:
                    found.setdefault(candidate.part, spacing)
    return found


def _declared(experiment: Experiment, channel: str, counts: float) -> float:
    """Return the counts [SI] in which a sensor reads as far as the lesson tells, 0 where it does not; ``counts`` make one unit of the
    channel."""
    name = experiment.machine.assembly.ports(channel).get("resolution", "")
    return max(
        experiment.own.given(f"{Place.of(channel).part}.{name}") if name else 0.0, counts * experiment.machine.resolution.get(channel, 0.0)
    )
