"""Whether what a machine leaves of way-points is noise, or shows that something of its structure is missing."""

from __future__ import annotations

import numpy as np

from lathesim.engine.assembly import FloatArray
from lathesim.experiments.emulation.objective import Objective

_LAGS = 8
_CHANCE = 1e-3
"""Probability below which what is left is no noise; assumed."""


def is_noise(objective: Objective, point: FloatArray, slopes: FloatArray | None = None) -> bool:
    """Return whether the deviations of each channel are as large and as unrelated in motion as at rest.

    Two tests: their autocorrelation over eight way-points (Ljung and Box, Biometrika 65, 1978), and their size among the fifth of the
    way-points where the values have most to show against the other half (an F test).
    """
    from scipy.stats import chi2, f

    busyness = np.square(objective.slopes(point) if slopes is None else slopes).sum(axis=1)
    taken = 0
    for deviation in objective.news(point):
        for row in deviation[0]:
            activity = busyness[taken : taken + len(row)]
            taken += len(row)
            if not np.any(activity) or len(row) < 40:
                continue
            centred = row - row.mean()
            power = float(np.square(centred).sum())
            if power == 0.0:
                continue
            related = [float((centred[lag:] * centred[:-lag]).sum() / power) for lag in range(1, _LAGS + 1)]
            sums = sum(size * size / (len(row) - lag) for lag, size in enumerate(related, 1)) * len(row) * (len(row) + 2)
            order = np.argsort(activity)
            quiet, busy = centred[order[: len(row) // 2]], centred[order[-(len(row) // 5) :]]
            ratio = float(np.square(busy).mean() / max(np.square(quiet).mean(), 1e-300))
            if chi2.sf(sums, _LAGS) < _CHANCE or f.sf(ratio, len(busy), len(quiet)) < _CHANCE:
                return False
    return True
