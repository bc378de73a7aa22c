"""A simpler relative in the place of an effect, once everything is in: beside an error that was not explained yet the one with more values
gained more, and took its name from what the others have explained since."""

from __future__ import annotations

from lathesim.diagnosis.candidates.screening import screen
from lathesim.diagnosis.candidates.starting_points import starting_points
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection.elimination import fewer
from lathesim.diagnosis.selection.laboratory import Laboratory
from lathesim.diagnosis.selection.trials import Asked, side_by_side
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.records.model import Model, Trial, is_full_band


def simplify(laboratory: Laboratory, found: SearchResult, method: Method = STANDARD) -> None:
    """Put simpler relatives in the place of effects of a model of several, where both recordings are explained as well by them.

    Asked are those of the same family with fewer values that screening score most beside the other effects; the effect itself is told to be
    tied with the one that takes its place.
    """
    for candidate in found.model.candidates if len(found.model.candidates) > 1 else ():
        rest = tuple(other for other in found.model.candidates if other is not candidate)
        relatives = [other for other in laboratory.experiment.candidates if _is_simpler(other, candidate) and other not in rest]
        if not relatives:
            continue
        laboratory.progress(f"asking whether something simpler does what {candidate.name} at {candidate.at} does")
        before = fewer(laboratory, found.model, candidate)
        own = _held_against(found.model, before)
        points = starting_points(laboratory.experiment, before.fitted, relatives, method=method)
        promising = [
            item
            for item in screen(laboratory.experiment.sensed, before.fitted, relatives, points, method=method).ranked
            if item.share > method.selection.simpler_score
        ]
        asked = [Asked(item.candidate, rest, before.free, item.starts[:1]) for item in promising[: int(method.selection.most_simpler)]]
        trials = side_by_side(laboratory, before, asked)
        good = [trial for trial in trials if _as_good(trial, own, method=method)]
        if good:
            best = max(good, key=lambda trial: (-len(trial.candidate.parameters), trial.gain))
            gain, validation_gain, full_band, full_band_validation = own
            of_all, of_rest = best.share_of_all, best.share_of_rest
            was = Trial(
                candidate,
                found.model,
                gain,
                validation_gain,
                best.moves,
                of_all,
                of_rest,
                full_band_gain=full_band,
                full_band_validation_gain=full_band_validation,
            )
            found.accept(laboratory.settled(best.model), "simplify", "a simpler effect explains as much")
            found.trials[best.candidate.part] = [best, was]
            laboratory.progress(f"as good and simpler: {best.candidate.name} at {best.candidate.at}")


def _is_simpler(candidate: Candidate, other: Candidate) -> bool:
    return candidate.family == other.family and len(candidate.parameters) < len(other.parameters)


def _as_good(trial: Trial, own: tuple[float, float, float, float], method: Method = STANDARD) -> bool:
    """Return whether a trial gains what ``own`` does, on both recordings: the gains in the band of the motion and on all frequencies."""
    gains = (trial.gain, trial.validation_gain, trial.full_band_gain, trial.full_band_validation_gain)
    return all(
        gain > other - max(method.selection.tie, method.selection.one_for_two_share * abs(other))
        for gain, other in zip(gains, own, strict=True)
    )


def _held_against(model: Model, before: Model) -> tuple[float, float, float, float]:
    """Return the gains of a model on the fitted and the validation recording, as a trial counts them, and both on all frequencies."""
    full_band = is_full_band(model.candidates)
    pairs = ((model.score, before.score), (model.validation, before.validation))
    first, second = (ours.above(theirs, full_band=full_band) for ours, theirs in pairs)
    third, fourth = (ours.above(theirs, full_band=True) for ours, theirs in pairs)
    return first, second, third, fourth
