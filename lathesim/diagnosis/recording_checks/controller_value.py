"""A controller that has another value than the lesson gives it: its command then follows from what it was given, with that value.

Between a command and what its controller was given lies no physics, so one value is enough to tell, without any fit of the machine: the
share of the recorded command that a replay of the controller leaves falls to a part of what it was, on both recordings.
Source: Gertler, Fault Detection and Diagnosis in Engineering Systems (1998), chapter 2 (parity equations of a controller).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize_scalar

from lathesim.component import Parameter
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.recording_checks.unexplained_command import controller_commands, unexplained_share
from lathesim.diagnosis.records.controller_value import ControllerValue
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.records.fit import Free
from lathesim.identification.replay.experiment import Experiment, baseline_free


def controller_value(
    experiment: Experiment, validation: Experiment, values: Mapping[str, float], method: Method = STANDARD
) -> ControllerValue | None:
    """Return the value of a controller with which its command follows best, on both recordings; none where the lesson's does as well."""
    if not experiment.machine.replay:
        return None
    best: tuple[float, ControllerValue] | None = None
    for row, share in unexplained_share(experiment, values):
        command = experiment.machine.compare[row]
        if share < method.recording_checks.worth_of_command:
            continue
        for name, given in _values_of(experiment, command.partition(".")[0]):

            def left(logarithm: float, row: int = row, name: str = name, given: float = given, of: Experiment = experiment) -> float:
                return dict(unexplained_share(of, {**values, name: given * math.exp(logarithm)}))[row]

            furthest = math.log(method.recording_checks.value_factor)
            found = minimize_scalar(left, bounds=(-furthest, furthest), method="bounded", options={"xatol": 1e-4})
            better = found.fun < min(method.shared.left_by_cause * share, method.recording_checks.unexplained_command) and (
                best is None or found.fun < best[0]
            )
            if better and left(found.x, of=validation) < method.shared.left_by_cause * left(0.0, of=validation):
                unit = experiment.sensed.plan.unit(name)
                best = float(found.fun), ControllerValue(name, unit, given, given * math.exp(found.x), command, share)
    return _settled(best[1], (experiment, validation), values, method=method) if best else None


def with_commands_followed(experiment: Experiment, values: Mapping[str, float]) -> dict[str, float]:
    """Return ``values`` with those of controllers that are uncertain fitted, so that their commands follow best: what an integral adds up
    makes much of little."""
    controllers = {name.partition(".")[0] for _, name in controller_commands(experiment)} if experiment.machine.replay else set()
    free = [item for item in baseline_free(experiment.machine) if item.name.partition(".")[0] in controllers]
    if not free:
        return dict(values)
    constant = {name: value for name, value in values.items() if name not in {item.name for item in free}}
    return {**constant, **fit(experiment.sensed, free, constant, rounds=2).by_name}


def _settled(
    found: ControllerValue, experiments: tuple[Experiment, Experiment], values: Mapping[str, float], method: Method = STANDARD
) -> ControllerValue:
    """Return the value fitted to both recordings, with its standard error."""
    free = Free(
        found.name,
        found.value,
        method.recording_checks.little_off * found.value,
        low=found.value / method.recording_checks.value_factor,
        high=found.value * method.recording_checks.value_factor,
    )
    values = {name: value for name, value in values.items() if name != found.name}
    fits = [fit(experiment.sensed, [free], values, slopes="central") for experiment in experiments]
    weights = np.array([1.0 / max(one.error(found.name), 1e-12 * found.value) ** 2 for one in fits])
    value = float(weights @ [one.by_name[found.name] for one in fits] / weights.sum())
    return replace(found, value=value, error=float(1.0 / np.sqrt(weights.sum())))


def _values_of(experiment: Experiment, controller: str) -> Iterator[tuple[str, float]]:
    """Return name and value of a controller's parameters that are more than nothing."""
    part = next(part for part in experiment.machine.assembly.parts if part.name == controller)
    for item in part.component.declared(Parameter):
        name = f"{controller}.{item}"
        if name in experiment.sensed.plan.parameters and experiment.sensed.given(name) > 0.0:
            yield name, experiment.sensed.given(name)
