"""Readings in coarser counts than the lesson's sensor has: seen in the recorded values themselves, which then lie on a grid.

A replay cannot show it, as rounding is noise to it. The values tell it at once: all of them are whole multiples of one spacing.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from lathesim.diagnosis.parameters import Estimate
from lathesim.diagnosis.problem import Rig
from lathesim.diagnosis.terms import Term
from lathesim.engine.assembly import FloatArray

_FEWEST_LEVELS = 20
_OFF_GRID = 0.02
"""How far, in spacings, a value may lie beside the grid: the recording's last digit."""
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
        if spread < _OFF_GRID * middle and all(term.part != other.part for other in known):
            error = spread + _OFF_GRID * middle / _FEWEST_LEVELS
            found.append((term, Estimate(middle, error, error)))
    return found


def grid_spacing(values: FloatArray) -> float:
    """Give the spacing of a grid on which all values (samples,) lie; 0 where there is none, or too few levels to tell."""
    finite = values[np.isfinite(values)]
    levels = np.unique(finite)
    if len(levels) < _FEWEST_LEVELS:
        return 0.0
    gaps = np.diff(levels)
    smallest = float(np.min(gaps))
    spacing = float(np.median(gaps[gaps < 1.5 * smallest]))
    for reach in (100.0, np.inf):
        # the last digit makes the first spacing a little wrong, and over many counts that adds up
        near = levels - levels[0] if np.isinf(reach) else (gaps[gaps < reach * spacing])
        counts = np.round(near / spacing)
        spacing = float(near @ counts / (counts @ counts))
    off = np.abs((levels - levels[0]) / spacing - np.round((levels - levels[0]) / spacing))
    return spacing if float(np.max(off)) < _OFF_GRID else 0.0


def _on_grids(rig: Rig) -> dict[str, float]:
    found = {}
    for term in rig.candidates:
        channel = next((name for name in rig.machine.compare if name.partition(".")[0] == term.at), "")
        counts = _declared(rig, channel) if term.effect.spacing and channel else 0.0
        if counts > 0.0 and (spacing := grid_spacing(rig.record[channel])) > _COARSER * counts:
            found[term.part] = spacing
    return found


def _declared(rig: Rig, channel: str) -> float:
    """Give the counts [SI] in which a channel reads as far as the lesson tells, 0 where it does not."""
    part = next(part for part in rig.machine.assembly.parts if part.name == channel.partition(".")[0])
    name = part.component.ports.get("resolution", "")
    return max(rig.own.given(f"{part.name}.{name}") if name else 0.0, rig.machine.resolution.get(channel, 0.0))
