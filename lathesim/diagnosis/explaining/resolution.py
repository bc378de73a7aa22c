"""When one explanation is better than another one, and when the recordings cannot tell them apart."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from lathesim.diagnosis.explaining.chance import due, is_clear, is_clear_as_one_block, unresolved
from lathesim.diagnosis.explaining.study import Study
from lathesim.diagnosis.explaining.trial import over
from lathesim.diagnosis.explanations.lacking_force import lacking
from lathesim.diagnosis.location import missing_share
from lathesim.diagnosis.records.found import Tried
from lathesim.identification.estimation.estimates import estimates, interval_includes_neutral
from lathesim.identification.records import Candidate, Model
from lathesim.identification.signal import root_mean_square


def significant(trial: Tried, study: Study) -> bool:
    """Return whether a trial predicts better than the model before it, by more than chance and its parameters give, and by more than errors
    of laws and sensors make.

    What may be another one on each recording was fitted to the validation recording too: it has to explain nearly all.
    """
    method = study.method
    if not is_clear(trial.predicted, method, trial.parameters) or trial.fitted.nats < due(method, trial.parameters):
        return False
    of_recording = trial.candidate.effect.identification.size_of_recording
    least = method.larger_part if of_recording else study.least_share
    return min(trial.predicted.share, trial.fitted.share) > least and moves(study, trial.before, trial.model)


def as_good(model: Model, best: Tried, study: Study) -> bool:
    """Return whether a model predicts as well as the best trial, as far as the recordings can tell.

    One of fewer values does too where the best one does nothing else by more than the errors of laws: what these make is no reason for a
    further value.
    """
    _, behind = over(best.model, model)
    if behind.nats < unresolved(behind, best.predicted.nats, study.method):
        return True
    return len(model.free) < len(best.model.free) and not moves(study, model, best.model)


def best_of(study: Study, trials: Sequence[Tried]) -> Tried | None:
    """Return the trial that predicts best, each held against the best before it; none where there are none.

    Some effects are judged at all frequencies and gain more over the lesson than those judged at the frequencies of the motion. Two of them
    compare on the same frequencies alone.
    """
    best = next(iter(trials), None)
    for one in trials[1:]:
        if best is not None and over(one.model, best.model)[1].nats > 0.0:
            best = one
    return best


def simplest(best: Tried, trials: Sequence[Tried], study: Study) -> Tried:
    """Return the trial with the fewest values of those that predict as well as the best one; of equals the first of the catalogue."""
    near = [one for one in trials if one is best or as_good(one.model, best, study)]
    return min(near, key=lambda one: (one.parameters, one.candidate.effect.catalogue or math.inf, -one.predicted.nats))


def moves(study: Study, before: Model, after: Model) -> bool:
    """Return whether a model does something else than another one by more than the declared errors of laws and the noise of sensors.

    The forces that both lack on the validation recording differ only by what they simulate: there is no noise in the difference. Beside a
    recording from before a change neither counts: errors of laws and of sensors were there before it too.
    """
    if study.earlier is not None:
        return True
    validation = study.validation
    for row in changed_readings(study, before, after):
        first, second = lacking(validation, before.validation_fit, row), lacking(validation, after.validation_fit, row)
        if not first.is_force or root_mean_square(first.values - second.values) > least_size(study, after, row):
            return True
    return False


def changed_readings(study: Study, before: Model, after: Model) -> list[int]:
    """Return the rows of the channels of the validation recording that two models simulate otherwise by no less than their noise."""
    sensed = study.validation.sensed
    # where the error of the simulation judges, errors of laws change a reading too
    by_laws = study.method.within_laws * sensed.seen_spread if study.validation.machine.output_error else 0.0
    least = np.maximum(sensed.seen_floors, by_laws)
    moved = zip(before.validation_fit.residual, after.validation_fit.residual, strict=True)
    return [row for row, (one, other) in enumerate(moved) if root_mean_square(one - other) >= least[row]]


def least_size(study: Study, model: Model, row: int) -> float:
    """Return the smallest force behind a channel that errors of laws do not make, one root mean square."""
    _, total = missing_share(study.validation, model.validation_fit, row)
    return study.method.within_laws * root_mean_square(total)


def small_and_unsure(study: Study, model: Model, trials: Iterable[Tried]) -> Tried | None:
    """Return the trial that gains least of those that explain the smaller part of what is left without them, and whose size in a model may
    be zero by both recordings together; none where there is none.

    A gain that is clear even if all blocks of a recording were one is no matter of doubt: what else is missing makes an interval wide.
    """
    larger = study.method.larger_part
    small = [one for one in trials if min(one.fitted.share, one.predicted.share) < larger and _has_one_size(one.candidate)]
    small = [one for one in small if not all(is_clear_as_one_block(gained, study.method) for gained in (one.fitted, one.predicted))]
    if not small:
        return None
    values = estimates(model, study.estimation, study.validation, None)
    unsure = [one for one in small if interval_includes_neutral(one.candidate, values)]
    return min(unsure, key=lambda one: one.predicted.nats, default=None)


def _has_one_size(candidate: Candidate) -> bool:
    """Return whether the interval of a size says that the effect may be nothing: a product, or a shape, may be sure while no factor is."""
    how = candidate.effect.identification
    return not how.products and not candidate.named(how.extended)
