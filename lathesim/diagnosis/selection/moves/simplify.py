"""A simpler relative in the place of an effect, once everything is in: beside an error that was not explained yet the one with more values
gained more, and took its name from what the others have explained since."""

from __future__ import annotations

from lathesim.diagnosis.candidates.screening import screen
from lathesim.diagnosis.candidates.starting_points import starting_points
from lathesim.diagnosis.records.search import Found
from lathesim.diagnosis.selection.elimination import fewer
from lathesim.diagnosis.selection.laboratory import Bench
from lathesim.diagnosis.selection.moves.split import AS_GOOD, AS_GOOD_SHARE
from lathesim.diagnosis.selection.trials import Asked, side_by_side
from lathesim.identification.records.candidate import Term
from lathesim.identification.records.model import Model, Trial, is_wide

_PROMISED, _MOST = 0.5, 3
"""Share of the error left without an effect that a relative must promise to take away, and how many are asked."""


def simpler_relatives(bench: Bench, found: Found) -> None:
    """Put simpler relatives in the place of effects of a model of several, where both recordings are explained as well by them.

    Asked are those of the same family with fewer values that promise most beside the other effects; the effect itself is told to be tied
    with the one that takes its place.
    """
    for term in found.model.terms if len(found.model.terms) > 1 else ():
        rest = tuple(other for other in found.model.terms if other is not term)
        relatives = [other for other in bench.rig.candidates if _is_simpler(other, term) and other not in rest]
        if not relatives:
            continue
        bench.say(f"asking whether something simpler does what {term.name} at {term.at} does")
        before = fewer(bench, found.model, term)
        own = _held_against(found.model, before)
        points = starting_points(bench.rig, before.fitted, relatives)
        promising = [item for item in screen(bench.rig.sensed, before.fitted, relatives, points).ranked if item.share > _PROMISED]
        asked = [Asked(item.term, rest, before.free, item.starts[:1]) for item in promising[:_MOST]]
        trials = side_by_side(bench, before, asked)
        good = [trial for trial in trials if _as_good(trial, own)]
        if good:
            best = max(good, key=lambda trial: (-len(trial.term.parameters), trial.gain))
            gain, held_out_gain, wide, wide_held_out = own
            of_all, of_rest = best.share_of_all, best.share_of_rest
            was = Trial(
                term, found.model, gain, held_out_gain, best.moves, of_all, of_rest, wide_gain=wide, wide_held_out_gain=wide_held_out
            )
            found.model = bench.settled(best.model)
            found.trials[best.term.part] = [best, was]
            bench.say(f"as good and simpler: {best.term.name} at {best.term.at}")


def _is_simpler(term: Term, other: Term) -> bool:
    return term.family == other.family and len(term.parameters) < len(other.parameters)


def _as_good(trial: Trial, own: tuple[float, float, float, float]) -> bool:
    """Say whether a trial gains what ``own`` does, on both recordings: the gains in the band of the motion and on all frequencies."""
    gains = (trial.gain, trial.held_out_gain, trial.wide_gain, trial.wide_held_out_gain)
    return all(gain > other - max(AS_GOOD, AS_GOOD_SHARE * abs(other)) for gain, other in zip(gains, own, strict=True))


def _held_against(model: Model, before: Model) -> tuple[float, float, float, float]:
    """Give the gains of a model on the fitted and the held-out recording, as a trial counts them, and both on all frequencies."""
    wide = is_wide(model.terms)
    pairs = ((model.score, before.score), (model.held_out, before.held_out))
    first, second = (ours.above(theirs, wide=wide) for ours, theirs in pairs)
    third, fourth = (ours.above(theirs, wide=True) for ours, theirs in pairs)
    return first, second, third, fourth
