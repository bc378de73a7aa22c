"""What is told of an effect that was found: its values with their intervals, inside what may be set, and what is not determined."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np

from lathesim.component import Declaration, Parameter
from lathesim.diagnosis.records.diagnosis import Determined, FoundEffect, Interval
from lathesim.diagnosis.records.found import RankedEffect
from lathesim.engine.assembly import Place
from lathesim.identification.estimation.estimates import CONFIDENCE, Estimates, interval_includes_neutral, is_there
from lathesim.identification.records import Candidate
from lathesim.identification.replay.experiment import Experiment
from lathesim.units import product_unit


def reported(item: RankedEffect, values: Estimates, experiment: Experiment, channel: str = "") -> FoundEffect:
    """Return what is told of an effect; a parameter is not determined where its error is large beside itself and its usual size. Where it
    is tied, a sentence on the ``channel`` that would tell stands before the motion that would."""
    candidate, values = item.candidate, _as_sure_as_its_gain(item, values)
    parameters, undetermined = {}, []
    for name, scale in zip(candidate.parameters, np.abs(candidate.points).max(axis=0, initial=0.0), strict=True):
        short = Place.of(name).port
        if name not in values.by_name:
            continue
        estimate = values.by_name[name]
        half = CONFIDENCE * estimate.error
        value = estimate.value
        if short == "order":
            # a whole number; what it seems to be off is the speed
            half, value = max(half, abs(value - round(value))), float(round(value))
        declared = declared_in(experiment, name)
        parameters[short] = bounded(Interval(value, declared.unit, value - half, value + half), declared)
        if estimate.error <= 0.0 or estimate.error > 0.5 * max(float(scale), abs(estimate.value)):
            undetermined.append(short)
    others = item.tied
    tied = tuple(dict.fromkeys(other.name if other.name != candidate.name else f"{other.name} at {other.place}" for other in others))
    # no experiment is worth its time that tells two forms of one law apart
    advice = for_a_turning_part(candidate.effect.experiment) if _turns(candidate, experiment) else candidate.effect.experiment
    separating = advice if undetermined or not all(_one_law(candidate, other) for other in others) else None
    if tied and channel and separating:
        separating = f"{channel} {separating or ''}".strip()
    return FoundEffect(
        candidate.name,
        candidate.at,
        candidate.family,
        item.probability,
        _turned(candidate, parameters),
        tied,
        separating,
        item.share,
        (candidate.effect.__doc__ or "").strip().splitlines()[0],
        candidate.seat.before,
        Determined(tuple(undetermined), (), interval_includes_neutral(candidate, values), _products(candidate, values, experiment)),
        bool(candidate.effect.identification.spacing),
    )


def for_a_turning_part(advice: str) -> str:
    """Return the advice of an effect with speeds of a slide [mm/s] as speeds of a turning part [rpm]: 10 mm is a turn of a usual screw."""
    return re.sub(
        r"([\d.]+)(?: to ([\d.]+))? mm/s",
        lambda found: f"{' to '.join(f'{6.0 * float(one):g}' for one in found.groups() if one)} rpm",
        advice,
    )


def _turns(candidate: Candidate, experiment: Experiment) -> bool:
    """Return whether the part that an effect sits at turns, or reads what turns."""
    plan, part = experiment.sensed.plan, Place.of(candidate.at).part
    ports = plan.parts[part].component.ports
    return any("rad" in plan.unit(f"{part}.{ports[role]}") for role in ("displacement", "flow", "reading") if role in ports)


def _as_sure_as_its_gain(item: RankedEffect, values: Estimates) -> Estimates:
    """Return estimates in which the interval of an effect does not hold zero where its gain excludes that.

    One block of frequencies shows nearly all of a size such as that of a wave. The others then are no measure of its error.
    """
    candidate = item.candidate
    if math.isinf(item.size_error) or not interval_includes_neutral(candidate, values):
        return values
    neutral = dict(zip(candidate.parameters, candidate.neutral.tolist(), strict=True))
    sizes = [name for name in candidate.named(candidate.effect.neutral) if name in values.by_name]
    most = item.size_error * max((abs(values.by_name[name].value - neutral[name]) for name in sizes), default=math.inf)
    surer = {name: replace(values.by_name[name], error=min(values.by_name[name].error, most)) for name in sizes}
    return replace(values, by_name={**values.by_name, **surer})


def _products(candidate: Candidate, values: Estimates, experiment: Experiment) -> dict[str, Interval]:
    """Return the products of two parameters that the recordings determine, where they determine no more."""
    found = {}
    for size, others in candidate.effect.identification.products.items():
        for other in others:
            pair = (f"{candidate.part}.{size}", f"{candidate.part}.{other}")
            product = values.products.get(pair)
            if product is not None and is_there(product):
                unit = product_unit(*(declared_in(experiment, name).unit for name in pair))
                half = CONFIDENCE * product.error
                found[f"{size} x {other}"] = Interval(product.value, unit, product.value - half, product.value + half)
    return found


def _one_law(candidate: Candidate, other: Candidate) -> bool:
    """Return whether two candidates at one place are forms of one law: one refines the other, or both refine the same."""
    laws = [{one.name, *one.effect.identification.generalises} for one in (candidate, other)]
    return candidate.at == other.at and bool(laws[0] & laws[1])


def declared_in(experiment: Experiment, name: str) -> Declaration:
    """Return how ``part.name`` is declared where it sits, with the units of its wires."""
    part, item = Place.of(name)
    return experiment.sensed.plan.parts[part].component.declarations[item]


def bounded(interval: Interval, declared: Declaration) -> Interval:
    """Return an interval that ends where the declaration does: what cannot be negative has no interval below zero."""
    if not isinstance(declared, Parameter):
        return interval
    low, high = (float(np.clip(bound, declared.low, declared.high)) for bound in (interval.low, interval.high))
    ends = (interval.low < declared.low, interval.high > declared.high)
    return replace(interval, low=min(low, interval.value), high=max(high, interval.value), ends=ends)


def _turned(candidate: Candidate, parameters: dict[str, Interval]) -> dict[str, Interval]:
    """Return each wave with a negative size as the same wave of positive size, half a turn on."""
    values = {f"{candidate.part}.{name}": item.value for name, item in parameters.items()}
    turned = dict(parameters)
    sizes = [
        size for phase in phases_to_turn(candidate, values, of_either_sign(parameters)) for size in candidate.waves[phase] if size in values
    ]
    for name in (Place.of(size).port for size in sizes):
        item = parameters[name]
        turned[name] = Interval(-item.value, item.unit, -item.high, -item.low, item.ends[::-1])
    return turned


def of_either_sign(parameters: Mapping[str, Interval]) -> set[str]:
    """Return the sizes whose interval holds zero."""
    return {name for name, item in parameters.items() if item.low <= 0.0 <= item.high}


def phases_to_turn(candidate: Candidate, values: Mapping[str, float], unsure: Collection[str] = ()) -> list[str]:
    """Return the phases (free names) of the waves whose size, or the largest of its sizes by what is usual, is negative.

    The sizes of such a wave change their sign and its phase is turned, see :attr:`Term.waves`; what the effect gives stays what it was.
    Sizes that are ``unsure`` (names without the part), as they may be of either sign, decide where there is no other.
    """
    usual = dict(zip(candidate.parameters, np.abs(candidate.points).max(axis=0, initial=0.0), strict=True))
    found = []
    for phase, sizes in candidate.waves.items():
        names = [name for name in sizes if name in values and usual[name] > 0.0]
        names = [name for name in names if Place.of(name).port not in unsure] or names
        if names and values[max(names, key=lambda name: abs(values[name]) / usual[name])] < 0.0:
            found.append(phase)
    return found
