"""One candidate on top of a model: everything refitted, and how much better both recordings are explained."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from lathesim.diagnosis.candidates.screening import is_limit
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.engine.assembly import FloatArray
from lathesim.identification.estimation.fractional_delay import between_samples
from lathesim.identification.estimation.least_squares import ROUGH, fit, log_likelihood, noise_of
from lathesim.identification.estimation.transfer import transferred
from lathesim.identification.execution.budget import Progress
from lathesim.identification.noise.noise_model import NoiseModel, carried_over, whitened_power
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.records.fit import Fitted, Free, with_start
from lathesim.identification.records.model import Model, Score, Trial, is_full_band
from lathesim.identification.replay.closed_loop import agreed_in_closed_loop, in_own_simulation
from lathesim.identification.replay.experiment import POSSIBLE, Experiment

IMPLAUSIBLE = 0.98 * POSSIBLE
"""Declared standard deviations above which a value of the lesson is implausible: it would go further if it might."""


@dataclass(frozen=True)
class _Fit:
    """A fit of a candidate on the estimation recording, with its gain there [nats]."""

    fitted: Fitted
    gain: float
    restores_plausibility: bool
    with_simulated_motion: bool


@dataclass
class Earlier:
    """A recording from before a change, the lesson as it stands fitted to it, and what effects gain there, by their parts, for as many
    samples as are fitted [nats]."""

    laboratory: Laboratory
    baseline: Model
    gains: dict[str, float] = field(default_factory=dict)


@dataclass
class Laboratory:
    """What every trial needs: the two recordings, and how the baseline's residual is weighed."""

    experiment: Experiment
    validation: Experiment
    progress: Progress
    weights: tuple[NoiseModel, ...] = ()
    baseline_error: FloatArray = field(default_factory=lambda: np.zeros(0))
    everything: FloatArray = field(default_factory=lambda: np.zeros(0))
    """The squared error of the baseline in each channel, floor included."""
    method: Method = STANDARD
    least_gain: float = 0.0
    """Gain in likelihood [nats] that a trial must reach for the validation recording to be asked about it."""
    earlier: Earlier | None = None
    """The recording from before a change, where there is one."""

    @property
    def runs(self) -> int:
        """How many runs were held against the two recordings until now."""
        return self.experiment.sensed.runs.total + self.validation.sensed.runs.total

    def model(self, candidates: tuple[Candidate, ...], fitted: Fitted) -> Model:
        """Return the model of a fit, judged on both recordings."""
        judged = transferred(self.validation, fitted, candidates)
        return Model(
            candidates,
            fitted,
            judged_score(self.experiment, fitted),
            judged,
            judged_score(self.validation, judged),
            self.error(self.experiment, fitted),
        )

    def weigh(self, baseline: Fitted) -> None:
        """Take the baseline as what every error is weighed and held against."""
        self.weights = baseline.noise
        self.baseline_error, floor = self._error(self.experiment, baseline)
        self.everything = self.baseline_error + floor

    def error(self, experiment: Experiment, fitted: Fitted, white: FloatArray | None = None) -> FloatArray:
        """Return for each channel the squared error of a fit above the floor: in the band of the motion, and then on all frequencies.

        It is weighed as forces and sensor noise of the baseline's size are: an error of force counts alike in every model. ``white``
        (channels,) is the power of what the sensors add to their floors, which is no error.
        """
        return self._error(experiment, fitted, white)[0]

    def _error(self, experiment: Experiment, fitted: Fitted, white: FloatArray | None = None) -> tuple[FloatArray, FloatArray]:
        shapes = experiment.sensed.noise_shapes(fitted.by_name)
        errors, floors = [], []
        added = np.zeros(len(shapes)) if white is None else white
        for row, shape, base, more in zip(fitted.residual, shapes, self.weights or fitted.noise, added, strict=True):
            weight = carried_over(base, shape)
            for full_band in (False, True):
                white = weight.whiten(row, full_band=full_band)
                kept = slice(0, len(weight.power) if full_band else min(weight.band, len(weight.power)))
                floor = float(np.sum(2.0 * (shape.floor**2 + more) * shape.shapes[0][kept] / weight.power[kept]))
                errors.append(max(float(np.sum(white * white)) - floor, 1e-9))
                floors.append(floor)
        return np.array(errors), np.array(floors)

    def most_removed(self, experiment: Experiment, before: Fitted, after: Fitted) -> float:
        """Return the share of the error of one fit, floor included, that another one explains in the channel where it takes most."""
        error, floor = self._error(experiment, before)
        return float(np.max((error - self.error(experiment, after))[::2] / (error + floor)[::2]))

    @property
    def _settled(self) -> float:
        return self.method.selection.settled

    def settled(self, model: Model) -> Model:
        """Return a model fitted from where it stands until nothing moves any more, with all slopes taken afresh."""
        full_band, constant = is_full_band(model.candidates), model.fitted.constant
        settled = fit(self.experiment.sensed, model.free, constant, rounds=2, full_band=full_band, settle=self._settled)
        if moved := between_samples(self.experiment, settled, model.candidates, full_band=full_band):
            settled = fit(self.experiment.sensed, moved, constant, rounds=2, full_band=full_band, settle=self._settled)
        settled = self.with_better_motion(settled, model.candidates)
        if is_implausible(settled, method=self.method):
            # a slow load that nobody measured draws values with it where noise is held to be white
            slow = fit(
                self.experiment.sensed,
                with_start(settled),
                settled.constant,
                rounds=2,
                full_band=full_band,
                settle=self._settled,
                coloured=True,
            )
            settled = settled if is_implausible(slow, method=self.method) else self._with_white_noise(slow, full_band=full_band)
        return self.model(model.candidates, settled)

    def _with_white_noise(self, fitted: Fitted, *, full_band: bool) -> Fitted:
        """Return a fit with the noise that a search goes on with: in a slow one, effects that are not found yet would pass for noise."""
        noise = noise_of(fitted.residual, self.experiment.sensed.noise_shapes(fitted.by_name))
        return replace(fitted, noise=noise, log_likelihood=log_likelihood(fitted.residual, noise, full_band=full_band))

    def with_better_motion(self, fitted: Fitted, candidates: Sequence[Candidate]) -> Fitted:
        """Return a fit in which frictions sense the recorded motion, or the simulated one where that leaves far less of the error: as where
        they hold a table still. A simulation that is a little off holds a table that slides, so it is not done without need."""
        motion = self.experiment.simulated_motion_of(candidates)
        if not motion:
            return fitted
        given = {name: value for name, value in fitted.constant.items() if name not in motion}
        with_simulated_motion = all(fitted.constant.get(name) == 0.0 for name in motion)
        constant, full_band = given if with_simulated_motion else {**given, **motion}, is_full_band(candidates)

        def share(other: Fitted) -> float:
            """Return what is left where the simulated motion is sensed, over what is left where the recorded one is."""
            recorded, simulated = (other, fitted) if with_simulated_motion else (fitted, other)
            before, after = (self.error(self.experiment, one)[::2] for one in (recorded, simulated))
            return _share_left(before, after, method=self.method)

        rough = fit(self.experiment.sensed, with_start(fitted), constant, rounds=1, full_band=full_band, tolerance=ROUGH, slopes="kept")
        limit = self.method.selection.simulated_motion_left
        # a rough fit decides where it is clear of the limit by a factor of two
        if share(rough) < 0.5 * limit if with_simulated_motion else share(rough) > 2.0 * limit:
            return fitted
        other = fit(self.experiment.sensed, with_start(rough), constant, rounds=2, full_band=full_band, settle=self._settled)
        if (share(other) < limit) == with_simulated_motion:
            return fitted
        return other if with_simulated_motion or self._holds_there_too(fitted, other, motion) else fitted

    def _holds_there_too(self, fitted: Fitted, with_simulated_motion: Fitted, motion: Mapping[str, float]) -> bool:
        """Return whether a fit in which frictions sense the simulated ``motion`` leaves less of the validation recording too."""
        starts = self.validation.start_states(self.validation.sensed.plan)
        own = {item.name for item in starts}
        there = []
        for one, settings in ((fitted, {}), (with_simulated_motion, motion)):
            constant = {name: value for name, value in one.by_name.items() if name not in own} | dict(settings)
            there.append(fit(self.validation.sensed, starts, constant, rounds=1, iterations=6, tolerance=ROUGH, slopes="kept"))
        # the recording's own noise: that of the fitted one is of another length, and maybe of other differences
        left = [whitened_power(one.residual, there[0].noise, full_band=False) for one in there]
        return left[1] < left[0]

    def _removed(self, before: Model, fitted: Fitted) -> float:
        """Return the share of what a model leaves that a fit explains, in the channel where it takes most."""
        rest = before.error + np.maximum(self.everything - self.baseline_error, 0.0)
        return float(np.max((before.error - self.error(self.experiment, fitted)) / rest))

    def _at_best_size(
        self,
        before: Model,
        candidate: Candidate,
        start: FloatArray,
        free: Sequence[Free],
        constant: Mapping[str, float],
        *,
        full_band: bool,
    ) -> FloatArray:
        """Return starting values with the effect as large as it does best there, everything else as it was: what screening made of a
        response to a usual size may swing a machine far beyond anything that was recorded, from where a fit hardly finds back."""
        limits = self.method.selection
        sizes = np.array([name.partition(".")[2] in candidate.effect.neutral for name in candidate.parameters]) & ~is_limit(candidate)
        points = [np.where(sizes, candidate.neutral + share * (start - candidate.neutral), start) for share in limits.sizes_tried]
        # a light table on a soft spring is further away, not nearer: what vanishes there is a spring that is stiff
        stiffer = np.array([name == f"{candidate.part}.{candidate.effect.identification.resonance}" for name in candidate.parameters])
        points += [np.minimum(np.where(stiffer, factor * start, start), candidate.high) for factor in limits.stiffer_tried if stiffer.any()]
        names = [*constant, *(item.name for item in free), *candidate.parameters]
        rows = np.array([[*constant.values(), *(item.start for item in free), *point] for point in points])
        powers = [
            whitened_power(residual, before.fitted.noise, full_band=full_band) for residual in self.experiment.sensed.residuals(names, rows)
        ]
        return points[int(np.argmin(powers))]

    def trial(
        self,
        before: Model,
        candidate: Candidate,
        kept: tuple[Candidate, ...],
        free: Sequence[Free],
        starts: Sequence[FloatArray],
        promised: float = np.inf,
        *,
        with_simulated_motion: bool = False,
    ) -> Trial:
        """Return the trial of a candidate, fitted from some starting values on top of ``kept`` and compared with the model before.

        What the model before had free moves along its slopes there: a trial needs only the runs of its own parameters. Once a start has
        explained the share of the error that screening ``expected``, the others are not fitted. ``sensed`` lets frictions sense the
        simulated motion: one of the first micrometres is lost in the rounding of a recorded one.
        """
        candidates, sensed = (*kept, candidate), self.experiment.sensed
        full_band = is_full_band(candidates)
        constant = {**before.fitted.constant, **(self.experiment.simulated_motion_of(candidates) if with_simulated_motion else {})}
        best = self._from_best_start(before, candidate, free, starts, constant, promised, full_band=full_band)
        best = self._with_fresh_slopes(before, best, candidate, constant, full_band=full_band)
        implausible_before = is_implausible(before.fitted, method=self.method)
        if implausible_before:
            # what the effect explains had implausible the values of the machine: from there a fit may not find its way back
            given, fine = _at_given_values(with_start(best)), self.method.selection.fine
            other = fit(sensed, given, constant, rounds=2, full_band=full_band, tolerance=fine, slopes="kept")
            best = max((best, other), key=lambda fitted: fitted.score)
        gain = judged_score(self.experiment, best).above(before.score, full_band=is_full_band((*before.candidates, candidate)))
        if gain <= self.least_gain and self._removed(before, best) > self.method.shared.larger_part:
            best = fit(sensed, with_start(best), constant, rounds=2, full_band=full_band, settle=self._settled, slopes="kept")
            gain = judged_score(self.experiment, best).above(before.score, full_band=is_full_band((*before.candidates, candidate)))
        restores_plausibility = (
            implausible_before
            and self.method.selection.restores_clearly * float(np.sum(prior_deviations(best) ** 2))
            < self.method.selection.implausible_penalty
        )
        if not (gain > self.least_gain or restores_plausibility):
            return Trial(candidate, replace(before, candidates=candidates, fitted=best), gain, -np.inf, 0.0, 0.0, 0.0)
        judged = _Fit(best, gain, restores_plausibility, with_simulated_motion)
        return self._judged(before, candidate, candidates, judged)

    def _from_best_start(
        self, before: Model, candidate: Candidate, free: Sequence[Free], starts: Sequence[FloatArray], constant: Mapping[str, float],
        promised: float, *, full_band: bool,
    ) -> Fitted:  # fmt: skip
        """Return the best fit from some starting values; what the model before had free moves along its slopes there."""
        known = dict(zip(before.fitted.names, before.fitted.sensitivity, strict=True)) if before.fitted.sensitivity is not None else {}
        if constant != before.fitted.constant:
            known = {}
        best: Fitted | None = None
        for start in starts:
            freed = [
                *free,
                *candidate_free(
                    candidate, self._at_best_size(before, candidate, start, free, constant, full_band=full_band), method=self.method
                ),
            ]
            # weighed as the model before it is: where a start swings far, a noise model of its own would find that quite usual
            fitted = fit(
                self.experiment.sensed,
                freed,
                constant,
                rounds=2,
                iterations=8,
                noise=before.fitted.noise,
                full_band=full_band,
                tolerance=ROUGH,
                known=known,
                slopes="kept",
            )
            if best is None or fitted.score > best.score:
                best = fitted
            if self._removed(before, fitted) > self.method.selection.almost_all * promised:
                break
        assert best is not None
        return best

    def _with_fresh_slopes(
        self, before: Model, best: Fitted, candidate: Candidate, constant: Mapping[str, float], *, full_band: bool
    ) -> Fitted:
        """Return a fit with its slopes taken anew, where a value moved so far that those of the model before hold no longer."""
        nearby = before.fitted
        for _ in range(self.method.selection.slopes_afresh):
            if not _far(nearby, best, self.method):
                break
            # the slopes taken over hold no longer: without them two forms of one thing would end in different places of a valley
            nearby = fit(self.experiment.sensed, with_start(best), constant, rounds=0, full_band=full_band)
            known = dict(zip(nearby.names, nearby.sensitivity, strict=True)) if nearby.sensitivity is not None else {}
            known = {name: slope for name, slope in known.items() if name not in candidate.parameters}
            best = fit(
                self.experiment.sensed,
                with_start(best),
                constant,
                rounds=2,
                full_band=full_band,
                tolerance=self.method.selection.fine,
                known=known,
                slopes="kept",
            )
        return best

    def _judged(self, before: Model, candidate: Candidate, candidates: tuple[Candidate, ...], of: _Fit) -> Trial:
        """Return the trial of a fit: what it gains on the validation recording, and what it does to the closed-loop simulation."""
        best, gain = of.fitted, of.gain
        model = self.model(candidates, best)
        held = model.validation.above(before.validation, full_band=is_full_band((*before.candidates, candidate)))
        lost = before.error - model.error
        rest = before.error + np.maximum(self.everything - self.baseline_error, 0.0)
        shares = float(np.max(lost / self.everything)), float(np.max(lost / rest))
        full_band_gains = model.score.above(before.score, full_band=True), model.validation.above(before.validation, full_band=True)
        if of.with_simulated_motion and held < gain:
            # what holds a part a little wrongly adds up to metres in a replay of another recording; a controller keeps both together
            agreed = agreed_in_closed_loop(
                (self.experiment, before.fitted, model.fitted), (self.validation, before.validation_fit, model.validation_fit)
            )
            held, full_band_gains = max(held, agreed * gain), (full_band_gains[0], max(full_band_gains[1], agreed * full_band_gains[0]))
        moved, closed_loop_degradation = in_own_simulation(self.experiment, before.fitted, best, candidate)
        return Trial(
            candidate,
            model,
            gain,
            held,
            moved,
            *shares,
            of.restores_plausibility,
            is_implausible(best, method=self.method),
            becomes_implausible(before.fitted, best),
            *full_band_gains,
            closed_loop_degradation,
        )


