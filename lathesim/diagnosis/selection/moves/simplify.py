"""A simpler relative in the place of an effect, once everything is in: beside an error that was not explained yet the one with more values
gained more, and took its name from what the others have explained since."""

from __future__ import annotations

from dataclasses import astuple, replace

from lathesim.diagnosis.candidates.screening import screen
from lathesim.diagnosis.candidates.starting_points import starting_points
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection.compare_models import Gains, compare_models, gains_over
from lathesim.diagnosis.selection.elimination import fewer
from lathesim.diagnosis.selection.laboratory import Laboratory
from lathesim.diagnosis.selection.trials import Asked, side_by_side
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.records.model import Model, Trial, is_full_band


def simplify(laboratory: Laboratory, found: SearchResult, method: Method = STANDARD) -> SearchResult:
    """Return the search with simpler relatives in the place of effects of a model of several, where both recordings are explained as well.

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
            if item.share > method.shared.larger_part
        ]
        asked = [Asked(item.candidate, rest, before.free, item.starts[:1]) for item in promising[: method.selection.most_rivals]]
        trials = side_by_side(laboratory, before, asked)
        good = [trial for trial in trials if _as_good(trial, own, method=method)]
        if good:
            best = max(good, key=lambda trial: (-len(trial.candidate.parameters), trial.gain))
            in_band, full = own
            assert in_band.validation is not None and full.validation is not None
            was = replace(
                best, candidate=candidate, model=found.model, gain=in_band.estimation, validation_gain=in_band.validation,
                full_band_gain=full.estimation, full_band_validation_gain=full.validation,
                restores_plausibility=False, implausible=False, becomes_implausible=False, closed_loop_degradation=0.0,
            )  # fmt: skip
            trials_now = {**found.trials, best.candidate.part: [best, was]}
            found = found.accepted(laboratory.settled(best.model), "simplify", "a simpler effect explains as much", trials=trials_now)
            laboratory.progress(f"as good and simpler: {best.candidate.name} at {best.candidate.at}")
    return found


def _is_simpler(candidate: Candidate, other: Candidate) -> bool:
    return candidate.family == other.family and len(candidate.parameters) < len(other.parameters)


def _as_good(trial: Trial, own: tuple[Gains, Gains], method: Method = STANDARD) -> bool:
    """Return whether a trial gains what ``own`` does, on both recordings: the gains in the band of the motion and on all frequencies."""
    trials = (Gains(trial.gain, trial.validation_gain), Gains(trial.full_band_gain, trial.full_band_validation_gain))
    return all(
        compare_models(Gains(gain - other), method, explained=other).as_good
        for gains, others in zip(trials, own, strict=True)
        for gain, other in zip(astuple(gains), astuple(others), strict=True)
    )


def _held_against(model: Model, before: Model) -> tuple[Gains, Gains]:
    """Return the gains of a model as a trial counts them, and those on all frequencies."""
    return gains_over(model, before, full_band=is_full_band(model.candidates)), gains_over(model, before, full_band=True)
