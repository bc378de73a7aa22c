"""A value of the lesson that is further off than the lesson holds possible: a load on the table, another motor, a slip of the pen.

Where the values of the machine are implausible, each uncertain one is let loose by itself, with effects and without them. One that explains
both recordings better than what was found takes its place: a single number that is wrong is likelier than physics of a strange size.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection.compare_models import Gains, ModelComparison, compare_models
from lathesim.diagnosis.selection.laboratory import Laboratory, is_implausible, judged_score
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.execution.threads import together
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.records.fit import Free, with_start
from lathesim.identification.records.model import Model, is_full_band
from lathesim.identification.replay.experiment import Experiment, baseline_free


@dataclass(frozen=True)
class ImplausibleValue:
    """A model with one value let loose: its name, and others of which any would do as well."""

    model: Model
    name: str
    instead: tuple[str, ...]
    better: bool
    """Whether it explains clearly more than what was found; else it explains as much."""
    factor: str = ""
    """The factor of a sensor that would do as well, and by which it is better only as the likelier of two numbers."""


def free_a_value(laboratory: Laboratory, found: SearchResult, method: Method) -> SearchResult:
    """Return the search with one value of the lesson in the place of effects, or as a rival of what was found."""
    far = find_implausible_value(laboratory, found.baseline, found.model, method=method)
    if far is None:
        return found
    names = (far.name, *far.instead)
    if far.better:
        laboratory.progress(f"better than any effect: {far.name} is outside the plausible range of the lesson")
        why = f"{far.name} explains more than any effect"
        return found.accepted(far.model, "implausible value", why, far_off=names, factor_instead=far.factor)
    return replace(found, values_instead=names) if found.model.candidates else found


def find_implausible_value(laboratory: Laboratory, baseline: Model, model: Model, method: Method = STANDARD) -> ImplausibleValue | None:
    """Return the model with the value that explains more than ``model`` does once it is let loose, or as much; none where no value does."""
    if not is_implausible(baseline.fitted, method=method):
        return None
    laboratory.progress("asking whether one value outside its plausible range explains it")
    reached = merit_of(model, baseline)
    for candidates, start in (((), baseline), (model.candidates, model)) if model.candidates else (((), baseline),):
        if start is model and not is_implausible(model.fitted, method=method):
            continue
        found = sorted(_each(laboratory, baseline, candidates, start, reached, method=method), key=lambda item: -item[0])
        if not found:
            continue
        best, name, loose = found[0]
        if against(best, reached, best, method).as_good and compare_models(Gains(best), method, effects=1).better:
            alike = tuple(other for merit, other, _ in found[1:] if against(merit, best, best, method).as_good)
            # effects beside which other values would have to be impossible still are no rivals of one value that does as well, and an
            # encoder that is off by any factor is one number too, and the stranger one
            factor = factor_of(model, laboratory.experiment)
            stranger = not candidates and bool(factor or is_implausible(model.fitted, method=method))
            better = against(best, reached, best, method, effects=1).better
            return ImplausibleValue(loose, name, alike, better or stranger, factor if stranger and not better else "")
    return None


def against(merit: float, other: float, explained: float, method: Method, effects: int = 0) -> ModelComparison:
    """Return how one explanation by a value compares with another one, from the merits of both [nats]."""
    return compare_models(Gains(merit - other), method, effects=effects, explained=explained)


def factor_of(model: Model, experiment: Experiment) -> str:
    """Return the factor of the one effect of a model that makes what an encoder counts a multiple of the way. It is empty where that is not
    all there is, and at other sensors, whose gains are adjusted by hand."""
    if len(model.candidates) != 1 or not model.candidates[0].effect.proportional:
        return ""
    (candidate,) = model.candidates
    if not any(part.name == candidate.at and "resolution" in part.component.ports for part in experiment.machine.assembly.parts):
        return ""
    return f"{model.fitted.by_name[candidate.parameters[0]]:.4g} times the true value at {candidate.at}"


def _each(
    laboratory: Laboratory, baseline: Model, candidates: tuple[Candidate, ...], start: Model, reached: float, method: Method = STANDARD
) -> list[tuple[float, str, Model]]:
    """Return merit, name and model for each value that no other one is implausible beside and that comes near what was ``reached``."""
    full_band, constant = is_full_band(candidates), start.fitted.constant

    def loosened(item: Free) -> tuple[float, str, Model] | None:
        free = [replace(item, start=other.start) if other.name == item.name else other for other in start.free]
        free = [replace(other, start=other.given) if other.name in laboratory.experiment.machine.uncertain else other for other in free]
        rough = fit(laboratory.experiment.sensed, free, constant, rounds=1, full_band=full_band, slopes="kept")
        if judged_score(laboratory.experiment, rough).above(baseline.score, full_band=True) < method.selection.hopeless * reached:
            return None
        fitted = fit(laboratory.experiment.sensed, with_start(rough), constant, rounds=3, full_band=full_band)
        loose = laboratory.model(candidates, laboratory.with_better_motion(fitted, candidates))
        return None if is_implausible(loose.fitted, method=method) else (merit_of(loose, baseline), item.name, loose)

    loose_ones = [of_a_machine(item, method=method) for item in baseline_free(laboratory.experiment.machine, method.selection.value_wider)]
    return [found for found in together(loosened, loose_ones) if found is not None]


def of_a_machine(item: Free, method: Method = STANDARD) -> Free:
    """Return a loosened value within a factor of what the lesson gives: a motor without any force explains whatever hides behind it."""
    low, high = sorted((item.given / method.recording_checks.value_factor, item.given * method.recording_checks.value_factor))
    return replace(item, low=max(item.low, low), high=min(item.high, high)) if item.given else item


def merit_of(model: Model, baseline: Model) -> float:
    """Return what a model is held against another explanation by: its gain over the baseline on both recordings [nats]."""
    fitted, held = (
        ours.above(theirs, full_band=True) for ours, theirs in ((model.score, baseline.score), (model.validation, baseline.validation))
    )
    return min(fitted, held) + 0.5 * fitted
