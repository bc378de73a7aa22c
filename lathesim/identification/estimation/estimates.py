"""The values a diagnosis reports: fitted to all that was recorded, with intervals that two recordings have been asked about.

How far a replay draws the values that are fitted to it: the found machine is simulated, and what it would have recorded is fitted again.

A replay feeds each part with what was recorded, noise and rounding included: a friction turns round where a noisy speed does, and a lag
that is fitted beside it answers to that. With b the value fitted to what a machine of value v would have recorded, |b - v| is a systematic
error of every value so fitted. It is told and not taken off: the found machine is not the real one. Source: Efron, Tibshirani, An
Introduction to the Bootstrap, 1993, chapter 10 (parametric bootstrap of a bias). Left out: the loads that nobody measured.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from lathesim.engine.assembly import FloatArray, Place
from lathesim.identification.estimation.covariance import LARGEST_INFLATION, SIGNIFICANT, covariance_of
from lathesim.identification.estimation.least_squares import SETTLED, Manner, fit
from lathesim.identification.estimation.transfer import begun_anew
from lathesim.identification.records import FAR_BEYOND, Candidate, Fitted, Model, is_full_band, with_start
from lathesim.identification.replay.experiment import Experiment, own_error
from lathesim.identification.roles import decides
from lathesim.identification.signal import LARGER_PART, root_mean_square
from lathesim.record import Record


def replay_bias(experiment: Experiment, fitted: Fitted, *, full_band: bool) -> Mapping[str, float]:
    """Return by name how far off [SI] the second fit is, nothing where noise alone may have made that; a machine of which nothing is fed
    back is no other in the replay than in its own simulation, and has no bias. One whose own simulation grows beyond all bounds has none
    that could be worked out."""
    if not experiment.feeds_back:
        return {}
    simulated = _as_recorded(experiment, fitted)
    if any(np.isfinite(experiment.record[name]).all() and not np.isfinite(simulated[name]).all() for name in experiment.machine.compare):
        return {}
    again = replace(experiment, record=simulated)
    second = fit(again.sensed, with_start(fitted), fitted.constant, rounds=2, full_band=full_band, coloured=True)
    found = {}
    for name in fitted.names:
        off = abs(second.by_name[name] - fitted.by_name[name])
        found[name] = off if off > SIGNIFICANT * second.error_by_noise(name) else 0.0
    return found


def start_bias(experiment: Experiment, model: Model, fitted: Fitted) -> Mapping[str, float]:
    """Return by name how far off [SI] fits end that begin half a scale above and below, with the sizes of effects and the values of the
    lesson, where they explain about as much; nothing where noise may have made that. Two draws of one spread are sqrt(2) of it apart.

    A friction that holds or slides makes a cost of many small valleys. Each is steep, and tells nothing of how far apart they are.
    """
    moved = {name for one in model.candidates for name in one.parameters if Place.of(name).port in one.effect.neutral}
    moved |= {item.name for item in fitted.free if item.is_declared}
    off = []
    for shift in (LARGER_PART, -LARGER_PART):
        free = [replace(item, start=item.start + shift * item.scale * (item.name in moved)) for item in with_start(fitted)]
        full_band = is_full_band(model.candidates)
        how: Manner = {"rounds": 2, "full_band": full_band, "coloured": True, "slopes": "corrected", "settle": SETTLED}
        other = fit(experiment.sensed, free, fitted.constant, **how)
        ratios = [
            root_mean_square(one) / max(root_mean_square(own), 1e-300) for one, own in zip(other.residual, fitted.residual, strict=True)
        ]
        if np.prod(ratios) < _ERROR_RATIO ** len(ratios):
            off.append(other.values - fitted.values)
    apart = np.sqrt(0.5 * np.mean(np.square(off), axis=0)) if off else np.zeros(len(fitted.names))
    found = dict(zip(fitted.names, apart.tolist(), strict=True))
    return {name: found[name] for name in moved & found.keys() if found[name] > SIGNIFICANT * fitted.error_by_noise(name)}


def _bias(experiment: Experiment, model: Model, fitted: Fitted) -> Mapping[str, float]:
    """Return by name how far off values are [SI] by a replay and by where a fit began, which have nothing to do with each other."""
    by_replay, by_start = replay_bias(experiment, fitted, full_band=is_full_band(model.candidates)), start_bias(experiment, model, fitted)
    return {name: float(np.hypot(by_replay.get(name, 0.0), by_start.get(name, 0.0))) for name in {**by_replay, **by_start}}


def _as_recorded(experiment: Experiment, fitted: Fitted) -> Record:
    """Return what the machine with the fitted values would have recorded, with noise of the size of the floors.

    A command is a number that acts as it was recorded: what stands for its noise has passed through the machine.
    """
    names = experiment.own.settable(fitted.by_name)
    simulated = experiment.own.outputs(names, np.array([[fitted.by_name[name] for name in names]]))[0]
    random = np.random.Generator(np.random.Philox(0))
    channels = dict(experiment.record.channels)
    for row, name in enumerate(experiment.machine.compare):
        reading = not decides(experiment.machine.assembly.by_name[Place.of(name).part].component)
        values = simulated[row] + reading * experiment.floors[name] * random.standard_normal(len(simulated[row]))
        channels[name] = replace(channels[name], values=np.where(np.isfinite(experiment.record[name]), values, np.nan))
    return Record(experiment.record.time, channels, dict(experiment.record.meta))


CONFIDENCE = 1.96 * 1.15
"""Standard errors in half a 95 % interval. On concealed cases of another program the standard errors were 1.15 times too small (of 105
values 1.96 of them held 93, 1.15 times as much 101): laws, steps and samples are a little other than those of any machine. Source of such a
correction: Kuleshov, Fenner, Ermon, Accurate Uncertainties for Deep Learning Using Calibrated Regression, ICML 2018 (recalibration)."""
_ERROR_RATIO = 1.2
"""Times the error of a simulation within which another one is as good."""


@dataclass(frozen=True)
class Estimate:
    """A value and one standard error [SI]."""

    value: float
    error: float


@dataclass(frozen=True)
class Estimates:
    """Values by name; ``inflation`` is by how much more than their errors allow the two recordings disagree. ``products`` are those of two
    values, by the names of both, of effects of which recordings determine the product alone."""

    by_name: Mapping[str, Estimate]
    inflation: float
    products: Mapping[tuple[str, str], Estimate] = field(default_factory=dict)

    def values(self) -> dict[str, float]:
        """Return the values alone."""
        return {name: item.value for name, item in self.by_name.items()}


def estimates(model: Model, experiment: Experiment, validation: Experiment, whole: Experiment | None) -> Estimates:
    """Return the machine's values, where frictions sense the simulated motion with the recorded one instead if that explains as much.

    A replay in which a friction holds by its own motion jumps where a value moves a little: its slopes tell more than is there, and what
    the recorded motion tells of the errors holds for it too. Whether the values are as good the lesson's own simulation says.
    """
    found = _estimates(model, experiment, validation, whole)
    motion = experiment.simulated_motion_of(model.candidates)
    given = {name: value for name, value in model.fitted.constant.items() if name not in motion}
    if given == model.fitted.constant:
        return found
    other = _estimates(replace(model, fitted=replace(model.fitted, constant=given)), experiment, validation, whole)
    left, left_with_other = (own_error(validation, {**model.validation_fit.by_name, **one.values()}) for one in (found, other))
    return other if experiment.feeds_back and left_with_other < _ERROR_RATIO * left else _no_surer(found, other)


def as_simulated(found: Estimates, model: Model, experiment: Experiment, validation: Experiment) -> Estimates:
    """Return estimates, with the values that the search had on one recording where these simulate none worse, and both clearly better.

    A mean weighs fits by the errors of equations: these tell little of small errors that add up, and a wrong form makes one recording seem
    surer than it is. The interval holds all that it held. Recordings that were fitted together weigh the error of the simulation already.
    """
    on = ((experiment, model.fitted.by_name), (validation, model.validation_fit.by_name))
    shared = {name for name in found.by_name if all(name not in candidate.nuisance for candidate in model.candidates)}
    ways = [{name: values[name] for name in shared} for values in (found.values(), *(values for _, values in on))]
    left = np.array([[own_error(one, {**values, **way}) for one, values in on] for way in ways])
    best = int(np.argmin(left.sum(axis=1)))
    if experiment is validation or np.any(left[best] > left[0]) or left[0].sum() <= _ERROR_RATIO * left[best].sum():
        return found
    values = {**found.values(), **ways[best]}
    by_name = {name: Estimate(values[name], one.error + abs(values[name] - one.value) / CONFIDENCE) for name, one in found.by_name.items()}
    return replace(found, by_name=by_name)


def _no_surer(found: Estimates, other: Estimates) -> Estimates:
    """Return the values of one fit with the larger of its errors and those of another one."""
    by_name = {name: replace(item, error=max(item.error, other.by_name[name].error)) for name, item in found.by_name.items()}
    return replace(found, by_name=by_name)


def _estimates(model: Model, experiment: Experiment, validation: Experiment, whole: Experiment | None) -> Estimates:
    """Return the machine's values: fitted to the whole recording where both parts are of one file, else the weighted mean of both.

    The parts are fitted by themselves first, with noise that may be slow: what is missing is in the model by now, and a load that nobody
    measured draws the values with it where it passes for white. Where they disagree by more than their standard errors, all errors are
    made larger by the root mean square of that disagreement: an error that the noise model knows nothing of (the model's form, a drifting
    machine).
    """
    full_band = is_full_band(model.candidates)
    first = fit(
        experiment.sensed, with_start(model.fitted), model.fitted.constant, rounds=2, full_band=full_band, coloured=True, slopes="central"
    )
    second = _same_way_round(_refitted(model, validation, validation, full_band), first, model.candidates)
    of_recording = {item.name for item in begun_anew(validation, model.candidates)}
    of_recording |= {name for candidate in model.candidates for name in candidate.nuisance}
    names = [name for name in first.names if name not in of_recording]
    inflation = _inflation(first, second, names, model.candidates)
    fits = (first, second) if whole is None else (_refitted(model, whole, validation, full_band),)
    recordings = zip((experiment, validation) if whole is None else (whole,), fits, strict=True)
    biases = [_bias(one, model, fitted) if model.candidates else {} for one, fitted in recordings]
    both = (joint_covariance(fits, names, 1.0), joint_covariance(fits, names, inflation))
    alone, disagreeing = (dict(zip(names, np.sqrt(np.diag(covariance)).tolist(), strict=True)) for covariance in both)
    found = {name: _estimate(fits, name, alone[name], disagreeing[name], [bias.get(name, 0.0) for bias in biases]) for name in names}
    return Estimates({**found, **_sizes_of_one_recording(model, fits[0])}, inflation, _products(fits, model.candidates, inflation))


def _products(fits: Sequence[Fitted], candidates: Sequence[Candidate], inflation: float) -> dict[tuple[str, str], Estimate]:
    """Return the weighted means of products a b over fits, each with the variance g C g, g = (b, a): along a b = constant it is none."""
    pairs = [pair for one in candidates for pair in products_of(one) if set(pair) <= set(fits[0].names)]
    found = {}
    for pair in pairs:
        values, variances = [], []
        for fitted in fits:
            places = [fitted.names.index(name) for name in pair]
            slope = fitted.values[places[::-1]]
            values.append(float(np.prod(slope)))
            variances.append(max(float(slope @ fitted.covariance[np.ix_(places, places)] @ slope), 1e-300))
        weights = 1.0 / np.array(variances)
        error = inflation / float(np.sqrt(weights.sum()))
        found[pair] = Estimate(float(weights @ values / weights.sum()), error)
    return found


def products_of(candidate: Candidate) -> list[tuple[str, str]]:
    """Return the names of two parameters each of which recordings determine the product alone."""
    products = candidate.effect.identification.products
    return [(f"{candidate.part}.{size}", f"{candidate.part}.{other}") for size, others in products.items() for other in others]


def _sizes_of_one_recording(model: Model, fitted: Fitted) -> dict[str, Estimate]:
    """Return the estimates of sizes that belong to one recording, as they were on that."""
    own = [f"{candidate.part}.{name}" for candidate in model.candidates for name in candidate.effect.identification.size_of_recording]
    return {name: Estimate(fitted.by_name[name], fitted.error(name)) for name in own if name in fitted.names}


def _inflation(first: Fitted, second: Fitted, names: Sequence[str], candidates: Sequence[Candidate]) -> float:
    """Return the factor by which two fits disagree by more than their standard errors, root mean square over the values; at least 1."""
    orders = {name for candidate in candidates for name in candidate.named(candidate.effect.identification.orders)}
    pull = [
        ((first.by_name[name] - second.by_name[name]) ** 2 / (first.error_by_noise(name) ** 2 + second.error_by_noise(name) ** 2))
        for name in names
        if first.error_by_noise(name) > 0.0 and second.error_by_noise(name) > 0.0 and name not in orders
    ]
    return float(np.clip(np.sqrt(np.mean(pull)) if pull else 1.0, 1.0, LARGEST_INFLATION))


def _estimate(fits: Sequence[Fitted], name: str, alone: float, disagreeing: float, biases: Sequence[float]) -> Estimate:
    """Return the weighted mean of fits to separate recordings: noise differs between them, what is wrong with the form of the model or
    comes of replaying it does not. ``disagreeing`` is the standard error of all by noise and how they disagree, ``alone`` by noise only."""
    values = np.array([fitted.by_name[name] for fitted in fits])
    weights = 1.0 / np.array([max(fitted.error(name), 1e-300) for fitted in fits]) ** 2
    by_form = np.array([fitted.error_by_noise(name) * np.sqrt(fitted.misfit_of(name) ** 2 - 1.0) for fitted in fits])
    by_form = np.hypot(by_form, biases)
    error = max(disagreeing, float(np.hypot(alone, weights @ by_form / weights.sum())))
    return Estimate(float(weights @ values / weights.sum()), error)


def joint_covariance(fits: Sequence[Fitted], names: Sequence[str], inflation: float) -> FloatArray:
    """Return the covariance of all fits together by noise, (names, names), ``inflation``^2 larger as far as it comes from the recordings.

    covariance = (P + sum_i (C_i^-1 - P) / inflation^2)^-1

    C_i is the covariance of the values in fit i, P what was known beforehand: known once, and of all values together. Where recordings tell
    only a ratio of two values, what is known of the one is all there is to know of the other, however many recordings there are.
    """
    places = [[fitted.names.index(name) for name in names] for fitted in fits]
    known = np.diag([fits[0].known_beforehand(place) for place in places[0]])
    total = known.copy()
    for fitted, of_fit in zip(fits, places, strict=True):
        total += _learned(fitted.covariance[np.ix_(of_fit, of_fit)], known) / inflation**2
    return covariance_of(total)


def _learned(covariance: FloatArray, known: FloatArray) -> FloatArray:
    """Return the information of a covariance that was not ``known`` beforehand; of a value without any variance, which nothing shows, none.

    Rounding leaves negative directions in the difference; they are taken out.
    """
    shown = np.flatnonzero(np.diag(covariance) > 0.0)
    there = np.ix_(shown, shown)
    size = np.sqrt(np.diag(covariance)[shown])
    scaled = np.linalg.pinv(covariance[there] / np.outer(size, size), rcond=1e-12, hermitian=True) - known[there] * np.outer(size, size)
    values, vectors = np.linalg.eigh(scaled)
    information = np.zeros_like(covariance)
    information[there] = (vectors * np.maximum(values, 0.0)) @ vectors.T / np.outer(size, size)
    return information


def _refitted(model: Model, experiment: Experiment, validation: Experiment, full_band: bool) -> Fitted:
    """Fit everything that is free in the model to another recording."""
    judges = experiment.record is validation.record
    starts = begun_anew(experiment, model.candidates if judges else ())
    # a phase belongs to its recording: on another one the search starts from where that one was found to have it
    own = {name for candidate in model.candidates for name in (*candidate.remembered, *candidate.nuisance)}
    there = {name: value for name, value in model.validation_fit.by_name.items() if judges and name in own}
    free = [*starts, *(item for item in with_start(model.fitted) if all(item.name != one.name for one in starts))]
    free = [replace(item, start=there.get(item.name, item.start)) for item in free]
    return fit(experiment.sensed, free, model.fitted.constant, rounds=2, full_band=full_band, coloured=True, slopes="central")


def _same_way_round(fitted: Fitted, other: Fitted, candidates: Sequence[Candidate]) -> Fitted:
    """Return a fit with its waves as another fit has them: one of negative size is the same wave half a turn on."""
    values = np.array(fitted.values)
    for candidate in candidates:
        for phase, sizes in candidate.waves.items():
            names = [name for name in sizes if phase in fitted.names and name in fitted.names]
            if sum(fitted.by_name[name] * other.by_name[name] for name in names) < 0.0:
                values[[fitted.names.index(name) for name in names]] *= -1.0
                values[fitted.names.index(phase)] += np.pi
    return replace(fitted, values=values)


def interval_includes_neutral(candidate: Candidate, values: Estimates) -> bool:
    """Return whether the intervals of all sizes of an effect hold the value with which it vanishes, whatever they are wide from: noise, a
    form that is a little wrong, recordings that disagree. Of a size that shows in products alone these decide."""
    products = [values.products[pair] for pair in products_of(candidate) if pair in values.products]
    return all(size < half for size, half in _sizes(candidate, values)) and not any(is_there(product) for product in products)


def is_there(product: Estimate) -> bool:
    """Return whether the interval of a product does not hold zero."""
    return abs(product.value) > CONFIDENCE * product.error


def _sizes(candidate: Candidate, values: Estimates) -> list[tuple[float, float]]:
    """Return how far each size of an effect is from where it vanishes, and half its interval."""
    sizes = [(name, neutral) for name, neutral in zip(candidate.parameters, candidate.neutral, strict=True) if name in values.by_name]
    sizes = [(name, neutral) for name, neutral in sizes if Place.of(name).port in candidate.effect.neutral]
    return [(_away(values.by_name[name].value, neutral), CONFIDENCE * values.by_name[name].error) for name, neutral in sizes]


def _away(value: float, neutral: float) -> float:
    """Return how far a value is from where its effect vanishes; of a limit that does so far beyond all that acts, how large it is: one that
    may be twice as large or none at all is not known."""
    return min(abs(value - neutral), abs(value)) if abs(neutral) > FAR_BEYOND * abs(value) else abs(value - neutral)
