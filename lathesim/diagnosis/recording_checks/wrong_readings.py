"""Whether a reading is in another unit than the lesson says, or was cut off where it was read, and not in the machine.

A drive at its limit shows as a current that stands, and so does a logger whose range is too small. The drive's machine goes where that
current takes it; that of the logger goes on as if there were none: everything else that was recorded follows without a limit.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from lathesim.analysis.display_unit import shown_with_unit
from lathesim.diagnosis.location import FORCES, missing_share
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.identification.records import Candidate, Fitted
from lathesim.identification.replay.experiment import Experiment
from lathesim.identification.signal import SETTLING, root_mean_square
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


_READ = ("A", "N", "N*m")


def clipped_reading(experiment: Experiment, fitted: Fitted, method: Method = STANDARD) -> str:
    """Return a sentence where a reading stands at a level beyond which the simulation goes on, and all else follows without; else empty."""
    for row, name in enumerate(experiment.machine.compare):
        unit = experiment.sensed.plan.unit(experiment.sensed.channels[row])
        recorded = experiment.sensed.recorded[row]
        if unit not in _READ or not np.isfinite(recorded).all():
            continue
        simulated = experiment.sensed.seen[row] - fitted.residual[row]
        ends = ((recorded.max(), 1.0), (recorded.min(), -1.0))
        levels = [level for level, side in ends if _goes_beyond(recorded, simulated, level, side, method=method)]
        others = [other for other in range(len(experiment.machine.compare)) if other != row]
        if levels and others and all(missing_share(experiment, fitted, other)[0] < method.within_laws for other in others):
            stand = int(np.count_nonzero(np.isin(recorded, levels)))
            where = " and ".join(shown_with_unit(float(level), unit) for level in levels)
            return (
                f"{name} is clipped at {where}: {stand} of {len(recorded)} samples stand there, and everything else went on as if it went "
                "further. Widen the range of the instrument and record again."
            )
    return ""


def _goes_beyond(recorded: np.ndarray, simulated: np.ndarray, level: float, side: float, method: Method = STANDARD) -> bool:
    """Return whether a reading with noise stands at its largest or smallest value for long, while the simulation is beyond it."""
    flat = recorded == level
    ends = (recorded == recorded.max()) | (recorded == recorded.min())
    inside = ~(ends | np.roll(ends, 1))
    # fewer samples do not tell what nearly all of them do
    if min(np.count_nonzero(flat), np.count_nonzero(inside)) * method.little < 1.0:
        return False
    if float(np.mean(np.diff(recorded, prepend=recorded[0])[inside] == 0.0)) > method.larger_part:
        return False
    usual = float(np.quantile(np.abs(recorded - simulated)[inside], method.nearly_all))
    beyond = side * (simulated - recorded)[flat]
    return float(np.mean(beyond > 0.0)) > method.nearly_all and float(np.median(beyond)) > method.errors * usual
