"""Which effects were left out: the baseline is fitted, a model grows on it, and what would be wrong with it is looked into."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from lathesim.diagnosis.candidates.plausible_sizes import possible_sizes
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.records.history import Step
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection.acceptance import of_usual_size
from lathesim.diagnosis.selection.forward import grow, leave_out, same_effects
from lathesim.diagnosis.selection.laboratory import IMPLAUSIBLE, Laboratory, becomes_implausible, prior_deviations
from lathesim.diagnosis.selection.lag_ties import ties_of_late_effects
from lathesim.diagnosis.selection.moves.fix_parameters import fix_parameters
from lathesim.diagnosis.selection.moves.generalise import generalise
from lathesim.diagnosis.selection.moves.implausible_value import find_implausible_value
from lathesim.diagnosis.selection.moves.prerequisite import add_prerequisites
from lathesim.diagnosis.selection.moves.restart import plainly_better, restarts
from lathesim.diagnosis.selection.moves.retry_rivals import retry_rivals
from lathesim.diagnosis.selection.moves.simplify import simplify
from lathesim.diagnosis.selection.moves.specialise import specialise
from lathesim.diagnosis.selection.moves.split import forms_of_two, two_for_one
from lathesim.diagnosis.selection.moves.values_first import values_first
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.execution.budget import Progress, until
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.replay.experiment import Experiment, baseline_free


def search(experiment: Experiment, validation: Experiment, method: Method = STANDARD, tell: Progress | None = None) -> SearchResult:
    """Search the candidates of an experiment; ``validation`` judges. Stopped with Ctrl-C it gives what was found until then."""
    chosen = replace(method, possible=possible_sizes(experiment, method=method))
    progress = tell or (lambda text: None)
    progress("fitting the baseline")
    laboratory = Laboratory(experiment, validation, until(chosen.longest, progress), least_gain=chosen.margin, method=chosen)
    fitted = fit(experiment.sensed, [*baseline_free(experiment.machine), *experiment.start_states(experiment.sensed.plan)], rounds=3)
    laboratory.weigh(fitted)
    fitted = laboratory.with_better_motion(fitted, ())
    laboratory.weigh(fitted)
    baseline = laboratory.model((), fitted)
    found = SearchResult(baseline, baseline)
    try:
        if values_first(laboratory, found, chosen):
            found.complete = True
            return found
        _grown(laboratory, found, chosen)
        for other in restarts(laboratory, found, chosen):
            if not chosen.affords(laboratory.runs, len(laboratory.experiment.candidates)):
                found.ended_after = laboratory.runs
                break
            why = "implausible parameter values" if other.to_ease else "a candidate explains much of the error but was not accepted"
            laboratory.progress(f"{why}: restarting the search from {_listed(other.model.candidates)}")
            other.model = laboratory.settled(other.model)
            if not all(of_usual_size(candidate, other.model.fitted.by_name, chosen) for candidate in other.model.candidates):
                continue
            _grown(laboratory, other, replace(chosen, despite_implausible_values=other.to_ease), known=found.model.candidates)
            found.tried += other.tried
            found.ended_after = found.ended_after or other.ended_after
            if plainly_better(other, found, chosen):
                laboratory.progress("better than what was found before")
                found = replace(other, tried=found.tried, ended_after=found.ended_after, history=_restarted(found, other))
                break
        if simpler := two_for_one(laboratory, baseline, found.model, method=chosen):
            found.accept(laboratory.settled(simpler[0]), "merge", "one effect explains as much as two")
            found.trials |= {trial.candidate.part: [trial] for trial in simpler[1]}
            laboratory.progress(f"as good and simpler: {' and '.join(trial.candidate.name for trial in simpler[1])}")
        simplify(laboratory, found, method=chosen)
        fix_parameters(laboratory, found, method=chosen)
        specialise(laboratory, found, method=chosen)
        if far := find_implausible_value(laboratory, baseline, found.model, method=chosen):
            names = (far.name, *far.instead)
            if far.better:
                laboratory.progress(f"better than any effect: {far.name} is outside the plausible range of the lesson")
                found.accept(far.model, "implausible value", f"{far.name} explains more than any effect")
                found.far_off, found.factor_instead = names, far.factor
            elif found.model.candidates:
                found.values_instead = names
        retry_rivals(laboratory, found, chosen)
        ties_of_late_effects(laboratory, found, chosen)
        found.forms = forms_of_two(laboratory, found.model, method=chosen)
        found.complete = True
    except KeyboardInterrupt:
        laboratory.progress("stopped; what was found until here is kept")
    return found


def _restarted(found: SearchResult, other: SearchResult) -> tuple[Step, ...]:
    """Return the history of a search that began again."""
    went, came_in = (tuple(f"{one.name} at {one.at}" for one in result.model.candidates) for result in (found, other))
    gain = other.model.score.above(found.model.score, full_band=True)
    validation_gain = other.model.validation.above(found.model.validation, full_band=True)
    return (*found.history, *other.history, Step("restart", came_in, went, gain, validation_gain, "the other start explains more"))


def _listed(candidates: Iterable[Candidate]) -> str:
    return " and ".join(candidate.name for candidate in candidates)


def _grown(laboratory: Laboratory, found: SearchResult, method: Method, known: Sequence[Candidate] = ()) -> None:
    """Let a model grow, refine it, and take out again what needs a machine that is not there; one that comes to the ``known`` effects of
    another model is that one."""
    grow(laboratory, found, method, known)
    if known and same_effects(found.model.candidates, known):
        return
    if generalise(laboratory, found, method):
        grow(laboratory, found, method)
    if add_prerequisites(laboratory, found, method):
        grow(laboratory, found, method)
    while becomes_implausible(found.baseline.fitted, found.model.fitted) or _is_implausible(found):
        last = found.model.candidates[-1]
        laboratory.progress(f"{last.name} at {last.at} is rejected: it needs a parameter outside the plausible range of the lesson")
        found.refused.add(last.part)
        if last.part not in found.before:
            leave_out(found, [last], laboratory.experiment, laboratory.validation, laboratory.progress, method=method)
            continue
        found.accept(found.before[last.part], "reject", "it needs a parameter outside the plausible range")
        if len(found.refused) <= int(method.selection.most_refused):
            # what it had made needless is there again, and something else may come beside that or in its place
            grow(laboratory, found, method)


def _is_implausible(found: SearchResult) -> bool:
    """Return whether the effect that came in last needs a machine that is not there."""
    return (
        bool(found.model.candidates)
        and found.model.candidates[-1].part in found.implausible_effects
        and prior_deviations(found.model.fitted).max(initial=0.0) > IMPLAUSIBLE
    )
