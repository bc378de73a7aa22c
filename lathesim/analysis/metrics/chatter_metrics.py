"""Metrics of a cut that may chatter."""

from __future__ import annotations

import numpy as np

from lathesim.analysis.metrics.metric import Metric, signal
from lathesim.analysis.part.waves import wave_roughness
from lathesim.record import FloatArray, Record

_LAST = 0.25
"""Share of a run that counts as settled."""


def _settled(values: FloatArray) -> FloatArray:
    return values[len(values) - max(1, int(_LAST * len(values))) :]


def chatter_swing(record: Record) -> float:
    """Return the vibration of the tool at the end of the run, peak to peak [m]."""
    return float(np.ptp(_settled(signal(record, ".displacement"))))


def settled_removal_rate(record: Record) -> float:
    """Return the volume cut per time at the end of the run [m^3/s]."""
    return float(np.mean(_settled(signal(record, "cut.removal_rate", ".removal_rate"))))


CHATTER_METRICS: tuple[Metric, ...] = (
    Metric("chatter_swing", "m", "vibration of the tool in the last quarter of the run, peak to peak", chatter_swing),
    Metric("wave_roughness", "m", "average roughness R_a of the waves around the part, in the last turn", wave_roughness),
    Metric("settled_removal_rate", "m^3/s", "volume cut per time in the last quarter of the run", settled_removal_rate, of_cutting=True),
)
