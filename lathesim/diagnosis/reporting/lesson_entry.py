"""The line of a lesson that puts a found effect in, without what the recording does not determine and the effect does without."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from lathesim.component import Parameter
from lathesim.diagnosis.candidates.phase_sign import phases_to_turn
from lathesim.diagnosis.records.diagnosis import FoundEffect
from lathesim.diagnosis.records.search import Found
from lathesim.diagnosis.reporting.effect_report import declared_in
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.estimation.transfer import begun_anew
from lathesim.identification.records.candidate import Term
from lathesim.identification.records.fit import Fitted, with_start
from lathesim.identification.records.model import is_wide
from lathesim.identification.replay.experiment import Rig

_WORSE = 1.02
"""Times by which a channel's residual may grow where a part of an effect is left out that the recording does not determine."""


def lesson_entry(effect: FoundEffect, term: Term, fitted: Fitted, rig: Rig) -> dict[str, str]:
    """Give the entry for the lesson; what belongs to a recording is that of the fitted one."""
    quantities = {}
    for name, item in effect.parameters.items():
        if name not in effect.left_out:
            quantities[name] = written(item.value, item.unit)
        elif (neutral := _neutral_where_not_default(term, name, rig)) is not None:
            quantities[name] = written(neutral, item.unit)
    for name in term.effect.neutral:
        # a size that is held at nothing, as no recording needs it
        if f"{term.part}.{name}" not in term.parameters and (neutral := _neutral_where_not_default(term, name, rig)) is not None:
            quantities[name] = written(neutral, declared_in(rig, f"{term.part}.{name}").unit)
    for name in term.nuisance:
        short = name.partition(".")[2]
        if name in fitted.by_name and short not in quantities:
            half_turn = np.pi if name in phases_to_turn(term, fitted.by_name) else 0.0
            quantities[short] = written(fitted.by_name[name] + half_turn, declared_in(rig, name).unit)
    return {"effect": effect.effect, "at": effect.at, **term.senses, **quantities}


def written(value: float, unit: str) -> str:
    """Give a quantity as a lesson takes it: a number with its unit, a pure number alone."""
    number = f"{value:.6g}"
    return number if unit == "1" else f"{number} {unit}"


def _neutral_where_not_default(term: Term, name: str, rig: Rig) -> float | None:
    """Give the neutral value of a parameter that would have another one where it is not named."""
    declared = declared_in(rig, f"{term.part}.{name}")
    neutral = term.effect.neutral.get(name)
    return neutral if isinstance(declared, Parameter) and neutral is not None and neutral != declared.default else None


def without_undetermined(
    effects: Sequence[FoundEffect], terms: Sequence[Term], held_out: Rig, found: Found, values: Mapping[str, float]
) -> list[FoundEffect]:
    """Give the effects with what may be left out of their lines: parts that are not determined, may be nothing, and are not missed.

    A hump at a speed that was never run explains nothing here, and in the lesson it would invent something there. An effect keeps at
    least one value that makes it felt; whether a part is missed is asked of the held-out recording.
    """
    found_effects = []
    for effect, term in zip(effects, terms, strict=True):
        vanishing = _may_be_nothing(effect, term)
        choices = [effect.undetermined, vanishing] if vanishing else []
        chosen = next((names for names in choices if _is_not_missed(names, term, held_out, found, values)), ())
        found_effects.append(replace(effect, left_out=tuple(chosen)))
    return found_effects


def _may_be_nothing(effect: FoundEffect, term: Term) -> tuple[str, ...]:
    """Give the undetermined parameters whose intervals hold the value with which their part vanishes, where something else remains."""
    sizes = {name: item for name, item in effect.parameters.items() if name in term.effect.neutral}
    nothing = [name for name, item in sizes.items() if name in effect.undetermined and item.low <= term.effect.neutral[name] <= item.high]
    felt = [name for name, item in sizes.items() if name not in effect.undetermined and item.value != term.effect.neutral[name]]
    return tuple(nothing) if felt else ()


def _is_not_missed(names: Sequence[str], term: Term, held_out: Rig, found: Found, values: Mapping[str, float]) -> bool:
    """Say whether the held-out recording is explained as well with some parameters of an effect as they are where nobody names them."""
    neutral = {}
    for name in names:
        declared = declared_in(held_out, f"{term.part}.{name}")
        assert isinstance(declared, Parameter)
        neutral[f"{term.part}.{name}"] = term.effect.neutral.get(name, declared.default)
    sizes = [_residual_sizes(held_out, found, {**values, **changed}) for changed in ({}, neutral)]
    return bool(np.all(sizes[1] <= _WORSE * sizes[0]))


def _residual_sizes(held_out: Rig, found: Found, values: Mapping[str, float]) -> np.ndarray:
    fitted = on_held_out(held_out, found, values)
    return np.asarray(np.sqrt(np.mean(fitted.residual**2, axis=1)))


def on_held_out(held_out: Rig, found: Found, values: Mapping[str, float]) -> Fitted:
    """Fit what belongs to the held-out recording beside given values: its start, its phases."""
    judged = found.model.held_out_fit
    own = {item.name for item in begun_anew(held_out, found.model.terms)}
    own |= {name for term in found.model.terms for name in term.nuisance}
    free = [item for item in with_start(judged) if item.name in own]
    freed = {item.name for item in free}
    # an instant is known to the sample there, and no longer free
    known = {**judged.by_name, **{name: value for name, value in values.items() if name not in own}}
    constant = {name: value for name, value in known.items() if name not in freed}
    return fit(held_out.sensed, free, constant, rounds=2, iterations=6, wide=is_wide(found.model.terms), slopes="kept")
