"""An effect that stands on another one which is not there: what takes the other's place in the model was a wrong beginning.

A spindle that hardly ever turns the other way has a constant torque as well as dry friction; taken for it, what is left at low speed
is called the excess of a friction that is not there. The friction is then tried in the place of either, of both, and beside them: a peak
that is far wider than any takes so much of the friction that this promises little.
"""

from __future__ import annotations

from collections.abc import Iterator

from lathesim.diagnosis.candidates.eligibility import stands
from lathesim.diagnosis.candidates.screening import screen
from lathesim.diagnosis.candidates.starting_points import starting_points
from lathesim.diagnosis.method import Settings
from lathesim.diagnosis.records.search import Found
from lathesim.diagnosis.selection.elimination import fewer
from lathesim.diagnosis.selection.laboratory import Bench
from lathesim.identification.records.candidate import Term
from lathesim.identification.records.model import Model, Trial, is_wide


def put_on_ground(bench: Bench, found: Found, settings: Settings) -> bool:
    """Put what an effect of the model stands on into it, in the place of the effect, of another one at the same part, of both, or of
    none, where that explains both recordings as well for what its values cost; say whether that was done."""
    for term in found.model.terms:
        if stands(term, found.model, bench.rig):
            continue
        others = [other for other in found.model.terms if other is not term and _host(other) == _host(term)]
        grounds = [ground for ground in bench.rig.candidates if ground.name in term.effect.needs and ground.at == term.at]
        bench.say(f"asking whether {' or '.join(ground.name for ground in grounds)} is there, on which {term.name} at {term.at} stands")
        for gone, trial in _instead(bench, found.model, term, others, grounds):
            model = bench.settled(trial.model)
            if _is_as_good(model, found.model, settings):
                for other in gone:
                    found.take_over(trial.term, other)
                bench.say(f"{trial.term.name} at {trial.term.at} takes the place of {' and '.join(other.name for other in gone)}")
                found.trials[trial.term.part] = [trial]
                found.model = model
                return True
            if gone == (term,):
                again = _on_top(bench, trial.model, term)
                both = bench.settled(again.model)
                if _is_as_good(both, found.model, settings):
                    bench.say(f"{trial.term.name} at {trial.term.at} is there too")
                    found.trials |= {trial.term.part: [trial], term.part: [again]}
                    found.model = both
                    return True
    return False


def _instead(bench: Bench, model: Model, term: Term, others: list[Term], grounds: list[Term]) -> Iterator[tuple[tuple[Term, ...], Trial]]:
    """Give the effects that are left out with the trial of a ground in their place, the fewest effects first."""
    for gone in [*((other, term) for other in others), (term,), *((other,) for other in others)]:
        before = model
        for other in gone:
            before = fewer(bench, before, other)
        points = starting_points(bench.rig, before.fitted, grounds)
        for item in screen(bench.rig.sensed, before.fitted, grounds, points).ranked:
            yield gone, bench.trial(before, item.term, before.terms, before.free, item.starts[:1])


def _on_top(bench: Bench, before: Model, term: Term) -> Trial:
    """Try an effect anew on the ground that it needs: from what it was without it, a way to both may be long."""
    (item,) = screen(bench.rig.sensed, before.fitted, [term], starting_points(bench.rig, before.fitted, [term])).ranked
    return bench.trial(before, term, before.terms, before.free, item.starts)


def _is_as_good(model: Model, other: Model, settings: Settings) -> bool:
    """Say whether a model explains both recordings no worse than another one, for what the values and effects cost that it has fewer."""
    fewer_values = sum(len(term.parameters) for term in other.terms) - sum(len(term.parameters) for term in model.terms)
    fewer_effects = len(other.terms) - len(model.terms)
    due = settings.margin * fewer_effects + settings.per_parameter * fewer_values
    wide = is_wide(model.terms) or is_wide(other.terms)
    return min(model.score.above(other.score, wide=wide), model.held_out.above(other.held_out, wide=wide)) > -due


def _host(term: Term) -> str:
    return term.at.partition(".")[0]
