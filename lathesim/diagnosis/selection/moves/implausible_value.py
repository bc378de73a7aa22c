"""A value of the lesson that is further off than the lesson holds possible: a load on the table, another motor, a slip of the pen.

Where the values of the machine are strained, each uncertain one is let loose by itself, with effects and without them. One that explains
both recordings better than what was found takes its place: a single number that is wrong is likelier than physics of a strange size.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from lathesim.diagnosis.recording_checks.controller_value import FURTHEST
from lathesim.diagnosis.selection.laboratory import Bench, is_strained, judged_score
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.execution.threads import together
from lathesim.identification.records.candidate import Term
from lathesim.identification.records.fit import Free, with_start
from lathesim.identification.records.model import Model, is_wide
from lathesim.identification.replay.experiment import Rig, baseline_free

_WIDER = 10.0
"""By what factor a value may be further off than declared."""
_BETTER = 0.03
"""Share of what is gained by which one explanation must be better than another; within it they cannot be told apart."""
_LEAST = 10.0
"""Nats that a value must gain."""
_HOPELESS = 0.3
"""Share of what was reached below which, after a rough fit of the fitted recording, a value is not fitted on; what is reached counts a gain
there one and a half times at most."""


@dataclass(frozen=True)
class FarOff:
    """A model with one value let loose: its name, and others of which any would do as well."""

    model: Model
    name: str
    instead: tuple[str, ...]
    better: bool
    """Whether it explains clearly more than what was found; else it explains as much."""
    factor: str = ""
    """The factor of a sensor that would do as well, and by which it is better only as the likelier of two numbers."""


def value_far_off(bench: Bench, baseline: Model, model: Model) -> FarOff | None:
    """Give the model with the value that explains more than ``model`` does once it is let loose, or as much; none where no value does."""
    if not is_strained(baseline.fitted):
        return None
    bench.say("asking whether one value that is further off than the lesson holds possible explains it")
    reached = _merit(model, baseline)
    for terms, start in (((), baseline), (model.terms, model)) if model.terms else (((), baseline),):
        if start is model and not is_strained(model.fitted):
            continue
        found = sorted(_each(bench, baseline, terms, start, reached), key=lambda item: -item[0])
        if not found:
            continue
        best, name, loose = found[0]
        width = max(_LEAST, _BETTER * abs(best))
        if best > reached - width and best > _LEAST:
            alike = tuple(other for merit, other, _ in found[1:] if merit > best - width)
            # effects beside which other values would have to be impossible still are no rivals of one value that does as well, and an
            # encoder that is off by any factor is one number too, and the stranger one
            factor = _factor(model, bench.rig)
            beaten = best > reached + (-width if not terms and (factor or is_strained(model.fitted)) else width)
            return FarOff(loose, name, alike, beaten, factor if beaten and best < reached + width else "")
    return None


def _factor(model: Model, rig: Rig) -> str:
    """Tell the one effect of a model that makes what an encoder counts a multiple of the way; empty where that is not all there is, and at
    other sensors, whose gains are adjusted by hand."""
    if len(model.terms) != 1 or not model.terms[0].effect.proportional:
        return ""
    (term,) = model.terms
    if not any(part.name == term.at and "resolution" in part.component.ports for part in rig.machine.assembly.parts):
        return ""
    return f"{model.fitted.by_name[term.parameters[0]]:.4g} times the true value at {term.at}"


def _each(bench: Bench, baseline: Model, terms: tuple[Term, ...], start: Model, reached: float) -> list[tuple[float, str, Model]]:
    """Give merit, name and model for each value that no other one is strained beside and that comes near what was ``reached``."""
    wide, constant = is_wide(terms), start.fitted.constant

    def loosened(item: Free) -> tuple[float, str, Model] | None:
        free = [replace(item, start=other.start) if other.name == item.name else other for other in start.free]
        free = [replace(other, start=other.given) if other.name in bench.rig.machine.uncertain else other for other in free]
        rough = fit(bench.rig.sensed, free, constant, rounds=1, wide=wide, slopes="kept")
        if judged_score(bench.rig, rough).above(baseline.score, wide=True) < _HOPELESS * reached:
            return None
        fitted = fit(bench.rig.sensed, with_start(rough), constant, rounds=3, wide=wide)
        loose = bench.model(terms, bench.feeling(fitted, terms))
        return None if is_strained(loose.fitted) else (_merit(loose, baseline), item.name, loose)

    loose_ones = [_of_a_machine(item) for item in baseline_free(bench.rig.machine, _WIDER)]
    return [found for found in together(loosened, loose_ones) if found is not None]


def _of_a_machine(item: Free) -> Free:
    """Give a loosened value within a factor of what the lesson gives: a motor without any force explains whatever hides behind it."""
    low, high = sorted((item.given / FURTHEST, item.given * FURTHEST))
    return replace(item, low=max(item.low, low), high=min(item.high, high)) if item.given else item


def _merit(model: Model, baseline: Model) -> float:
    fitted, held = (ours.above(theirs, wide=True) for ours, theirs in ((model.score, baseline.score), (model.held_out, baseline.held_out)))
    return min(fitted, held) + 0.5 * fitted
