"""Readings in coarser counts than the lesson's sensor has: seen in the recorded values themselves, which then lie on a grid.

A replay cannot show it, as rounding is noise to it. The values tell it at once: all of them are whole multiples of one spacing.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from lathesim.identification.estimation.estimates import Estimate
from lathesim.identification.records.candidate import Term
from lathesim.identification.replay.experiment import Rig
from lathesim.identification.signal.resolution import FEWEST_LEVELS, OFF_GRID, grid_spacing

_COARSER = 1.5
"""Factor beyond the lesson's own counts from which they are called coarse."""


def coarse_counts(rigs: Sequence[Rig], known: Collection[Term] = ()) -> list[tuple[Term, Estimate]]:
    """Give each effect whose size is the spacing of what a sensor reads, with that spacing, where all recordings show one that is coarser
    than the lesson's sensor has; ``known`` ones are not given again. A sensor that the lesson takes for exact tells nothing: every
    recording keeps only so many digits."""
    seen = [_on_grids(rig) for rig in rigs]
    found = []
    for term in rigs[0].candidates:
        spacings = np.array([grids.get(term.part, 0.0) for grids in seen])
        middle, spread = float(np.mean(spacings)), float(np.ptp(spacings))
        if spread < OFF_GRID * middle and all(term.part != other.part for other in known):
            error = spread + OFF_GRID * middle / FEWEST_LEVELS
            found.append((term, Estimate(middle, error, error)))
    return found


def _on_grids(rig: Rig) -> dict[str, float]:
    found: dict[str, float] = {}
    period = rig.machine.assembly.sample_period
    components = {part.name: part.component for part in rig.machine.assembly.parts}
    for term in (term for term in rig.candidates if term.effect.spacing):
        ports = components[term.at.partition(".")[0]].ports
        # the rate of an encoder is one count a sample, or several
        for role, counts in (("reading", 1.0), ("rate", period)):
            channel = f"{term.at}.{ports.get(role, '')}"
            if channel in rig.machine.compare and (known := _declared(rig, channel, counts)) > 0.0:
                spacing = counts * grid_spacing(rig.record[channel])
                if spacing > _COARSER * known:
                    found.setdefault(term.part, spacing)
    return found


def _declared(rig: Rig, channel: str, counts: float) -> float:
    """Give the counts [SI] in which a sensor reads as far as the lesson tells, 0 where it does not; ``counts`` make one unit of the
    channel."""
    part = next(part for part in rig.machine.assembly.parts if part.name == channel.partition(".")[0])
    name = part.component.ports.get("resolution", "")
    return max(rig.own.given(f"{part.name}.{name}") if name else 0.0, counts * rig.machine.resolution.get(channel, 0.0))
