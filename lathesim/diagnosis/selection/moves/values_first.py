"""Values of the lesson that are all there is to it: further off than declared, tried before any effect.

Where the baseline wants values beyond their declared uncertainties, all of them are let loose together, and a model is grown on that as on
any baseline. If nothing of the catalogue is then believable, the values are the answer: fewer numbers, and none of them new. If something
is, the values were making up for it, and the search goes on as if nobody had asked.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from math import erf, exp, inf, log, sqrt

from lathesim.diagnosis.method import Method
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection.compare_models import due
from lathesim.diagnosis.selection.forward import grow, last_of
from lathesim.diagnosis.selection.laboratory import Laboratory, is_implausible
from lathesim.diagnosis.selection.moves.implausible_value import against, factor_of, merit_of, of_a_machine
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.records.fit import Fitted, with_start
from lathesim.identification.records.model import Model
from lathesim.identification.replay.experiment import POSSIBLE, baseline_free
from lathesim.recordings.faults.known_factors import known_factor


def values_first(laboratory: Laboratory, found: SearchResult, method: Method) -> SearchResult:
    """Return the search with values alone, where these explain both recordings: the model and the names of the values, the one first that
    is off by most declared deviations."""
    experiment, baseline = laboratory.experiment, found.baseline
    if not is_implausible(baseline.fitted, method=method):
        return found
    laboratory.progress("asking whether values further off than declared are all there is to it")
    loose = _loosened(laboratory, baseline, method)
    off = _off(loose.fitted, experiment.machine.uncertain)
    if (
        not off
        or _at_a_bound(loose, off, method)
        or is_implausible(loose.fitted, method=method)
        or _is_a_common_factor(loose, off, experiment.machine.uncertain, method)
        or not loose.validation.above(baseline.validation, full_band=True) > 0.0
    ):
        return found
    beside = Laboratory(experiment, laboratory.validation, laboratory.progress, least_gain=due(method), method=method)
    beside.weigh(loose.fitted)
    grown = last_of(grow(beside, SearchResult(beside.model((), loose.fitted), beside.model((), loose.fitted)), method))
    found = found.having_tried(grown.tried)
    if grown.model.candidates:
        return found
    laboratory.progress(f"nothing is missing beside {', '.join(off)}, which are further off than the lesson holds possible")
    factor = _factor_instead(laboratory, baseline, loose, method) if len(off) == 1 else ""
    why = "values of the lesson alone explain the recordings"
    return found.accepted(loose, "values first", why, far_off=(off[0],), jointly_off=tuple(off), factor_instead=factor)


def _loosened(laboratory: Laboratory, baseline: Model, method: Method) -> Model:
    """Return the model without effects whose values may be further off, each within a factor of what the lesson gives.

    Which ones are off is asked with all of them held less firmly. A value that is off is then no longer held at all, and the others are
    held as the lesson declares them: of a force constant and a mass a motion shows the ratio, and a mass that is held where it is not
    would take the constant along with it.
    """
    fitted, off = _fitted_loosely(laboratory, baseline.fitted, (), method), []
    while further := [name for name in _off(fitted, laboratory.experiment.machine.uncertain) if name not in off]:
        off.append(further[0])
        fitted = _fitted_loosely(laboratory, fitted, off, method)
    return laboratory.settled(laboratory.model((), fitted))


def _fitted_loosely(laboratory: Laboratory, before: Fitted, off: Collection[str], method: Method) -> Fitted:
    """Return the lesson fitted from where another fit ended, with values that may be further off: those that are ``off`` are not held, the
    others as declared; all are held less firmly where none is known to be off."""
    experiment = laboratory.experiment
    values = [of_a_machine(item, method) for item in baseline_free(experiment.machine, method.selection.value_wider)]
    if off:
        declared = experiment.machine.uncertain
        values = [replace(item, uncertainty=inf if item.name in off else declared[item.name]) for item in values]
    # a value that is held begins where it is declared: along a mixture that no motion shows a descent would end early
    held = {item.name for item in values} - set(off)
    free = [*values, *experiment.start_states(experiment.sensed.plan)]
    free = [replace(item, start=before.by_name.get(item.name, item.start)) if item.name not in held else item for item in free]
    return fit(experiment.sensed, free, before.constant, rounds=2, slopes="kept")


def _factor_instead(laboratory: Laboratory, baseline: Model, loose: Model, method: Method) -> str:
    """Return the factor of an encoder that explains as much as the values do, were it so far off; empty where none does."""
    reached = merit_of(loose, baseline)
    for candidate in (item for item in laboratory.experiment.candidates if item.effect.proportional):
        trial = laboratory.trial(baseline, candidate, (), with_start(baseline.fitted), [candidate.points[0]])
        model = laboratory.settled(trial.model)
        if against(merit_of(model, baseline), reached, reached, method).as_good and (factor := factor_of(model, laboratory.experiment)):
            return factor
    return ""


def _at_a_bound(loose: Model, names: Collection[str], method: Method) -> bool:
    """Return whether a value would go further still if it might: then it is not the value that explains."""
    values = loose.fitted.by_name
    room = {item.name: method.selection.value_at_bound * (item.high - item.low) for item in loose.fitted.free}
    return any(
        not item.low + room[item.name] < values[item.name] < item.high - room[item.name] for item in loose.fitted.free if item.name in names
    )


def _is_a_common_factor(loose: Model, names: Collection[str], uncertain: Mapping[str, float], method: Method) -> bool:
    """Return whether all values are off by one factor that a mistaken unit leaves: then a reading is at fault, and no value is off.

    The logarithms of two independent values with relative deviations s1, s2 agree within d with the probability
    erf(d/sqrt(2 (s1^2 + s2^2))). Below the false-alarm rate, the agreement is no chance.
    """
    values = loose.fitted.by_name
    given = {item.name: item.given for item in loose.fitted.free}
    ratios = {name: values[name] / given[name] for name in names if given[name]}
    if len(ratios) < 2 or len(ratios) < len(uncertain) or min(ratios.values()) <= 0.0:
        return False
    logarithms = sorted((log(ratio), (uncertain[name] / given[name]) ** 2) for name, ratio in ratios.items())
    (least, first), (most, last) = logarithms[0], logarithms[-1]
    is_one = erf((most - least) / sqrt(2.0 * (first + last))) < method.verdict.false_alarms
    return is_one and bool(known_factor(exp(0.5 * (least + most))))


def _off(loose: Fitted, uncertain: Mapping[str, float]) -> list[str]:
    """Return the values beyond what the lesson holds possible, the furthest first."""
    values = loose.by_name
    given = {item.name: item.given for item in loose.free}
    away = {name: abs(values[name] - given[name]) / deviation for name, deviation in uncertain.items() if name in values}
    return sorted((name for name, deviations in away.items() if deviations > POSSIBLE), key=lambda name: -away[name])
