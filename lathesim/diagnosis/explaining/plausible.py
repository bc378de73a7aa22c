"""Which sizes are believed: an effect whose size is far beyond those met on machines is not that effect."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from lathesim.diagnosis.candidates.periodic_starts import BEYOND_TYPICAL, PERIODS, cycle_of
from lathesim.diagnosis.explaining.study import Study
from lathesim.diagnosis.method import Method
from lathesim.diagnosis.method.method import OTHER_VALUE
from lathesim.engine.assembly import FloatArray, Place
from lathesim.identification.records import MOST_DAMPED, Candidate, Fitted, Free, Model, instants_of
from lathesim.identification.replay.experiment import POSSIBLE, baseline_free
from lathesim.identification.signal import SETTLING


def is_plausible(study: Study, model: Model) -> bool:
    """Return whether the sizes of all effects of a model are of the kind that is met, delays are a fair part of a sample, events come after
    the recording has begun, resonances resonate, waves repeat, and the machine does not run away."""
    usual = all(is_usual(study, candidate, model.fitted.by_name) for candidate in model.candidates)
    return usual and not runs_away(study, model)


def is_usual(study: Study, candidate: Candidate, values: Mapping[str, float]) -> bool:
    """Return whether an effect with some values is of the kind that is met, whatever the machine does with it."""
    method, period = study.method, study.estimation.machine.assembly.sample_period
    duration = len(study.estimation.record) * period
    return (
        of_usual_size(study, candidate, values)
        and is_of_a_clock(candidate, values, period, duration, method=method)
        and is_an_event(instants_of(candidate), values, duration)
        and resonates(candidate, values)
        and repeats(study, candidate, values)
    )


def runs_away(study: Study, model: Model) -> bool:
    """Return whether the lesson's own simulation of a model is off by many times the recorded motion, or the error of the lesson alone if
    that is more: a friction that pushes in one direction can replay a recording, and runs away by itself.

    Where the lesson alone makes the larger part of a motion, it is off by more than that motion: a friction can replay a recording whose
    machine would stand.
    """
    alone, with_it = own_residuals(study, model)
    own = study.validation.own
    moved = np.maximum(np.nanstd(own.seen, axis=1), own.seen_floors)
    with np.errstate(over="ignore"):
        off, before = (np.sqrt(np.mean(one**2, axis=1)) for one in (with_it, alone))
    far = study.method.sizes.largest * np.maximum(before, moved)
    return not bool(np.all(off <= np.where(before < study.method.larger_part * moved, moved, far)))


def own_residuals(study: Study, model: Model) -> list[FloatArray]:
    """Return what the lesson's own simulation leaves of each channel, shape (channels, samples), from where a model begins the validation
    recording: with the values of the lesson, and with those of the model."""
    own, begun = study.validation.own, model.validation_fit.by_name
    starts = {name: begun[name] for name in begun if name in own.plan.states}
    names = own.settable([*model.fitted.by_name, *starts])
    values = {**model.fitted.by_name, **starts}
    return own.residuals(names, np.array([[starts.get(name, own.given(name)) for name in names], [values[name] for name in names]]))


def of_usual_size(study: Study, candidate: Candidate, values: Mapping[str, float]) -> bool:
    """Return whether an effect's size is not far beyond what is met on machines: whatever it then explains, it is not that effect."""
    most = study.method.sizes.largest
    if math.isinf(most):
        return True
    products = [(size, other) for size, others in candidate.effect.identification.products.items() for other in others]
    apart = {item for pair in products for item in pair}
    for name, neutral, least, points in zip(candidate.parameters, candidate.neutral, candidate.least, candidate.points.T, strict=True):
        item = Place.of(name).port
        if item in apart:
            continue
        if item in candidate.effect.neutral:
            usual, size = float(np.abs(points - neutral).max(initial=0.0)), abs(values[name] - neutral)
        else:
            usual, size = float(points.max(initial=0.0)), abs(values[name])
            if item in candidate.effect.identification.nuisance or points.min(initial=1.0) <= 0.0:
                continue
            if size < least / most and not _may_be_small(study, candidate, item):
                return False
        if usual > 0.0 and size >= max(most * usual, study.possible.get(name, 0.0)):
            return False
    return all(_is_usual_product(candidate, values, most, size, other) for size, other in products)


