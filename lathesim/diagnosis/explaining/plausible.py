"""Which sizes are believed: an effect whose size is far beyond those met on machines is not that effect."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from lathesim.diagnosis.candidates.periodic_starts import BEYOND_TYPICAL, PERIODS, cycle_of
from lathesim.diagnosis.explaining.study import Study
from lathesim.diagnosis.method import Method
from lathesim.diagnosis.method.method import OTHER_VALUE
from lathesim.engine.assembly import FloatArray, Place
from lathesim.identification.records import MOST_DAMPED, Candidate, Fitted, Free, Model, instants_of
from lathesim.identification.replay.experiment import POSSIBLE, baseline_free
from lathesim.identification.roles import commands
from lathesim.identification.signal import SETTLING
from lathesim.recordings.recorded_channel import known_factor

Objection = Literal["size", "lag", "instant", "drift", "damping", "wave", "passing", "runs away"]
"""What speaks against the values of an effect."""


@dataclass(frozen=True)
class Implausible:
    """Why a model is not believed: an effect with values that are not met, or that makes the machine run away.

    Of a ``size`` it says of which parameters (free names, of several the product), how large it is, and the ``bound`` that it is beyond.
    """

    objection: Objection
    candidate: Candidate | None = None
    names: tuple[str, ...] = ()
    size: float = math.nan
    bound: float = math.nan


def implausible(study: Study, model: Model) -> Implausible | None:
    """Return why a model is not believed, if it is not: the sizes of all effects are of the kind that is met, delays are a fair part of a
    sample, events come after the recording has begun, resonances resonate, waves repeat, and the machine does not run away."""
    unusual = (_unusual(study, candidate, model.fitted.by_name) for candidate in model.candidates)
    found = next((one for one in unusual if one is not None), None)
    return Implausible("runs away") if found is None and runs_away(study, model) else found


def is_plausible(study: Study, model: Model) -> bool:
    """Return whether a model is believed."""
    return implausible(study, model) is None


def is_usual(study: Study, candidate: Candidate, values: Mapping[str, float]) -> bool:
    """Return whether an effect with some values is of the kind that is met, whatever the machine does with it."""
    return _unusual(study, candidate, values) is None


def _unusual(study: Study, candidate: Candidate, values: Mapping[str, float]) -> Implausible | None:
    """Return what is unusual about an effect with some values, if anything is."""
    method, period = study.method, study.estimation.machine.assembly.sample_period
    duration = len(study.estimation.record) * period
    if (of_size := next(unusual_sizes(study, candidate, values), None)) is not None:
        return of_size
    conditions: tuple[tuple[Objection, Callable[[], bool]], ...] = (
        ("lag", lambda: is_of_a_clock(candidate, values, period, duration, method=method)),
        ("instant", lambda: is_an_event(instants_of(candidate), values, duration)),
        ("drift", lambda: study.earlier is not None or drifts(candidate, values, duration)),
        ("damping", lambda: resonates(candidate, values)),
        ("wave", lambda: repeats(study, candidate, values)),
        ("passing", lambda: lets_through(study, candidate, values)),
    )
    return next((Implausible(objection, candidate) for objection, holds in conditions if not holds()), None)


def runs_away(study: Study, model: Model) -> bool:
    """Return whether the lesson's own simulation of a model is off by many times the recorded motion, or the error of the lesson alone if
    that is more: a friction that pushes in one direction can replay a recording, and runs away by itself.

    Where the lesson alone makes the larger part of a motion, it is off by more than that motion: a friction can replay a recording whose
    machine would stand.
    """
    alone, with_it = own_residuals(study, model)
    own = study.validation.own
    moved = np.maximum(own.seen_spread, own.seen_floors)
    with np.errstate(over="ignore"):
        off, before = (np.sqrt(np.mean(one**2, axis=1)) for one in (with_it, alone))
    far = study.method.sizes.largest * np.maximum(before, moved)
    return not bool(np.all(off <= np.where(before < study.method.larger_part * moved, moved, far)))


def own_residuals(study: Study, model: Model) -> list[FloatArray]:
    """Return what the lesson's own simulation leaves of each channel, shape (channels, samples), from where a model begins the validation
    recording: with the values of the lesson, and with those of the model."""
    own, begun = study.validation.own, model.validation_fit.by_name
    starts = {name: begun[name] for name in begun if name in own.starts}
    names = own.settable([*model.fitted.by_name, *starts])
    values = {**model.fitted.by_name, **starts}
    return own.residuals(names, np.array([[starts.get(name, own.given(name)) for name in names], [values[name] for name in names]]))


def unusual_sizes(study: Study, candidate: Candidate, values: Mapping[str, float]) -> Iterator[Implausible]:
    """Return the sizes of an effect that are far beyond what is met on machines, or far below, and how far they may be."""
    most = study.method.sizes.largest
    if math.isinf(most):
        return
    pairs = [(size, other) for size, others in candidate.effect.identification.products.items() for other in others]
    apart = {item for pair in pairs for item in pair}
    for place, name in enumerate(candidate.parameters):
        if Place.of(name).port not in apart:
            bounds = _bounds_of(study, candidate, place)
            size = abs(values[name] - (candidate.neutral[place] if Place.of(name).port in candidate.effect.neutral else 0.0))
            yield from (Implausible("size", candidate, (name,), size, bound) for bound in _passed(size, *bounds))
    for pair in pairs:
        names = tuple(f"{candidate.part}.{item}" for item in pair)
        if set(names) <= set(candidate.parameters):
            usual = float(np.prod([candidate.usual[candidate.parameters.index(name)] for name in names]))
            size = abs(float(np.prod([values[name] for name in names])))
            # each by itself may be anything
            yield from (Implausible("size", candidate, names, size, bound) for bound in _passed(size, -math.inf, most * usual))


def _passed(size: float, low: float, high: float) -> Iterator[float]:
    """Return the bound that a size is beyond, if there is one."""
    if size < low:
        yield low
    elif size >= high:
        yield high


def _bounds_of(study: Study, candidate: Candidate, place: int) -> tuple[float, float]:
    """Return between which bounds a parameter of an effect is met, infinite where it may be anything."""
    most, name, points = study.method.sizes.largest, candidate.parameters[place], candidate.points[:, place]
    item, low = Place.of(name).port, -math.inf
    if item in candidate.effect.neutral:
        usual = float(np.abs(points - candidate.neutral[place]).max(initial=0.0))
    elif item in candidate.effect.identification.nuisance or points.min(initial=1.0) <= 0.0:
        return low, math.inf
    else:
        usual = float(points.max(initial=0.0))
        low = low if _may_be_small(study, candidate, item) else candidate.least[place] / most
    high = max(most * usual, study.possible.get(name, 0.0)) if usual > 0.0 else math.inf
    # a force that is clearly more than all that pushes a part would hold it or carry it off, unless another effect cancels it
    return low, min(high, study.method.alike * study.pushing.get(name, math.inf)) if candidate.effect.site == "effort" else high


def _may_be_small(study: Study, candidate: Candidate, item: str) -> bool:
    """Return whether a parameter is met as small as one likes: the damping of a spring, or the time of a change.

    Where a recording from before a change stands beside, an effect may be there at once, and how quickly it came does not show.
    """
    how = candidate.effect.identification
    return item == how.damping or (study.earlier is not None and bool(how.history))


def is_of_a_clock(candidate: Candidate, values: Mapping[str, float], period: float, duration: float, method: Method) -> bool:
    """Return whether a shift in time or a filter's lag is a fair part of a sample, if the effect is one, or a skew of a clock over the
    whole recording: a smaller one is how a simulation steps, or a friction or a play that is of another form. A delay of next to nothing
    is a command that was held."""
    lag = candidate.effect.identification.delay or candidate.effect.identification.whole_samples
    if not lag:
        return True
    of_time = candidate.effect.declarations[lag].unit == "s"
    late = abs(values[f"{candidate.part}.{lag}"]) * (1.0 if of_time else duration)
    return late > method.sizes.least_lag * period


def is_an_event(instants: Sequence[str], values: Mapping[str, float], duration: float) -> bool:
    """Return whether what happens at some ``instants`` (free names, none for most effects) does so after the recording has begun."""
    return all(values[name] > SETTLING * duration for name in instants)


def drifts(candidate: Candidate, values: Mapping[str, float], duration: float) -> bool:
    """Return whether what changes by the clock, if the effect does, still changes once the recording has begun: what is over by then is
    another value of what it changes."""
    by_clock = any(candidate.effect.declarations[name].unit == "s" for name in candidate.effect.identification.history)
    return all(values[name] > SETTLING * duration for name in candidate.named(("time_constant",)) if by_clock)


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


def lets_through(study: Study, candidate: Candidate, values: Mapping[str, float]) -> bool:
    """Return whether a drive or a sensor with an effect lets more than a little through: of the recorded command, root mean square, or of
    what is measured, unless a mistaken unit is as small a factor.

    A drive that is as good as switched off moves like a part that friction holds, or that coasts; so seems one whose sensor stands still.
    """
    factors = [values[name] for name in candidate.parameters if candidate.effect.neutral.get(Place.of(name).port) == 1.0]
    if not all(abs(factor) > study.method.little or known_factor(factor) for factor in factors):
        return False
    sensed = study.estimation.sensed
    source = commands(sensed.plan.assembly).get(candidate.at, "")
    if candidate.effect.site != "drive" or source not in sensed.plan.channels:
        return True
    position = sensed.plan.channels.index(source)
    given = sensed.channel([], [], position)
    acts = sensed.channel(candidate.parameters, [values[name] for name in candidate.parameters], position)
    return float(np.linalg.norm(acts)) > study.method.little * float(np.linalg.norm(given))


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
        if not np.isfinite(one.uncertainty):
            found.append(one)
            continue
        least = -one.given * OTHER_VALUE if one.low * one.high < 0.0 else one.given / OTHER_VALUE
        bounds = sorted((least, one.given * OTHER_VALUE))
        low, high = (max(one.low, bounds[0]), min(one.high, bounds[1])) if one.given else (one.low, one.high)
        found.append(replace(one, low=low, high=high, uncertainty=study.estimation.machine.uncertain[one.name]))
    return [*found, *study.estimation.start_states(study.estimation.sensed.plan)]
