"""A controller that answers to its reference by another law than the lesson's: a filter, a feed-forward, another gain.

    r_k = u_k - u_lesson,k = sum_j (a_j v_(k-j) + b_j w_(k-j)),   v, w: rate and second rate of the reference

u is the recorded command and u_lesson what the lesson's controller makes of the recorded reference and measurements. Noise of the
measurements reaches r and the command alike, and only the reference is without it: what r owes to it, learned on one recording and scored
on the other, is the controller's doing. Source: Ljung, System Identification, 2nd ed. 1999, section 16.6 (residuals against inputs).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.recording_checks.unexplained_command import controller_commands
from lathesim.engine.assembly import FloatArray
from lathesim.identification.replay.experiment import Experiment

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
        return self.channel.partition(".")[0]

    def __str__(self) -> str:
        law = ", as with a feed-forward of its speed (or a reference that was recorded late)" if self.feed_forward else ""
        return f"{self.share:.1%} of {self.channel} answers to its reference by another law than the lesson's controller{law}"


def another_law(experiment: Experiment, validation: Experiment, values: Mapping[str, float], method: Method = STANDARD) -> list[AnotherLaw]:
    """Return each command that answers to its reference by another law, on ``validation`` as learned on ``experiment``; none where the
    lesson drives no controller with a recorded reference."""
    found = []
    for row, name in controller_commands(experiment):
        controller = name.partition(".")[0]
        references = [target for target in experiment.machine.drive if target.partition(".")[0] == controller]
        if references:
            here, there = (
                np.column_stack([_of_reference(one, target, method) for target in references]) for one in (experiment, validation)
            )
            learned, scored = (one.sensed.one(values)[row] for one in (experiment, validation))
            share = regressed_share(here, learned, there, scored)
            size = float(np.std(scored) / max(float(np.std(np.nan_to_num(validation.sensed.recorded[row]))), 1e-300)) * np.sqrt(share)
            if share > method.shared.larger_part and size > method.recording_checks.worth_of_command:
                at_once = slice(0, 2 * len(references))
                found.append(
                    AnotherLaw(
                        name,
                        float(size),
                        regressed_share(here[:, at_once], learned, there[:, at_once], scored) > method.selection.almost_all,
                    )
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


def _of_reference(experiment: Experiment, target: str, method: Method) -> FloatArray:
    """Return rate and second rate of a recorded reference, at some lags, (samples, columns)."""
    period = experiment.machine.assembly.sample_period
    rate = np.gradient(np.nan_to_num(experiment.record[target]), period)
    both = (rate, np.gradient(rate, period))
    return np.column_stack(
        [np.concatenate([np.zeros(lag), values[: len(values) - lag]]) for lag in method.recording_checks.law_lags for values in both]
    )