def _share_left(before: FloatArray, after: FloatArray, method: Method = STANDARD) -> float:
    """Return what is left ``after`` over what was ``before``, (channels,): in the channel where that is least, as what is missing in others
    has nothing to do with it; in all where others are left with more, by a part of what is explained."""
    telling, change = before > method.selection.unexplained_power, before - after
    taken, added = float(change.clip(min=0.0).sum()), float(-change.clip(max=0.0).sum())
    if not telling.any() or added > method.selection.increase_elsewhere * taken:
        return float(after.sum() / before.sum())
    return float(np.min(after[telling] / before[telling]))


def _at_given_values(free: Sequence[Free]) -> list[Free]:
    """Return free parameters with the values of the lesson as it gives them: from implausible ones a fit may not find its way back."""
    return [replace(item, start=item.given) if np.isfinite(item.uncertainty) else item for item in free]


def is_implausible(fitted: Fitted, method: Method = STANDARD) -> bool:
    """Return whether values of the lesson are further off than it holds possible, one by itself or all together."""
    off = prior_deviations(fitted)
    return float(off @ off) > method.selection.implausible_penalty or float(off.max(initial=0.0)) > IMPLAUSIBLE


def becomes_implausible(before: Fitted, after: Fitted) -> bool:
    """Return whether a value of the lesson is implausible after an effect was taken in, and none was before: the effect needs a machine
    that is not there."""
    return bool(prior_deviations(after).max(initial=0.0) > IMPLAUSIBLE >= prior_deviations(before).max(initial=0.0))


