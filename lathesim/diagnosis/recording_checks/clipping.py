"""A current or a force that was cut off where it was read, and not in the machine.

A drive at its limit shows as a current that stands, and so does a logger whose range is too small. The drive's machine goes where that
current takes it; that of the logger goes on as if there were none: everything else that was recorded follows without a limit.
"""

from __future__ import annotations

import numpy as np

from lathesim.analysis.display_unit import shown_with_unit
from lathesim.diagnosis.location import missing_share
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.identification.records import Fitted
from lathesim.identification.replay.experiment import Experiment

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
