"""Values of the lesson: how far they are off, and how far they may be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lathesim.diagnosis.explaining.study import Study
from lathesim.diagnosis.method.method import OTHER_VALUE
from lathesim.engine.assembly import FloatArray
from lathesim.identification.records import Fitted, Free
from lathesim.identification.replay.experiment import POSSIBLE, baseline_free

IMPLAUSIBLE = 0.98 * POSSIBLE
"""Declared standard deviations above which a value of the lesson is implausible: it would go further if it might."""


def deviations(fitted: Fitted) -> FloatArray:
    """Return by how many declared standard deviations each value of the lesson is off; how a recording starts is none of them."""
    known = [(value, one) for value, one in zip(fitted.values, fitted.free, strict=True) if np.isfinite(one.low + one.high)]
    return np.array([abs(value - one.given) / one.uncertainty for value, one in known if np.isfinite(one.uncertainty)], dtype=float)


def released(study: Study) -> list[Free]:
    """Return the free values of the lesson, each of which may be another one by a factor; its deviation still costs what it does."""
    found = []
    for one in baseline_free(study.estimation.machine, 10.0):
        bounds = sorted((one.given / OTHER_VALUE, one.given * OTHER_VALUE))
        low, high = (max(one.low, bounds[0]), min(one.high, bounds[1])) if one.given else (one.low, one.high)
        found.append(replace(one, low=low, high=high, uncertainty=study.estimation.machine.uncertain[one.name]))
    return [*found, *study.estimation.start_states(study.estimation.sensed.plan)]
