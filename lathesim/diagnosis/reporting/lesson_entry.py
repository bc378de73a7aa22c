"""The line of a lesson that puts a found effect in, without what the recording does not determine and the effect does without."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from lathesim.component import Parameter
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.records.diagnosis import FoundEffect
from lathesim.diagnosis.records.found import Found
from lathesim.diagnosis.reporting.effect_report import declared_in, of_either_sign, phases_to_turn
from lathesim.effects.effect import COMPUTED
from lathesim.engine.assembly import Place
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.estimation.transfer import begun_anew
from lathesim.identification.records import Candidate, Fitted, is_full_band, with_start
from lathesim.identification.replay.experiment import Experiment


def lesson_entry(effect: FoundEffect, candidate: Candidate, fitted: Fitted, experiment: Experiment) -> dict[str, str]:
    """Return the entry for the lesson; what belongs to a recording is that of the fitted one."""
    quantities = {}
    for name, item in effect.parameters.items():
        if name not in effect.sizes.left_out:
            quantities[name] = written(item.value, item.unit)
        elif (neutral := _neutral_where_not_default(candidate, name, experiment)) is not None:
            quantities[name] = written(neutral, item.unit)
    for name in candidate.effect.neutral:
        # a size that is held at nothing, as no recording needs it
        if (
            f"{candidate.part}.{name}" not in candidate.parameters
            and (neutral := _neutral_where_not_default(candidate, name, experiment)) is not None
        ):
            quantities[name] = written(neutral, declared_in(experiment, f"{candidate.part}.{name}").unit)
    held = candidate.effect.identification.held_flag
    if fitted.by_name.get(f"{candidate.part}.{held}") == COMPUTED:
        quantities[held] = written(COMPUTED, "1")
    for name in candidate.nuisance:
        short = Place.of(name).port
        if name in fitted.by_name and short not in quantities:
            half_turn = np.pi if name in phases_to_turn(candidate, fitted.by_name, of_either_sign(effect.parameters)) else 0.0
            quantities[short] = written(fitted.by_name[name] + half_turn, declared_in(experiment, name).unit)
    return {"effect": effect.effect, "at": candidate.place, **candidate.seat.senses, **quantities}


def written(value: float, unit: str) -> str:
    """Return a quantity as a lesson takes it: a number with its unit, a pure number alone."""
    number = f"{value:.6g}"
    return number if unit == "1" else f"{number} {unit}"


def _neutral_where_not_default(candidate: Candidate, name: str, experiment: Experiment) -> float | None:
    """Return the neutral value of a parameter that would have another one where it is not named."""
    declared = declared_in(experiment, f"{candidate.part}.{name}")
    neutral = candidate.effect.neutral.get(name)
    return neutral if isinstance(declared, Parameter) and neutral is not None and neutral != declared.default else None


def without_undetermined(
    effects: Sequence[FoundEffect],
    candidates: Sequence[Candidate],
    validation: Experiment,
    found: Found,
    values: Mapping[str, float],
    method: Method = STANDARD,
) -> list[FoundEffect]:
    """Return the effects with what may be left out of their lines: parts that are not determined, may be nothing, and are not missed.

    A hump at a speed that was never run explains nothing here, and in the lesson it would invent something there. An effect keeps at
    least one value that makes it sensed; whether a part is missed is asked of the validation recording.
    """
    found_effects = []
    for effect, candidate in zip(effects, candidates, strict=True):
        vanishing = _may_be_nothing(effect, candidate)
        choices = [effect.sizes.undetermined, vanishing] if vanishing else []
        chosen = next((names for names in choices if _is_not_missed(names, candidate, validation, found, values, method=method)), ())
        found_effects.append(replace(effect, sizes=replace(effect.sizes, left_out=tuple(chosen))))
    return found_effects


def _may_be_nothing(effect: FoundEffect, candidate: Candidate) -> tuple[str, ...]:
    """Return the undetermined parameters whose intervals hold the value with which their part vanishes, where something else remains."""
    sizes = {name: item for name, item in effect.parameters.items() if name in candidate.effect.neutral}
    nothing = [
        name
        for name, item in sizes.items()
        if name in effect.sizes.undetermined and item.low <= candidate.effect.neutral[name] <= item.high
    ]
    with_simulated_motion = [
        name for name, item in sizes.items() if name not in effect.sizes.undetermined and item.value != candidate.effect.neutral[name]
    ]
    return tuple(nothing) if with_simulated_motion else ()


def _is_not_missed(
    names: Sequence[str], candidate: Candidate, validation: Experiment, found: Found, values: Mapping[str, float], method: Method = STANDARD
) -> bool:
    """Return whether the validation recording is explained as well with some parameters of an effect as they are where nobody names
    them."""
    neutral = {}
    for name in names:
        declared = declared_in(validation, f"{candidate.part}.{name}")
        assert isinstance(declared, Parameter)
        neutral[f"{candidate.part}.{name}"] = candidate.effect.neutral.get(name, declared.default)
    sizes = [_residual_sizes(validation, found, {**values, **changed}) for changed in ({}, neutral)]
    return bool(np.all(sizes[1] <= (1.0 + method.material) * sizes[0]))


def _residual_sizes(validation: Experiment, found: Found, values: Mapping[str, float]) -> np.ndarray:
    return np.asarray(np.sqrt(np.mean(on_validation(validation, found, values).residual ** 2, axis=1)))


def on_validation(validation: Experiment, found: Found, values: Mapping[str, float]) -> Fitted:
    """Fit what belongs to the validation recording beside given values: its start, its phases."""
    judged = found.model.validation_fit
    own = {item.name for item in begun_anew(validation, found.model.candidates)}
    own |= {name for candidate in found.model.candidates for name in candidate.nuisance}
    free = [item for item in with_start(judged) if item.name in own]
    freed = {item.name for item in free}
    # an instant is known to the sample there, and no longer free
    known = {**judged.by_name, **{name: value for name, value in values.items() if name not in own}}
    constant = {name: value for name, value in known.items() if name not in freed}
    return fit(validation.sensed, free, constant, rounds=2, iterations=6, full_band=is_full_band(found.model.candidates), slopes="kept")
