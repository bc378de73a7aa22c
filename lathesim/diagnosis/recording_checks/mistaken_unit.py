"""Whether a channel of a recording is in another unit than the lesson says."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from lathesim.diagnosis.location import FORCES
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.identification.records import Candidate
from lathesim.identification.replay.experiment import SETTLING, Experiment
from lathesim.identification.signal import root_mean_square
from lathesim.recordings.recorded_channel import known_factor


def in_another_unit(experiment: Experiment, values: Mapping[str, float], method: Method = STANDARD) -> str:
    """Return a sentence where one force is what the machine with ``values`` makes times the factor of a mistaken unit, and hardly anything
    else, and all others are nearly what it makes; empty where none is. Another effect may do the same: of a force that is a share of
    another one, a part of that other one. Where all are off the machine is another one; of motions the mapping asks."""
    begin = int(SETTLING * experiment.sensed.samples)
    recorded = np.nan_to_num(experiment.sensed.recorded)[:, begin:]
    simulated = recorded - np.nan_to_num(experiment.sensed.one(values))[:, begin:]
    factors = [float(one @ other) / max(float(other @ other), 1e-300) for one, other in zip(recorded, simulated, strict=True)]
    off = [row for row, factor in enumerate(factors) if not is_within(factor, method.alike)]
    if len(off) != 1 or len(factors) == 1 or experiment.record.unit(experiment.machine.compare[off[0]]) not in FORCES:
        return ""
    (row,) = off
    factor, name = factors[row], experiment.machine.compare[row]
    beside = root_mean_square(recorded[row] - factor * simulated[row])
    ordinary = is_within(abs(factor), method.recordings.unit_high)
    unit = "" if ordinary else known_factor(factor, method.little)
    if not unit or not beside < method.little * root_mean_square(recorded[row]):
        return ""
    return f"{name} is {factor:.4g} times what the machine makes, which is the factor of a mistaken unit: {unit}."


def wrong_unit(candidates: Iterable[Candidate], values: Mapping[str, float], method: Method = STANDARD) -> str:
    """Return a sentence where one of some effects would be a factor on a reading that a mistaken unit leaves; empty where none is.

    No amplifier is off by 2 pi: the column is. It is asked of effects that took most of the error away: a wrong unit does.
    """
    for candidate in candidates:
        for name, neutral in zip(candidate.parameters, candidate.neutral, strict=True):
            factor = values.get(name, 1.0)
            if neutral == 1.0 and abs(factor + 1.0) < method.little:
                return f"{candidate.at} reads {factor:.4g} times what the machine does: its sign is turned round."
            if neutral == 1.0 and (unit := known_factor(factor)):
                return f"{candidate.at} reads {factor:.4g} times what the machine does, which is the factor of a mistaken unit: {unit}."
    return ""


def is_within(factor: float, most: float) -> bool:
    """Return whether a factor is between the inverse of another one and that one itself."""
    return 1.0 / most < factor < most
