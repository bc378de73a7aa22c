"""Which way a part moves: by its sensor, else as the lesson simulates it."""

from __future__ import annotations

import numpy as np

from lathesim.diagnosis.method import STANDARD, Method
from lathesim.engine.assembly import FloatArray
from lathesim.identification.replay.experiment import Experiment
from lathesim.identification.replay.measured_motion import recorded_motion


def direction_of(velocity: FloatArray, standstill: float | None = None, method: Method = STANDARD) -> FloatArray:
    """Return -1, 0 or +1 for each sample; below ``standstill``, a share of the fastest motion, a part stands still."""
    share = method.location.standstill if standstill is None else standstill
    still = np.abs(velocity) < share * float(np.max(np.abs(velocity), initial=0.0))
    return np.where(still, 0.0, np.sign(velocity))


def _direction(experiment: Experiment, host: str, method: Method = STANDARD) -> FloatArray | None:
    """Return which way a part moves at each sample, 0 where it stands still: by its sensor, else as simulated."""
    ports = next(part.component.ports for part in experiment.machine.assembly.parts if part.name == host)
    flow = f"{host}.{ports.get('flow', '')}"
    motion = recorded_motion(experiment.with_candidates, {name: experiment.record[name] for name in experiment.machine.compare})
    if flow in motion:
        return direction_of(motion[flow], method=method)
    return direction_of(experiment.doing[flow], method.location.commanded_standstill, method=method) if flow in experiment.doing else None


def one_way(experiment: Experiment, host: str, method: Method = STANDARD) -> bool:
    """Return whether a part is known to move in one direction only."""
    direction = _direction(experiment, host, method=method)
    return direction is not None and not (np.any(direction > 0.0) and np.any(direction < 0.0))
