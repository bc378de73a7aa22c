"""A value of the lesson that is further off than the lesson holds possible: a load on the table, another motor, a slip of the pen.

Where the values of the machine are strained, each uncertain one is let loose by itself, with effects and without them. One that explains
both recordings better than what was found takes its place: a single number that is wrong is likelier than physics of a strange size.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from lathesim.diagnosis.fit import fit
from lathesim.diagnosis.problem import baseline_free
from lathesim.diagnosis.terms import Term
from lathesim.diagnosis.trial import Bench, Model, is_strained, is_wide

_WIDER = 10.0
"""By what factor a value may be further off than declared."""
_BETTER = 0.03
"""Share of what is gained by which one explanation must be better than another; within it they cannot be told apart."""
_LEAST = 10.0
"""Nats that a value must gain."""


@dataclass(frozen=True)
class FarOff:
    """A model with one value let loose: its name, and others of which any would do as well."""

    model: Model
    name: str
    instead: tuple[str, ...]
    better: bool
    """Whether it explains clearly more than what was found; else it explains as much."""


def value_far_off(bench: Bench, baseline: Model, model: Model) -> FarOff | None:
    """Give the model with the value that explains more than ``model`` does once it is let loose, or as much; none where no value does."""
    if not is_strained(baseline.fitted):
        return None
    bench.say("asking whether one value that is further off than the lesson holds possible explains it")
    reached = _merit(model, baseline)
    for terms, start in (((), baseline), (model.terms, model)) if model.terms else (((), baseline),):
        if start is model and not is_strained(model.fitted):
            continue
        found = sorted(_each(bench, baseline, terms, start), key=lambda item: -item[0])
        if not found:
            continue
        best, name, loose = found[0]
        width = max(_LEAST, _BETTER * abs(best))
        if best > reached - width and best > _LEAST:
            alike = tuple(other for merit, other, _ in found[1:] if merit > best - width)
            return FarOff(loose, name, alike, best > reached + width)
    return None


def _each(bench: Bench, baseline: Model, terms: tuple[Term, ...], start: Model) -> list[tuple[float, str, Model]]:
    """Give merit, name and model for each value that no other one is strained beside."""
    result = []
    for item in baseline_free(bench.rig.machine, _WIDER):
        free = [replace(item, start=other.start) if other.name == item.name else other for other in start.free]
        free = [replace(other, start=other.given) if other.name in bench.rig.machine.uncertain else other for other in free]
        loose = bench.model(terms, fit(bench.rig.sensed, free, start.fitted.constant, rounds=3, wide=is_wide(terms)))
        if not is_strained(loose.fitted):
            result.append((_merit(loose, baseline), item.name, loose))
    return result


def _merit(model: Model, baseline: Model) -> float:
    fitted, held = (ours.above(theirs, wide=True) for ours, theirs in ((model.score, baseline.score), (model.held_out, baseline.held_out)))
    return min(fitted, held) + 0.5 * fitted