def _may_be_small(study: Study, candidate: Candidate, item: str) -> bool:
    """Return whether a parameter is met as small as one likes: the damping of a spring, or the time of a change.

    Where a recording from before a change stands beside, an effect may be there at once, and how quickly it came does not show.
    """
    how = candidate.effect.identification
    return item == how.damping or (study.earlier is not None and bool(how.history))


def _is_usual_product(candidate: Candidate, values: Mapping[str, float], most: float, size: str, other: str) -> bool:
    """Return whether the product of two parameters is not far beyond what is met; each by itself may be anything."""
    names = [f"{candidate.part}.{item}" for item in (size, other)]
    if not set(names) <= set(candidate.parameters):
        return True
    usual = float(np.prod([candidate.usual[candidate.parameters.index(name)] for name in names]))
    return abs(float(np.prod([values[name] for name in names]))) < most * usual


def is_of_a_clock(candidate: Candidate, values: Mapping[str, float], period: float, duration: float, method: Method) -> bool:
    """Return whether a shift in time or a filter's lag is a fair part of a sample, if the effect is one, or a skew of a clock over the
    whole recording: a smaller one is how a simulation steps, or a friction or a play that is of another form."""
    lag = candidate.effect.identification.delay
    if not lag:
        return True
    of_time = candidate.effect.declarations[lag].unit == "s"
    late = abs(values[f"{candidate.part}.{lag}"]) * (1.0 if of_time else duration)
    return late > method.sizes.least_lag * period


def is_an_event(instants: Sequence[str], values: Mapping[str, float], duration: float) -> bool:
    """Return whether what happens at some ``instants`` (free names, none for most effects) does so after the recording has begun."""
    return all(values[name] > SETTLING * duration for name in instants)


def resonates(candidate: Candidate, values: Mapping[str, float]) -> bool:
    """Return whether a resonance, if the effect is one, has a peak: with more damping it is a lag, and another effect is one as well."""
    return all(values[name] < MOST_DAMPED for name in candidate.named((candidate.effect.identification.damping,)))


def repeats(study: Study, candidate: Candidate, values: Mapping[str, float]) -> bool:
    """Return whether a wave, if the effect is one, comes once at least on the way of the recording: half a wave is any bend of a curve.

    A turn repeats by itself, however small a part of it the machine made.
    """
    known = {name for name, low, high in zip(candidate.parameters, candidate.low, candidate.high, strict=True) if low == high}
    for name in candidate.named(PERIODS):
        if name in known:
            continue
        length, declared = values[name], candidate.effect.declarations[Place.of(name).port]
        # one wave more on a way changes a length by its square over the way
        way = length * length / cycle_of(study.estimation, candidate, length)
        turn = 2.0 * math.pi * BEYOND_TYPICAL if declared.unit == "rad" else 0.0
        if 0.0 < way < length and length > turn:
            return False
    return True


IMPLAUSIBLE = 0.98 * POSSIBLE
"""Declared standard deviations above which a value of the lesson is implausible: it would go further if it might."""


def deviations(fitted: Fitted) -> FloatArray:
    """Return by how many declared standard deviations each value of the lesson is off; how a recording starts is none of them."""
    known = [(value, one) for value, one in zip(fitted.values, fitted.free, strict=True) if one.is_declared]
    return np.array([abs(value - one.given) / one.uncertainty for value, one in known], dtype=float)


def strained(fitted: Fitted) -> tuple[str, ...]:
    """Return the values of the lesson that are implausible, by name."""
    names = [one.name for one in fitted.free if one.is_declared]
    return tuple(name for name, off in zip(names, deviations(fitted), strict=True) if off > IMPLAUSIBLE)


def released(study: Study) -> list[Free]:
    """Return the free values of the lesson, each of which may be another one by a factor, or of the other sign where it has no own one; its
    deviation still costs what it does."""
    found = []
    for one in baseline_free(study.estimation.machine, 10.0):
        least = -one.given * OTHER_VALUE if one.low * one.high < 0.0 else one.given / OTHER_VALUE
        bounds = sorted((least, one.given * OTHER_VALUE))
        low, high = (max(one.low, bounds[0]), min(one.high, bounds[1])) if one.given else (one.low, one.high)
        found.append(replace(one, low=low, high=high, uncertainty=study.estimation.machine.uncertain[one.name]))
    return [*found, *study.estimation.start_states(study.estimation.sensed.plan)]
