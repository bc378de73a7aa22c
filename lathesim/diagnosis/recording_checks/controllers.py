"""Controllers: how much of a command does not follow from what its controller was given, and which other value or law it would follow from.

A controller that answers to its reference by another law than the lesson's: a filter, a feed-forward, another gain.

    r_k = u_k - u_lesson,k = sum_j (a_j v_(k-j) + b_j w_(k-j)),   v, w: rate and second rate of the reference

u is the recorded command and u_lesson what the lesson's controller makes of the recorded reference and measurements. Noise of the
measurements reaches r and the command alike, and only the reference is without it: what r owes to it, learned on one recording and scored
on the other, is the controller's doing. Source: Ljung, System Identification, 2nd ed. 1999, section 16.6 (residuals against inputs).

Between a command and what its controller was given lies no physics, so one value is enough to tell, without any fit of the machine: the
share of the recorded command that a replay of the controller leaves falls to a part of what it was, on both recordings.
Source: Gertler, Fault Detection and Diagnosis in Engineering Systems (1998), chapter 2 (parity equations of a controller).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize_scalar

from lathesim.component import Component, Parameter
from lathesim.diagnosis.method.method import OTHER_VALUE, STANDARD, Method
from lathesim.diagnosis.records.found import ControllerValue
from lathesim.engine.assembly import FloatArray, Place
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.records import Free
from lathesim.identification.replay.controller_memory import shown_by
from lathesim.identification.replay.experiment import Experiment, baseline_free
from lathesim.identification.replay.simulator import Simulator
from lathesim.identification.roles import decides
from lathesim.identification.signal import SETTLING, root_mean_square


def shown_commands(experiment: Experiment) -> list[tuple[str, int]]:
    """Return each controller with the compared channel (row) that shows its command: itself, or what a drive makes of it."""
    parts = [part for part in experiment.machine.assembly.parts if makes_a_command(part.component)]
    rows = [(part.name, shown_by(experiment.machine.assembly, part, experiment.machine.compare)[:1]) for part in parts]
    return [(name, row[0]) for name, row in rows if row]


def controller_commands(experiment: Experiment) -> list[tuple[int, str]]:
    """Return place and name of each compared channel that is the command of a controller."""
    parts = experiment.machine.assembly.by_name
    return [(row, name) for row, name in enumerate(experiment.machine.compare) if makes_a_command(parts[Place.of(name).part].component)]


def unexplained_share(experiment: Experiment, values: Mapping[str, float]) -> Iterator[tuple[int, float]]:
    """Return for each controller's command its place among the compared channels and the share of it that a replay does not explain."""
    rows = [row for row, _ in controller_commands(experiment)]
    residual = experiment.sensed.one(values) if rows else np.zeros((0, 0))
    for row in rows:
        yield row, _share(experiment.sensed, row, residual)


def share_with(experiment: Experiment, name: str, column: FloatArray, row: int, values: Mapping[str, float], ends: int = 0) -> float:
    """Return the share of a command (row) that a replay with another column ``name`` leaves; the last ``ends`` samples do not count."""
    simulator = experiment.sensed_with(name, column)
    return _share(simulator, row, simulator.one(values), ends)


def _share(simulator: Simulator, row: int, residual: FloatArray, ends: int = 0) -> float:
    size = float(np.std(np.nan_to_num(simulator.recorded[row])))
    return root_mean_square(residual[row][int(SETTLING * simulator.samples) : simulator.samples - ends]) / size if size > 0.0 else 0.0


def makes_a_command(component: type[Component]) -> bool:
    """Return whether a part is a controller: it decides, and is no converter or moving part."""
    return decides(component) and "displacement" not in component.ports


def controller_value(
    experiment: Experiment, validation: Experiment, values: Mapping[str, float], method: Method = STANDARD
) -> ControllerValue | None:
    """Return the value of a controller with which its command follows best, on both recordings; none where the lesson's does as well."""
    if not experiment.machine.replay:
        return None
    best: tuple[float, ControllerValue] | None = None
    for row, share in unexplained_share(experiment, values):
        command = experiment.machine.compare[row]
        if share < method.within_laws:
            continue
        for name, given in _values_of(experiment, row):

            def left(logarithm: float, row: int = row, name: str = name, given: float = given, of: Experiment = experiment) -> float:
                return dict(unexplained_share(of, {**values, name: given * math.exp(logarithm)}))[row]

            furthest = math.log(OTHER_VALUE)
            found = minimize_scalar(left, bounds=(-furthest, furthest), method="bounded", options={"xatol": 1e-4})
            better = found.fun < method.little * share and (best is None or found.fun < best[0])
            if better and left(found.x, of=validation) < method.little * left(0.0, of=validation):
                unit = experiment.sensed.plan.unit(name)
                best = float(found.fun), ControllerValue(name, unit, given, given * math.exp(found.x), command, left(0.0))
    return _settled(best[1], (experiment, validation), values, method=method) if best else None