def prior_deviations(fitted: Fitted) -> FloatArray:
    """Return by how many declared standard deviations each value of the lesson is off; how a recording starts is none of them."""
    known = [(value, item) for value, item in zip(fitted.values, fitted.free, strict=True) if np.isfinite(item.low + item.high)]
    return np.array([abs(value - item.given) / item.uncertainty for value, item in known if np.isfinite(item.uncertainty)], dtype=float)


def _far(before: Fitted, after: Fitted, method: Method) -> bool:
    """Return whether a value that both have moved by more than three of its standard errors."""
    values = after.by_name
    both = [(name, start) for name, start in zip(before.names, before.values, strict=True) if name in values]
    return any(abs(values[name] - start) > method.selection.significant * before.error(name) for name, start in both)


def candidate_free(candidate: Candidate, start: FloatArray, method: Method = STANDARD) -> list[Free]:
    """Return the parameters of a candidate as free ones, starting at ``start``."""
    spread = np.maximum(np.abs(candidate.points).max(axis=0, initial=0.0), np.abs(start)) if len(candidate.points) else np.abs(start)
    spread = np.where(spread > 0.0, spread, candidate.usual)
    free = [
        Free(name, float(value), max(float(scale) * 0.3, 1e-12), float(low), float(high))
        for name, value, scale, low, high in zip(candidate.parameters, start, spread, candidate.low, candidate.high, strict=True)
    ]
    orders = candidate.named(candidate.effect.identification.orders)
    # an order is a whole number
    return [
        replace(item, uncertainty=method.selection.whole_order, given=round(item.start)) if item.name in orders else item for item in free
    ]


def judged_score(experiment: Experiment, fitted: Fitted) -> Score:
    """Return the likelihood of a fit, less half its penalty."""
    noise = noise_of(fitted.residual, experiment.sensed.noise_shapes(fitted.by_name))
    penalty = 0.5 * fitted.penalty
    return Score(log_likelihood(fitted.residual, noise, full_band=False) - penalty, log_likelihood(fitted.residual, noise) - penalty)
