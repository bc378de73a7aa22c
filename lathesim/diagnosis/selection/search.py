"""Which effects were left out: the baseline is fitted, a model grows on it, and what would be wrong with it is looked into."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from lathesim.diagnosis.candidates.plausible_sizes import possible_sizes
from lathesim.diagnosis.method import Settings
from lathesim.diagnosis.records.search import Found
from lathesim.diagnosis.selection.acceptance import of_usual_size
from lathesim.diagnosis.selection.forward import grow, leave_out, same_effects
from lathesim.diagnosis.selection.laboratory import STRAINED, Bench, strains, strains_anew
from lathesim.diagnosis.selection.lag_ties import ties_of_late_effects
from lathesim.diagnosis.selection.moves.fix_parameters import drop_needless_values
from lathesim.diagnosis.selection.moves.generalise import refine
from lathesim.diagnosis.selection.moves.implausible_value import value_far_off
from lathesim.diagnosis.selection.moves.prerequisite import put_on_ground
from lathesim.diagnosis.selection.moves.restart import other_beginnings, plainly_better
from lathesim.diagnosis.selection.moves.retry_rivals import try_rivals_again
from lathesim.diagnosis.selection.moves.simplify import simpler_relatives
from lathesim.diagnosis.selection.moves.specialise import plain_forms
from lathesim.diagnosis.selection.moves.split import forms_of_two, two_for_one
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.execution.budget import Tell, until
from lathesim.identification.records.candidate import Term
from lathesim.identification.replay.experiment import Rig, baseline_free

_MOST_REFUSED = 2
"""Refusals after which a model is not grown on."""


def search(rig: Rig, held_out: Rig, settings: Settings | None = None, tell: Tell | None = None) -> Found:
    """Search the candidates of a rig; ``held_out`` judges. Stopped with Ctrl-C it gives what was found until then."""
    chosen = replace(settings or Settings(), possible=possible_sizes(rig))
    say = tell or (lambda text: None)
    say("fitting the baseline")
    bench = Bench(rig, held_out, until(chosen.longest, say), least_gain=chosen.margin)
    fitted = fit(rig.sensed, [*baseline_free(rig.machine), *rig.start_states(rig.sensed.plan)], rounds=3)
    bench.weigh(fitted)
    fitted = bench.feeling(fitted, ())
    bench.weigh(fitted)
    baseline = bench.model((), fitted)
    found = Found(baseline, baseline)
    try:
        _grown(bench, found, chosen)
        for other in other_beginnings(bench, found, chosen):
            if not chosen.affords(bench.runs, len(bench.rig.candidates)):
                found.ended_after = bench.runs
                break
            why = "values are strained" if other.to_ease else "something takes away much and is not believed"
            bench.say(f"{why}: once more with {_listed(other.model.terms)}")
            other.model = bench.settled(other.model)
            if not all(of_usual_size(term, other.model.fitted.by_name, chosen) for term in other.model.terms):
                continue
            _grown(bench, other, replace(chosen, despite_strain=other.to_ease), known=found.model.terms)
            found.tried += other.tried
            found.ended_after = found.ended_after or other.ended_after
            if plainly_better(other, found, chosen):
                bench.say("better than what was found before")
                found = replace(other, tried=found.tried, ended_after=found.ended_after)
                break
        if simpler := two_for_one(bench, baseline, found.model):
            found.model = bench.settled(simpler[0])
            found.trials |= {trial.term.part: [trial] for trial in simpler[1]}
            bench.say(f"as good and simpler: {' and '.join(trial.term.name for trial in simpler[1])}")
        simpler_relatives(bench, found)
        drop_needless_values(bench, found)
        plain_forms(bench, found)
        if far := value_far_off(bench, baseline, found.model):
            names = (far.name, *far.instead)
            if far.better:
                bench.say(f"better than any effect: {far.name} is further off than the lesson holds possible")
                found.model, found.far_off, found.factor_instead = far.model, names, far.factor
            elif found.model.terms:
                found.values_instead = names
        try_rivals_again(bench, found, chosen)
        ties_of_late_effects(bench, found, chosen)
        found.forms = forms_of_two(bench, found.model)
        found.complete = True
    except KeyboardInterrupt:
        bench.say("stopped; what was found until here is kept")
    return found


def _listed(terms: Iterable[Term]) -> str:
    return " and ".join(term.name for term in terms)


def _grown(bench: Bench, found: Found, settings: Settings, known: Sequence[Term] = ()) -> None:
    """Let a model grow, refine it, and take out again what needs a machine that is not there; one that comes to the ``known`` effects of
    another model is that one."""
    grow(bench, found, settings, known)
    if known and same_effects(found.model.terms, known):
        return
    if refine(bench, found, settings):
        grow(bench, found, settings)
    if put_on_ground(bench, found, settings):
        grow(bench, found, settings)
    while strains_anew(found.baseline.fitted, found.model.fitted) or _is_straining(found):
        last = found.model.terms[-1]
        bench.say(f"{last.name} at {last.at} is refused: with it a value would be further off than the lesson holds possible")
        found.refused.add(last.part)
        if last.part not in found.before:
            leave_out(found, [last], bench.rig, bench.held_out, bench.say)
            continue
        found.model = found.before[last.part]
        if len(found.refused) <= _MOST_REFUSED:
            # what it had made needless is there again, and something else may come beside that or in its place
            grow(bench, found, settings)


def _is_straining(found: Found) -> bool:
    """Say whether the effect that came in last needs a machine that is not there."""
    return (
        bool(found.model.terms)
        and found.model.terms[-1].part in found.straining
        and strains(found.model.fitted).max(initial=0.0) > STRAINED
    )