def with_commands_followed(experiment: Experiment, values: Mapping[str, float]) -> dict[str, float]:
    """Return ``values`` with those of controllers that are uncertain fitted, so that their commands follow best: what an integral adds up
    makes much of little."""
    rows = {row for row, _ in controller_commands(experiment)} if experiment.machine.replay else set()
    controllers = {name for name, row in shown_commands(experiment) if row in rows}
    free = [item for item in baseline_free(experiment.machine) if Place.of(item.name).part in controllers]
    if not free:
        return dict(values)
    constant = {name: value for name, value in values.items() if name not in {item.name for item in free}}
    return {**constant, **fit(experiment.sensed, free, constant, rounds=2).by_name}


def _settled(
    found: ControllerValue, experiments: tuple[Experiment, Experiment], values: Mapping[str, float], method: Method = STANDARD
) -> ControllerValue:
    """Return the value fitted to both recordings, with its standard error."""
    free = Free(found.name, found.value, method.little * found.value, low=found.value / OTHER_VALUE, high=found.value * OTHER_VALUE)
    values = {name: value for name, value in values.items() if name != found.name}
    fits = [fit(experiment.sensed, [free], values, slopes="central") for experiment in experiments]
    weights = np.array([1.0 / max(one.error(found.name), 1e-12 * found.value) ** 2 for one in fits])
    value = float(weights @ [one.by_name[found.name] for one in fits] / weights.sum())
    return replace(found, value=value, error=float(1.0 / np.sqrt(weights.sum())))


def _values_of(experiment: Experiment, row: int) -> Iterator[tuple[str, float]]:
    """Return name and value of the parameters that are more than nothing, of each controller whose command a channel (row) shows: behind a
    converter that is the controller's too."""
    for controller in (name for name, shown in shown_commands(experiment) if shown == row):
        for item in experiment.machine.assembly.by_name[controller].component.declared(Parameter):
            name = f"{controller}.{item}"
            if name in experiment.sensed.plan.parameters and experiment.sensed.given(name) > 0.0:
                yield name, experiment.sensed.given(name)


_RIDGE = 1e-6


@dataclass(frozen=True)
class AnotherLaw:
    """A command of which the lesson's controller leaves a share that answers to the reference."""

    channel: str
    share: float
    feed_forward: bool = False
    """Whether all of that goes with rate and second rate of the reference, at the same time."""

    @property
    def controller(self) -> str:
        """The controller's name."""
        return Place.of(self.channel).part

    def __str__(self) -> str:
        law = ", as with a feed-forward of its speed (or a reference that was recorded late)" if self.feed_forward else ""
        return f"{self.share:.1%} of {self.channel} answers to its reference by another law than the lesson's controller{law}"


def another_law(experiment: Experiment, validation: Experiment, values: Mapping[str, float], method: Method = STANDARD) -> list[AnotherLaw]:
    """Return each command that answers to its reference by another law, on ``validation`` as learned on ``experiment``; none where the
    lesson drives no controller with a recorded reference."""
    found = []
    for row, name in controller_commands(experiment):
        controller = Place.of(name).part
        references = [target for target in experiment.machine.drive if Place.of(target).part == controller]
        if references:
            here, there = (np.column_stack([_of_reference(one, target) for target in references]) for one in (experiment, validation))
            learned, scored = (one.sensed.one(values)[row] for one in (experiment, validation))
            share = regressed_share(here, learned, there, scored)
            size = float(np.std(scored) / max(float(np.std(np.nan_to_num(validation.sensed.recorded[row]))), 1e-300)) * np.sqrt(share)
            if share > method.larger_part and size > method.within_laws:
                at_once = slice(0, 2 * len(references))
                found.append(
                    AnotherLaw(name, float(size), regressed_share(here[:, at_once], learned, there[:, at_once], scored) > method.nearly_all)
                )
    return found


def regressed_share(here: FloatArray, learned: FloatArray, there: FloatArray, scored: FloatArray) -> float:
    """Return the share of ``scored`` (samples,) that a regression of ``learned`` (samples,) on the columns ``here`` (samples, columns)
    tells through the columns ``there``."""
    size = np.maximum(here.std(axis=0), 1e-300)
    here, there = here / size, there / size
    square = here.T @ here + _RIDGE * len(here) * np.eye(here.shape[1])
    told = there @ np.linalg.solve(square, here.T @ np.nan_to_num(learned))
    scored = np.nan_to_num(scored)
    power = float(scored @ scored)
    return max(0.0, 1.0 - float(np.sum((scored - told) ** 2)) / power) if power > 0.0 else 0.0


def _of_reference(experiment: Experiment, target: str) -> FloatArray:
    """Return rate and second rate of a recorded reference, at some lags, (samples, columns)."""
    period = experiment.machine.assembly.sample_period
    rate = np.gradient(np.nan_to_num(experiment.record[target]), period)
    both = (rate, np.gradient(rate, period))
    lags = (0, 1, 2, 3, 5, 8, 12, 18, 26, 36, 50, 70)
    return np.column_stack([np.concatenate([np.zeros(lag), values[: len(values) - lag]]) for lag in lags for values in both])
