"""The force that a moving part lacks: what its recorded motion needs beyond what the lesson's forces give.

A force on a part shows in a channel as its response to an impulse, h. A short filter A with A * h = B, of as many taps, undoes it:

    acceleration(t) = (A * residual)(t) / sum(B)

with A by Prony's method of the lowest order that leaves nothing. It acts sample by sample, so that a residual which drifts far, as an angle
without its friction does, gives as good a force as any. Source: Hayes, Statistical Digital Signal Processing and Modeling (1996), section
4.4 (Prony's method). Left out: what a force does within a sample.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from lathesim.component import Output, Parameter
from lathesim.diagnosis.location import pushed_by, pushed_part, value_of
from lathesim.engine.assembly import FloatArray, Place
from lathesim.identification.records import Fitted
from lathesim.identification.replay.experiment import Experiment
from lathesim.identification.replay.simulator import IMPULSE

_TINY = sys.float_info.min


@dataclass(frozen=True, eq=False)
class Lacking:
    """What is lacking behind a channel: a force ``at`` an input of a part, against positive motion, or the residual of the channel itself;
    ``values`` (samples,) [``unit``], NaN where it is not known."""

    at: str
    unit: str
    values: FloatArray
    is_force: bool = False
    """Whether it is a force on a moving part."""
    answers_forces: bool = False
    """Whether forces that nobody measured change the channel, and another channel shows them better."""

    @property
    def is_plain(self) -> bool:
        """Whether it is the residual of a channel that no unknown force reaches."""
        return not (self.is_force or self.answers_forces)


def lacking(experiment: Experiment, fitted: Fitted, row: int) -> Lacking:
    """Return what is lacking behind a channel: the force on the part whose motion it shows best, else its own residual."""
    name, residual, sensed = experiment.machine.compare[row], fitted.residual[row], experiment.sensed
    at_once = _of_an_effort(experiment, fitted, name)
    if at_once is not None:
        return Lacking(*at_once[:2], residual / at_once[2], is_force=True)
    pushed = pushed_part(experiment, fitted, row)
    if pushed is None:
        states, responses, _ = sensed.impulse_responses(fitted.by_name)
        answers = any(np.any(one[row]) for one, state in zip(responses, states, strict=True) if pushed_by(sensed.plan, state))
        return Lacking(name, sensed.plan.unit(sensed.channels[row]), residual, answers_forces=answers)
    rate = undone(residual, pushed.response / IMPULSE * sensed.period)
    return Lacking(pushed.effort, pushed.unit, -pushed.inertia * pushed.flow * rate, is_force=True)


def _of_an_effort(experiment: Experiment, fitted: Fitted, channel: str) -> tuple[str, str, float] | None:
    """Return the effort of a part that a channel of it tells at once, its unit, and by how much one unit of it shows, as in the current of
    a motor that is led along a motion; none where it is no such channel."""
    plan = experiment.sensed.plan
    host, item = Place.of(channel)
    component = plan.parts[host].component
    effort = component.ports.get("effort", "")
    if item not in component.declared(Output) or effort not in component.taken_for(item):
        return None
    values = dict.fromkeys(component.taken_for(item), 0.0)
    values |= {name: value_of(plan, host, name, fitted.by_name) for name in component.declared(Parameter)}
    told = [component.value_of(item, {**values, effort: force}) for force in (0.0, 1.0)]
    return (f"{host}.{effort}", plan.unit(f"{host}.{effort}"), told[1] - told[0]) if told[1] != told[0] else None


def undone(residual: FloatArray, response: FloatArray, longest: int = 2000, left: float = 1e-3) -> FloatArray:
    """Return the input (samples,) whose ``response`` to an impulse (samples,) a residual (samples,) is; NaN where it is not known.

    The filter is fitted to the ``longest`` samples of the response and may leave a share ``left`` of it. A response begins where it is no
    longer nothing: what a reading is late by comes off first.
    """
    begins = max(0, int(np.flatnonzero(response)[0]) - 1)
    filters = [_undoing(response[begins : begins + longest], order) for order in (1, 2, 3, 4)]
    undoing, taps, _ = next((one for one in filters if one[2] < left), min(filters, key=lambda one: one[2]))
    values = lfilter(undoing, 1.0, residual) / taps.sum()
    values[: len(undoing) - 1] = np.nan
    late = round(float(np.arange(len(taps)) @ taps / taps.sum()))
    late = begins + (late if 0 < late < len(taps) else 0)
    return np.concatenate([values[late:], np.full(late, np.nan)])


def _undoing(response: FloatArray, order: int) -> tuple[FloatArray, FloatArray, float]:
    """Return a filter of an order, what it makes of a response, and the share of that which comes later than its own length."""
    before = np.stack([response[order - lag + 1 : len(response) - lag] for lag in range(1, order + 1)], axis=1)
    weights = np.linalg.lstsq(before, response[order + 1 :], rcond=None)[0]
    undoing = np.concatenate([[1.0], -weights])
    left = lfilter(undoing, 1.0, response)
    taps = left[: order + 1]
    return undoing, taps, float(np.linalg.norm(left[order + 1 :])) / max(float(np.linalg.norm(taps)), _TINY)


def quiet_every(values: FloatArray, fewest: int = 400, falls: float = 0.7) -> int:
    """Return over how many samples the mean of a force is to be taken for its noise to be no longer most of it: a sensor's noise, turned
    into a force, grows with the square of the frequency. The ``fewest`` means are left, and twice as many take less than ``falls`` off."""
    known, every = values[np.isfinite(values)], 1
    while len(known) > fewest:
        half = known[: len(known) // 2 * 2].reshape(-1, 2).mean(axis=1)
        if float(np.var(half)) > falls * float(np.var(known)):
            break
        known, every = half, 2 * every
    return every
