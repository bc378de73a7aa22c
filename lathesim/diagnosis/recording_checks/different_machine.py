"""Whether two recordings are of one machine: values of it that differ between them by more than anybody holds possible."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from lathesim.component import Parameter
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.engine.assembly import Place
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.records import Fitted, Free, Model, is_full_band, with_start
from lathesim.identification.replay.experiment import POSSIBLE, Experiment


def another_machine(model: Model, experiment: Experiment, validation: Experiment, method: Method = STANDARD) -> str:
    """Return in a sentence that the validation recording is of another machine than the fitted one; empty where it may be of the same.

    With values of its own it is explained nearly, with those of the other recording it is not, and the values lie further apart than the
    lesson's uncertainties allow. Where its own values explain little, something else is wrong, and nothing is said here. A value counts
    as another one where the recording is explained worse with it held at that of the other: an angle a turn on is the same, and so is any
    value of a weight that weighs nothing. Source: Venzon, Moolgavkar, A method for computing profile-likelihood-based confidence
    intervals, Applied Statistics 37 (1988), 87-94.
    """
    if not np.any(_sizes(model.validation_fit) > method.alike * _sizes(model.fitted)):
        return ""
    own = _by_itself(model, validation)
    if not np.any(_sizes(own) < method.larger_part * _sizes(model.validation_fit)):
        return ""
    first = _by_itself(model, experiment)
    for name, deviation in validation.machine.uncertain.items():
        here, there = first.by_name[name], own.by_name[name]
        apart = abs(here - there) > max(POSSIBLE * deviation, method.errors * np.hypot(first.error(name), own.error(name)))
        if apart and np.any(_sizes(_by_itself(model, validation, {name: here})) > method.alike * _sizes(own)):
            unit = validation.sensed.plan.unit(name)
            return f"{validation.name} is of another machine: {name} is {there:.4g} {unit} there and {here:.4g} {unit} in the fitted one."
    return ""


def _by_itself(model: Model, experiment: Experiment, kept: Mapping[str, float] | None = None) -> Fitted:
    """Fit a model to a recording, held by nothing that the lesson says but ``kept`` values: what it says by itself."""
    starts = experiment.start_states(experiment.sensed.plan)
    constant = {**model.fitted.constant, **(kept or {})}
    apart = {item.name for item in starts} | set(constant)
    unheld = [_unheld(item, experiment) for item in with_start(model.fitted) if item.name not in apart]
    return fit(experiment.sensed, [*starts, *unheld], constant, rounds=4, full_band=is_full_band(model.candidates))


def _unheld(item: Free, experiment: Experiment) -> Free:
    """Return a value of the machine within the bounds of its declaration only."""
    if item.name not in experiment.machine.uncertain:
        return item
    part, name = Place.of(item.name)
    declared = experiment.sensed.plan.parts[part].component.declared(Parameter)[name]
    return replace(item, uncertainty=np.inf, low=declared.low, high=declared.high)


def _sizes(fitted: Fitted) -> np.ndarray:
    return np.asarray(np.sqrt(np.mean(fitted.residual**2, axis=1)))
