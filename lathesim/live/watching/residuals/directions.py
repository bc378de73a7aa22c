"""The directions in which a residual may change: what it is multiplied with when a machine changes.

A friction changes a residual with the sign of motion, a delay with the speed, a gain in proportion to the channel itself, an offset at all
times. A block in which a direction is hardly seen tells little about it: accelerating blocks tell gains, cruising ones do not.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lathesim.engine.assembly import Place
from lathesim.live.watching.residuals.residual_stream import Residual
from lathesim.record import FloatArray


def direction_names(drive: Sequence[str]) -> tuple[str, ...]:
    """Return what the directions are called in a sentence, in the order of :func:`directions`."""
    several = len(drive) > 1
    names = ["at all times"]
    for name in drive:
        of = f" of {Place.of(name).part}" if several else ""
        names += [f"moving backwards{of}", f"moving forwards{of}", f"in proportion to the speed{of}"]
    return (*names, "in proportion to its value")


def directions(residual: Residual, still: FloatArray, scale: FloatArray) -> FloatArray:
    """Return the directions (channels, directions, samples): 1, backwards, forwards and speed of each drive, and the channel's own value.

    Slower than ``still`` (drives,) [per sample] a drive stands; ``scale`` (drives + channels,) is what speeds and values are divided by.
    """
    speed = residual.speed
    count = len(speed)
    shared = [np.ones(speed.shape[1])]
    for row, slowest, largest in zip(speed, still, scale[:count], strict=True):
        shared += [(row < -slowest).astype(np.float64), (row > slowest).astype(np.float64), row / largest]
    own = residual.simulated / scale[count:, None]
    common = np.broadcast_to(np.array(shared), (len(own), len(shared), own.shape[1]))
    return np.concatenate([common, own[:, None, :]], axis=1)
