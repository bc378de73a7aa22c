"""One explanation more: a candidate fitted jointly with everything that the model before it had free, and judged on both recordings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lathesim.diagnosis.explaining.chance import due
from lathesim.diagnosis.explaining.density import gain
from lathesim.diagnosis.explaining.starts import starts
from lathesim.diagnosis.explaining.study import Study
from lathesim.diagnosis.records.found import Gain, Screened, Tried
from lathesim.engine.assembly import FloatArray
from lathesim.identification.estimation.least_squares import ROUGH, SETTLED, Begun, Manner, fit, fit_each
from lathesim.identification.estimation.transfer import transferred
from lathesim.identification.records import Candidate, Fitted, Free, Model, is_full_band, with_start
from lathesim.identification.replay.experiment import Experiment, baseline_free

FIRST_STEPS = 6
"""Steps of a first fit."""


def modelled(study: Study, candidates: tuple[Candidate, ...], fitted: Fitted) -> Model:
    """Return a fit as a model, carried over to the validation recording."""
    return Model(candidates, fitted, transferred(study.validation, fitted, candidates))


def over(model: Model, other: Model) -> tuple[Gain, Gain]:
    """Return what a model gains over another one, on the estimation and on the validation recording."""
    wide = is_full_band((*model.candidates, *other.candidates))
    return (gain(model.fitted, other.fitted, full_band=wide), gain(model.validation_fit, other.validation_fit, full_band=wide))


def worth(candidate: Candidate, before: Model, model: Model) -> Tried:
    """Return what a model gains by a candidate over the one before it, on both recordings."""
    return Tried(candidate, before, model, *over(model, before))


def tried(study: Study, before: Model, item: Screened, points: FloatArray | None) -> Tried:
    """Return a candidate fitted on top of a model."""
    candidates = (*before.candidates, item.candidate)
    begun = [_begun(study, before, free) for free in starts(study, before, item, points)]
    motion = study.estimation.simulated_motion_of(candidates)
    if motion and not motion.items() <= before.fitted.constant.items():
        # a friction that holds has to feel the simulated motion: of the recorded one the first micrometres are lost in its rounding
        begun.append(Begun(begun[0].free, {**before.fitted.constant, **motion}))
    if item.candidate.otherwise:
        # nobody says on which side of a spring the only sensor sits, or whether a filter is computed
        constant = {**before.fitted.constant, **item.candidate.otherwise}
        otherwise = replace(before, fitted=replace(before.fitted, constant=constant))
        begun += [Begun(free, constant) for free in starts(study, otherwise, item, points)]
    best = max(_rough(study, before, begun, candidates), key=lambda one: one.score)
    gained = gain(best, before.fitted, full_band=is_full_band(candidates))
    if gained.nats < due(study.method):
        return Tried(item.candidate, before, Model(candidates, best, before.validation_fit), gained, Gain(0.0, 0.0))
    return worth(item.candidate, before, modelled(study, candidates, best))


def settled_trial(study: Study, before: Model, trial: Tried) -> Tried:
    """Return a trial fitted on from where it stands, all slopes taken afresh, until nothing moves any more."""
    candidates, rough = trial.model.candidates, trial.model.fitted
    how: Manner = {"rounds": 2, "full_band": is_full_band(candidates), "tolerance": 1e-5, "settle": SETTLED}
    fitted = fit(study.estimation.sensed, with_start(rough), rough.constant, **how)
    return worth(trial.candidate, before, modelled(study, candidates, fitted))


def _rough(study: Study, before: Model, begun: Sequence[Begun], candidates: tuple[Candidate, ...]) -> list[Fitted]:
    """Return first fits, weighed as the model before it is: where a start swings far, noise of its own would find that usual.

    The error of a simulation takes four times as many steps, which only the two that are ahead after a few are given.
    """

    def after(steps: int, begun: Sequence[Begun]) -> list[Fitted]:
        return fit_each(
            study.estimation.sensed, begun, rounds=1, iterations=2 * steps, noise=before.fitted.noise, full_band=is_full_band(candidates),
            tolerance=ROUGH, slopes="corrected",
        )  # fmt: skip

    found = after(FIRST_STEPS, begun)
    if not study.estimation.machine.output_error:
        return found
    ahead = sorted(found, key=lambda one: -one.score)[:2]
    return after(4 * FIRST_STEPS, [Begun(with_start(one), one.constant) for one in ahead])


def _begun(study: Study, before: Model, free: Sequence[Free]) -> Begun:
    """Return where a fit begins on top of a model, with its slopes where its values are those of the model.

    The error of a simulation has other slopes a little further on, so that none are known beforehand.
    """
    known = dict(zip(before.fitted.names, before.fitted.sensitivity, strict=True)) if before.fitted.sensitivity is not None else {}
    values = dict(zip(before.fitted.names, before.fitted.values.tolist(), strict=True))
    near = not study.estimation.machine.output_error and all(one.start == values.get(one.name, one.start) for one in free)
    return Begun(free, before.fitted.constant, known if near else {})


def without(study: Study, model: Model, gone: Candidate) -> Model:
    """Return a model without one of its effects, the rest fitted again."""
    rest = tuple(one for one in model.candidates if one is not gone)
    free = [one for one in model.free if one.name not in gone.parameters]
    constant = {name: value for name, value in model.fitted.constant.items() if name not in gone.parameters}
    return modelled(study, rest, fit(study.estimation.sensed, free, constant, rounds=2, full_band=is_full_band(rest), settle=SETTLED))


def neutral(model: Model, gone: Candidate) -> Model:
    """Return a model one of whose effects is nothing and no longer free, the other values as they are."""
    fitted = model.fitted
    places = [place for place, one in enumerate(fitted.free) if one.name not in gone.parameters]

    def kept(values: FloatArray | None) -> FloatArray | None:
        return None if values is None else values[places]

    smaller = replace(
        fitted,
        free=tuple(fitted.free[place] for place in places),
        values=fitted.values[places],
        covariance=fitted.covariance[places][:, places],
        sensitivity=kept(fitted.sensitivity),
        misfit=kept(fitted.misfit),
    )
    return replace(model, candidates=tuple(one for one in model.candidates if one is not gone), fitted=smaller)


def was_there_before(study: Study, trial: Tried) -> bool:
    """Return whether the larger part of what an effect gains is gained before the change too; never without an earlier recording.

    Such an effect is no part of the change: the errors of the lesson look alike in both. Gains add up over samples, so that of the earlier
    recording is taken for as many samples as were fitted.
    Source: Campbell, Stanley, Experimental and Quasi-Experimental Designs for Research, 1963 (a control beside a treatment).
    """
    experiment = study.earlier
    if experiment is None:
        return False
    candidates = trial.model.candidates
    names = {name for candidate in candidates for name in candidate.parameters}
    own = [*baseline_free(experiment.machine), *experiment.start_states(experiment.sensed.plan)]
    effects = [one for one in with_start(trial.model.fitted) if one.name in names]
    with_effect = fit(experiment.sensed, [*own, *effects], rounds=2, full_band=is_full_band(candidates))
    gone = set(trial.candidate.parameters)
    rest = [one for one in with_start(with_effect) if one.name not in gone]
    left = fit(experiment.sensed, rest, rounds=2, full_band=is_full_band(candidates))
    before = gain(with_effect, left, full_band=is_full_band(candidates)).nats * _samples(study.estimation) / _samples(experiment)
    return before > study.method.larger_part * trial.fitted.nats


def _samples(experiment: Experiment) -> float:
    """Return how many samples of an experiment are fitted."""
    return float(len(experiment.record) if experiment.weights is None else np.sum(experiment.weights))
