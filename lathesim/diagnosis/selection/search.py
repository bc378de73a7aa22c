"""Which effects were left out: the baseline is fitted, a model grows on it, and each move proposes a change of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from lathesim.diagnosis.candidates.plausible_sizes import possible_sizes
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.records.history import step_between
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection.acceptance import of_usual_size
from lathesim.diagnosis.selection.compare_models import due
from lathesim.diagnosis.selection.elimination import leave_out
from lathesim.diagnosis.selection.forward import States, grow, last_of, same_effects
from lathesim.diagnosis.selection.laboratory import IMPLAUSIBLE, Laboratory, becomes_implausible, prior_deviations
from lathesim.diagnosis.selection.lag_ties import ties_of_late_effects
from lathesim.diagnosis.selection.moves.fix_parameters import fix_parameters
from lathesim.diagnosis.selection.moves.generalise import generalise
from lathesim.diagnosis.selection.moves.implausible_value import free_a_value
from lathesim.diagnosis.selection.moves.prerequisite import add_prerequisites
from lathesim.diagnosis.selection.moves.restart import comparison_of_starts, restarts
from lathesim.diagnosis.selection.moves.retry_rivals import retry_rivals
from lathesim.diagnosis.selection.moves.simplify import simplify
from lathesim.diagnosis.selection.moves.specialise import specialise
from lathesim.diagnosis.selection.moves.split import note_forms_of_two, one_as_two
from lathesim.diagnosis.selection.moves.values_first import values_first
from lathesim.diagnosis.selection.refusing.earlier import earlier_recording, note_what_was_there
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.execution.budget import Progress, until
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.replay.experiment import Experiment, baseline_free

Move = Callable[[Laboratory, SearchResult, Method], SearchResult]
"""A move returns the search as it found it, or with another model in the place of the one that was found."""

GROWTH_MOVES: tuple[Move, ...] = (generalise, add_prerequisites)
"""Moves of a growing model: effects are added as long as one is believable, then again after each of these that changed the model."""

MOVES: tuple[Move, ...] = (
    one_as_two,
    simplify,
    fix_parameters,
    specialise,
    free_a_value,
    retry_rivals,
    ties_of_late_effects,
    note_forms_of_two,
    note_what_was_there,
)
"""Moves on the grown model, in order. Effects become as simple as they may be before single values of the lesson compete with them, and
rivals are tried again beside what stays; ties are noted last, of the model that is reported."""


def search(
    experiment: Experiment,
    validation: Experiment,
    method: Method = STANDARD,
    tell: Progress | None = None,
    before: Experiment | None = None,
) -> SearchResult:
    """Return what a search among the candidates of an experiment finds; ``validation`` judges. Ctrl-C keeps what was found so far.

    What explains as much of a recording from ``before`` a change is no part of it.
    """
    chosen = replace(method, possible=possible_sizes(experiment, method=method))
    progress = tell or (lambda text: None)
    progress("fitting the baseline")
    laboratory = Laboratory(
        experiment, validation, until(chosen.ends.share(chosen.search_time), progress), least_gain=due(chosen), method=chosen
    )
    laboratory.earlier = None if before is None else earlier_recording(before, method=chosen)
    fitted = fit(experiment.sensed, [*baseline_free(experiment.machine), *experiment.start_states(experiment.sensed.plan)], rounds=3)
    laboratory.weigh(fitted)
    fitted = laboratory.with_better_motion(fitted, ())
    laboratory.weigh(fitted)
    baseline = laboratory.model((), fitted)
    found = SearchResult(baseline, baseline)
    try:
        for state in _states(laboratory, found, chosen):
            found = state
    except KeyboardInterrupt:
        laboratory.progress("stopped; what was found until here is kept")
    return found


def _states(laboratory: Laboratory, found: SearchResult, method: Method) -> States:
    """Return the states that a search goes through, the last one complete."""
    found = values_first(laboratory, found, method)
    if not found.jointly_off:
        found = yield from _growth(laboratory, found, method)
        found = _restarted(laboratory, found, method)
        yield found
        for move in MOVES:
            found = move(laboratory, found, method)
            yield found
    found = replace(found, complete=True)
    yield found
    return found


def _growth(laboratory: Laboratory, found: SearchResult, method: Method, known: Sequence[Candidate] = ()) -> States:
    """Return the states of a search whose model grows, is refined, and loses again what needs a machine that is not there; one that comes
    to the ``known`` effects of another model is that one."""
    found = yield from grow(laboratory, found, method, known)
    if known and same_effects(found.model.candidates, known):
        return found
    for move in GROWTH_MOVES:
        before = found.model
        found = move(laboratory, found, method)
        yield found
        if found.model is not before:
            found = yield from grow(laboratory, found, method)
    while becomes_implausible(found.baseline.fitted, found.model.fitted) or _is_implausible(found):
        last = found.model.candidates[-1]
        laboratory.progress(f"{last.name} at {last.at} is rejected: it needs a parameter outside the plausible range of the lesson")
        found = _rejected(laboratory, found, last, method)
        yield found
        if last.part in found.before and len(found.refused) <= method.selection.most_rivals:
            # what it had made needless is there again, and something else may come beside that or in its place
            found = yield from grow(laboratory, found, method)
    return found


def _rejected(laboratory: Laboratory, found: SearchResult, last: Candidate, method: Method) -> SearchResult:
    """Return the search as it was before an effect came in, which is not tried again."""
    found = replace(found, refused=found.refused | {last.part})
    if last.part not in found.before:
        return leave_out(found, [last], laboratory.experiment, laboratory.validation, laboratory.progress, method=method)
    return found.accepted(found.before[last.part], "reject", "it needs a parameter outside the plausible range")


def _is_implausible(found: SearchResult) -> bool:
    """Return whether the effect that came in last needs a machine that is not there."""
    return (
        bool(found.model.candidates)
        and found.model.candidates[-1].part in found.implausible_effects
        and prior_deviations(found.model.fitted).max(initial=0.0) > IMPLAUSIBLE
    )


def _restarted(laboratory: Laboratory, found: SearchResult, method: Method) -> SearchResult:
    """Return the search that began otherwise and came to a better model, or the one that was found."""
    for start in restarts(laboratory, found, method):
        if not method.affords(laboratory.runs, len(laboratory.experiment.candidates)):
            return replace(found, ended_after=laboratory.runs)
        why = "implausible parameter values" if start.to_ease else "a candidate explains much of the error but was not accepted"
        names = " and ".join(candidate.name for candidate in start.model.candidates)
        laboratory.progress(f"{why}: restarting the search from {names}")
        other = replace(start, model=laboratory.settled(start.model))
        if not all(of_usual_size(candidate, other.model.fitted.by_name, method) for candidate in other.model.candidates):
            continue
        with_ease = replace(method, despite_implausible_values=other.to_ease)
        other = last_of(_growth(laboratory, other, with_ease, known=found.model.candidates))
        found = replace(found.having_tried(other.tried), ended_after=found.ended_after or other.ended_after)
        if comparison := comparison_of_starts(other, found, method):
            laboratory.progress("better than what was found before")
            step = step_between(found.model, other.model, "restart", f"the other start {comparison.reason}")
            return replace(other, tried=found.tried, ended_after=found.ended_after, history=(*found.history, *other.history, step))
    return found
