"""Refinement of a model: a finer form takes the place of a simple effect, as a friction that is also asymmetric does of a plain one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lathesim.diagnosis.candidates.screening import least_shown, screened_instead
from lathesim.diagnosis.method import Method
from lathesim.diagnosis.records.screened import Screened
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection.acceptance import believable, merit, of_usual_size, replaces
from lathesim.diagnosis.selection.compare_models import Gains, compare_models, due
from lathesim.diagnosis.selection.laboratory import Laboratory, is_implausible
from lathesim.diagnosis.selection.moves.split import form_starts
from lathesim.diagnosis.selection.refusing.refusal import is_trifling, pushes_at, quiet_parts
from lathesim.diagnosis.selection.trials import Asked, side_by_side
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.records.model import Model, Trial
from lathesim.identification.replay.experiment import Experiment


def generalise(laboratory: Laboratory, found: SearchResult, method: Method, least: float = 0.0) -> SearchResult:
    """Return the search with refined forms in the place of effects where they remove much of what is left, or ``least`` of it."""
    quiet = quiet_parts(laboratory, found.model, method=method)
    for candidate in found.model.candidates:
        asked, unseen = _finer_forms(laboratory, found, candidate, method, quiet=pushes_at(candidate, quiet))
        if asked:
            laboratory.progress(f"asking whether {candidate.name} at {candidate.at} has a finer form")
        swaps = side_by_side(laboratory, found.model, asked)
        found = found.having_tried(swaps).with_unseen(candidate, unseen)
        good = _better_forms(laboratory, found, candidate, swaps, least, method)
        if not good:
            # the first micrometres of a friction are sensed through the noise of an encoder: promising, and yet not to be fitted
            found = found.with_unseen(candidate, [trial.candidate for trial in swaps if not _gains(trial, method)])
        else:
            best = max(good, key=lambda trial: merit(trial, method))
            laboratory.progress(f"{best.candidate.name} takes the place of {candidate.name}: {best.gain:.0f} nats")
            part, settled = best.candidate.part, laboratory.settled(best.model)
            found = replace(found, trials={**found.trials, part: good}).taking_over(best.candidate, candidate)
            before = {**found.before, part: found.model}
            found = found.accepted(settled, "generalise", "a more general effect explains more", before=before)
    return found


def _gains(trial: Trial, method: Method) -> bool:
    """Return whether a trial gains what an effect must on the estimation recording."""
    return compare_models(Gains(trial.gain), method, effects=1).better


def _finer_forms(
    laboratory: Laboratory, found: SearchResult, candidate: Candidate, method: Method, *, quiet: bool
) -> tuple[list[Asked], list[Candidate]]:
    """Return the refined forms of an effect that are worth a fit in its place, where it pushes at a ``quiet`` part none, and those that
    would show too little to be told from it."""
    experiment, model = laboratory.experiment, found.model
    rest = tuple(other for other in model.candidates if other is not candidate)
    kept = [item for item in model.free if item.name not in candidate.parameters]
    # a form of a friction that feels the simulated motion feels it too
    with_simulated_motion = any(model.fitted.constant.get(name) == 0.0 for name in experiment.simulated_motion_of([candidate]))
    asked, unseen = list[Asked](), list[Candidate]()
    for other in _refined_forms(experiment, found, candidate):
        starts = form_starts(candidate, other, model)
        motion = experiment.simulated_motion_of([other]) if with_simulated_motion else {}
        screening_score = screened_instead(experiment.sensed, model.fitted, candidate, other, starts[1:], motion)
        shown = Gains(least_shown(experiment.sensed, model.fitted, candidate, other))
        if not compare_models(shown, method, effects=1, parameters=len(other.parameters)).better:
            unseen.append(other)
        # where a friction holds by its own motion a screening score says little of how much
        promising = screening_score.gain > 0.5 * due(method) and (
            with_simulated_motion or may_be_worth(laboratory, model, screening_score, method)
        )
        if promising and not quiet:
            asked.append(Asked(other, rest, kept, starts, with_simulated_motion=with_simulated_motion))
            if other.bare:
                plain = form_starts(candidate, other.bare, model)
                asked += [Asked(other.bare, rest, kept, plain, with_simulated_motion=simulated) for simulated in (False, True)]
    return asked, unseen


def _refined_forms(experiment: Experiment, found: SearchResult, candidate: Candidate) -> list[Candidate]:
    """Return the candidates at the place of one that are more general than it and were not refused."""
    return [
        other
        for other in experiment.candidates
        if other.at == candidate.at and candidate.name in other.effect.identification.generalises and other.part not in found.excluded
    ]


def _better_forms(
    laboratory: Laboratory, found: SearchResult, candidate: Candidate, swaps: Sequence[Trial], least: float, method: Method
) -> list[Trial]:
    """Return the trials whose form may take the place of a candidate: they remove ``least`` of the rest, or restore plausible values."""
    good = [trial for trial in swaps if believable(trial, method, 0.0)]
    good = [trial for trial in good if replaces(trial, candidate, method) and trial.share_of_rest >= least]
    good = good or [trial for trial in swaps if _restores_plausibility(trial, method)]
    return [trial for trial in good if not is_trifling(laboratory, found.model, trial.model, trial, method=method)]


def _restores_plausibility(trial: Trial, method: Method) -> bool:
    """Return whether with a trial no value of the lesson is implausible any more and the lesson's own simulation is much better: a
    friction that senses recorded motion explains a spring of some micrometres with a viscosity that the machine cannot have."""
    usual = of_usual_size(trial.candidate, trial.model.fitted.by_name, method)
    return trial.restores_plausibility and usual and 0.0 < trial.closed_loop_degradation < method.shared.larger_part


def may_be_worth(laboratory: Laboratory, model: Model, item: Screened, method: Method) -> bool:
    """Return whether what a candidate scores may come to the shares of the error that an effect must remove."""
    if is_implausible(model.fitted, method=method) or (
        item.candidate.effect.identification.periodic and item.gain > method.selection.wave_surely_there * due(method)
    ):
        # what repeats hundreds of times scores little as long as its length is a little off
        return True
    # beside effects that were found already the noise is known well, and what is expected is hardly ever surpassed
    share = 1.0 if model.candidates else method.worth_a_fit
    if item.share < share * method.share_of_rest:
        return False
    if item.share > method.shared.larger_part * method.nearly_all_of_rest:
        return True
    rest = model.error + np.maximum(laboratory.everything - laboratory.baseline_error, 0.0)
    return float(np.max(item.shares * rest / laboratory.everything)) > share * method.share_of_all
