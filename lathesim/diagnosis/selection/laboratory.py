"""One candidate on top of a model: everything refitted, and how much better both recordings are explained."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from lathesim.diagnosis.candidates.screening import is_limit
from lathesim.engine.assembly import FloatArray
from lathesim.identification.estimation.fractional_delay import between_samples
from lathesim.identification.estimation.least_squares import fit, log_likelihood, noise_of
from lathesim.identification.estimation.transfer import on_recording
from lathesim.identification.execution.budget import Tell
from lathesim.identification.noise.noise_model import NoiseModel, carried_over, whitened_power
from lathesim.identification.records.candidate import Term
from lathesim.identification.records.fit import Fitted, Free, with_start
from lathesim.identification.records.model import Model, Score, Trial, is_wide
from lathesim.identification.replay.closed_loop import agreed_in_closed_loop, in_own_simulation
from lathesim.identification.replay.experiment import POSSIBLE, Rig

STRAINED = 0.98 * POSSIBLE
"""Declared standard deviations from which on a value of the lesson is strained: it would go further if it might."""
STRAIN = 16.0
"""Penalty from which on the values of the lesson are strained together."""
_ROUGH = 1e-4
"""A trial's descent ends when a step gains less than this share of the cost; what is reported is fitted more finely."""

_LEFT_AT_ALL, _ADDED = 40.0, 0.1
"""Whitened power from which on something is left in a channel, and share of what is taken away in some that may be added in others."""
_HELD_STILL = 0.15
"""Share of the error that may be left for frictions to sense the simulated motion."""
_CLEARLY = 2.0
"""Factor from that share beyond which a rough fit is enough to tell."""
_CONTRADICTS = 0.5
"""Share of the rest that a trial takes away above which it should gain: one that does not ended where the noise before it, which all that
was missing had made loose, let a mean stay that the noise after it cannot."""
_SETTLED = 1.0
"""Nats that a further round of fitting must gain for another one."""
_FINE = 1e-5
_AS_PROMISED = 0.98
"""Share of what was promised that is as good as all of it."""
_SIZES = (1.0, 0.5, 0.2, 0.05)
"""Shares of the size that screening gives an effect from which a fit may begin."""
_STIFFER = (2.0, 4.0, 8.0)
_MOST_AFRESH = 2
"""How often slopes are taken afresh in a trial."""
_WHOLE = 2e-3
"""How far an order may be from a whole number: as far as the speed is known."""


@dataclass
class Bench:
    """What every trial needs: the two recordings, and how the baseline's residual is weighed."""

    rig: Rig
    held_out: Rig
    say: Tell
    weights: tuple[NoiseModel, ...] = ()
    baseline_error: FloatArray = field(default_factory=lambda: np.zeros(0))
    everything: FloatArray = field(default_factory=lambda: np.zeros(0))
    """The squared error of the baseline in each channel, floor included."""
    least_gain: float = 0.0
    """Gain in likelihood [nats] that a trial must reach for the held-out recording to be asked about it."""

    @property
    def runs(self) -> int:
        """How many runs were held against the two recordings until now."""
        return self.rig.sensed.runs.total + self.held_out.sensed.runs.total

    def model(self, terms: tuple[Term, ...], fitted: Fitted) -> Model:
        """Judge a fit on both recordings."""
        judged = on_recording(self.held_out, fitted, terms)
        return Model(
            terms, fitted, judged_score(self.rig, fitted), judged, judged_score(self.held_out, judged), self.error(self.rig, fitted)
        )

    def weigh(self, baseline: Fitted) -> None:
        """Take the baseline as what every error is weighed and held against."""
        self.weights = baseline.noise
        self.baseline_error, floor = self._error(self.rig, baseline)
        self.everything = self.baseline_error + floor

    def error(self, rig: Rig, fitted: Fitted, white: FloatArray | None = None) -> FloatArray:
        """Give for each channel the squared error of a fit above the floor: in the band of the motion, and then on all frequencies.

        It is weighed as forces and sensor noise of the baseline's size are: an error of force counts alike in every model. ``white``
        (channels,) is the power of what the sensors add to their floors, which is no error.
        """
        return self._error(rig, fitted, white)[0]

    def _error(self, rig: Rig, fitted: Fitted, white: FloatArray | None = None) -> tuple[FloatArray, FloatArray]:
        shapes = rig.sensed.noise_shapes(fitted.by_name)
        errors, floors = [], []
        added = np.zeros(len(shapes)) if white is None else white
        for row, shape, base, more in zip(fitted.residual, shapes, self.weights or fitted.noise, added, strict=True):
            weight = carried_over(base, shape)
            for wide in (False, True):
                white = weight.whiten(row, wide=wide)
                kept = slice(0, len(weight.power) if wide else min(weight.band, len(weight.power)))
                floor = float(np.sum(2.0 * (shape.floor**2 + more) * shape.shapes[0][kept] / weight.power[kept]))
                errors.append(max(float(np.sum(white * white)) - floor, 1e-9))
                floors.append(floor)
        return np.array(errors), np.array(floors)

    def most_removed(self, rig: Rig, before: Fitted, after: Fitted) -> float:
        """Give the share of the error of one fit, floor included, that another one takes away in the channel where it takes most."""
        error, floor = self._error(rig, before)
        return float(np.max((error - self.error(rig, after))[::2] / (error + floor)[::2]))

    def settled(self, model: Model) -> Model:
        """Fit a model anew from where it stands until nothing moves any more, with all slopes taken afresh."""
        wide, constant = is_wide(model.terms), model.fitted.constant
        settled = fit(self.rig.sensed, model.free, constant, rounds=2, wide=wide, settle=_SETTLED)
        if moved := between_samples(self.rig, settled, model.terms, wide=wide):
            settled = fit(self.rig.sensed, moved, constant, rounds=2, wide=wide, settle=_SETTLED)
        settled = self.feeling(settled, model.terms)
        if is_strained(settled):
            # a slow load that nobody measured draws values with it where noise is held to be white
            slow = fit(self.rig.sensed, with_start(settled), settled.constant, rounds=2, wide=wide, settle=_SETTLED, coloured=True)
            settled = settled if is_strained(slow) else self._with_white_noise(slow, wide=wide)
        return self.model(model.terms, settled)

    def _with_white_noise(self, fitted: Fitted, *, wide: bool) -> Fitted:
        """Give a fit with the noise that a search goes on with: in a slow one, effects that are not found yet would pass for noise."""
        noise = noise_of(fitted.residual, self.rig.sensed.noise_shapes(fitted.by_name))
        return replace(fitted, noise=noise, log_likelihood=log_likelihood(fitted.residual, noise, wide=wide))

    def feeling(self, fitted: Fitted, terms: Sequence[Term]) -> Fitted:
        """Give a fit in which frictions sense the recorded motion, or the simulated one where that leaves far less of the error: as where
        they hold a table still. A simulation that is a little off holds a table that slides, so it is not done without need."""
        motion = self.rig.feeling_their_motion(terms)
        if not motion:
            return fitted
        given = {name: value for name, value in fitted.constant.items() if name not in motion}
        felt = all(fitted.constant.get(name) == 0.0 for name in motion)
        constant, wide = given if felt else {**given, **motion}, is_wide(terms)

        def share(other: Fitted) -> float:
            """Give what is left where the simulated motion is sensed, over what is left where the recorded one is."""
            recorded, simulated = (other, fitted) if felt else (fitted, other)
            return _share_left(*(self.error(self.rig, one)[::2] for one in (recorded, simulated)))

        rough = fit(self.rig.sensed, with_start(fitted), constant, rounds=1, wide=wide, tolerance=_ROUGH, slopes="kept")
        if share(rough) < _HELD_STILL / _CLEARLY if felt else share(rough) > _HELD_STILL * _CLEARLY:
            return fitted
        other = fit(self.rig.sensed, with_start(rough), constant, rounds=2, wide=wide, settle=_SETTLED)
        if (share(other) < _HELD_STILL) == felt:
            return fitted
        return other if felt or self._holds_there_too(fitted, other, motion) else fitted

    def _holds_there_too(self, fitted: Fitted, felt: Fitted, motion: Mapping[str, float]) -> bool:
        """Say whether a fit in which frictions sense the simulated ``motion`` leaves less of the held-out recording too."""
        starts = self.held_out.start_states(self.held_out.sensed.plan)
        own = {item.name for item in starts}
        there = []
        for one, settings in ((fitted, {}), (felt, motion)):
            constant = {name: value for name, value in one.by_name.items() if name not in own} | dict(settings)
            there.append(fit(self.held_out.sensed, starts, constant, rounds=1, iterations=6, tolerance=_ROUGH, slopes="kept"))
        # the recording's own noise: that of the fitted one is of another length, and maybe of other differences
        left = [whitened_power(one.residual, there[0].noise, wide=False) for one in there]
        return left[1] < left[0]

    def _removed(self, before: Model, fitted: Fitted) -> float:
        """Give the share of what a model leaves that a fit takes away, in the channel where it takes most."""
        rest = before.error + np.maximum(self.everything - self.baseline_error, 0.0)
        return float(np.max((before.error - self.error(self.rig, fitted)) / rest))

    def _at_best_size(
        self, before: Model, term: Term, start: FloatArray, free: Sequence[Free], constant: Mapping[str, float], *, wide: bool
    ) -> FloatArray:
        """Give starting values with the effect as large as it does best there, everything else as it was: what screening made of a response
        to a usual size may swing a machine far beyond anything that was recorded, from where a fit hardly finds back."""
        sizes = np.array([name.partition(".")[2] in term.effect.neutral for name in term.parameters]) & ~is_limit(term)
        points = [np.where(sizes, term.neutral + share * (start - term.neutral), start) for share in _SIZES]
        # a light table on a soft spring is further away, not nearer: what vanishes there is a spring that is stiff
        stiffer = np.array([name == f"{term.part}.{term.effect.resonance}" for name in term.parameters])
        points += [np.minimum(np.where(stiffer, factor * start, start), term.high) for factor in _STIFFER if stiffer.any()]
        names = [*constant, *(item.name for item in free), *term.parameters]
        rows = np.array([[*constant.values(), *(item.start for item in free), *point] for point in points])
        powers = [whitened_power(residual, before.fitted.noise, wide=wide) for residual in self.rig.sensed.residuals(names, rows)]
        return points[int(np.argmin(powers))]

    def trial(
        self,
        before: Model,
        term: Term,
        kept: tuple[Term, ...],
        free: Sequence[Free],
        starts: Sequence[FloatArray],
        promised: float = np.inf,
        *,
        felt: bool = False,
    ) -> Trial:
        """Fit a term from some starting values on top of ``kept`` and hold it against the model before.

        What the model before had free moves along its slopes there: a trial needs only the runs of its own parameters. Once a start has
        taken away the share of the error that screening ``promised``, the others are not fitted. ``felt`` lets frictions sense the
        simulated motion: one of the first micrometres is lost in the rounding of a recorded one.
        """
        terms = (*kept, term)
        wide = is_wide(terms)
        constant = {**before.fitted.constant, **(self.rig.feeling_their_motion(terms) if felt else {})}
        known = dict(zip(before.fitted.names, before.fitted.sensitivity, strict=True)) if before.fitted.sensitivity is not None else {}
        if constant != before.fitted.constant:
            known = {}
        best: Fitted | None = None
        for start in starts:
            freed = [*free, *term_free(term, self._at_best_size(before, term, start, free, constant, wide=wide))]
            # weighed as the model before it is: where a start swings far, a noise model of its own would find that quite usual
            fitted = fit(
                self.rig.sensed,
                freed,
                constant,
                rounds=2,
                iterations=8,
                noise=before.fitted.noise,
                wide=wide,
                tolerance=_ROUGH,
                known=known,
                slopes="kept",
            )
            if best is None or fitted.score > best.score:
                best = fitted
            if self._removed(before, fitted) > _AS_PROMISED * promised:
                break
        assert best is not None
        nearby = before.fitted
        for _ in range(_MOST_AFRESH):
            if not _far(nearby, best):
                break
            # the slopes taken over hold no longer: without them two forms of one thing would end in different places of a valley
            nearby = fit(self.rig.sensed, with_start(best), constant, rounds=0, wide=wide)
            known = dict(zip(nearby.names, nearby.sensitivity, strict=True)) if nearby.sensitivity is not None else {}
            known = {name: slope for name, slope in known.items() if name not in term.parameters}
            best = fit(self.rig.sensed, with_start(best), constant, rounds=2, wide=wide, tolerance=_FINE, known=known, slopes="kept")
        strained_before = is_strained(before.fitted)
        if strained_before:
            # what the effect explains had strained the values of the machine: from there a fit may not find its way back
            other = fit(self.rig.sensed, _eased(with_start(best)), constant, rounds=2, wide=wide, tolerance=_FINE, slopes="kept")
            best = max((best, other), key=lambda fitted: fitted.score)
        gain = judged_score(self.rig, best).above(before.score, wide=is_wide((*before.terms, term)))
        if gain <= self.least_gain and self._removed(before, best) > _CONTRADICTS:
            best = fit(self.rig.sensed, with_start(best), constant, rounds=2, wide=wide, settle=_SETTLED, slopes="kept")
            gain = judged_score(self.rig, best).above(before.score, wide=is_wide((*before.terms, term)))
        relieves = strained_before and 4.0 * float(np.sum(strains(best) ** 2)) < STRAIN
        if not (gain > self.least_gain or relieves):
            return Trial(term, replace(before, terms=terms, fitted=best), gain, -np.inf, 0.0, 0.0, 0.0)
        model = self.model(terms, best)
        held = model.held_out.above(before.held_out, wide=is_wide((*before.terms, term)))
        lost = before.error - model.error
        rest = before.error + np.maximum(self.everything - self.baseline_error, 0.0)
        shares = float(np.max(lost / self.everything)), float(np.max(lost / rest))
        wide_gains = model.score.above(before.score, wide=True), model.held_out.above(before.held_out, wide=True)
        if felt and held < gain:
            # what holds a part a little wrongly adds up to metres in a replay of another recording; a controller keeps both together
            agreed = agreed_in_closed_loop(
                (self.rig, before.fitted, model.fitted), (self.held_out, before.held_out_fit, model.held_out_fit)
            )
            held, wide_gains = max(held, agreed * gain), (wide_gains[0], max(wide_gains[1], agreed * wide_gains[0]))
        moved, spoils = in_own_simulation(self.rig, before.fitted, best, term)
        return Trial(
            term, model, gain, held, moved, *shares, relieves, is_strained(best), strains_anew(before.fitted, best), *wide_gains, spoils
        )


def _share_left(before: FloatArray, after: FloatArray) -> float:
    """Give what is left ``after`` over what was ``before``, (channels,): in the channel where that is least, as what is missing in others
    has nothing to do with it; in all where others are left with more, by a part of what is taken away."""
    telling, change = before > _LEFT_AT_ALL, before - after
    taken, added = float(change.clip(min=0.0).sum()), float(-change.clip(max=0.0).sum())
    if not telling.any() or added > _ADDED * taken:
        return float(after.sum() / before.sum())
    return float(np.min(after[telling] / before[telling]))


def _eased(free: Sequence[Free]) -> list[Free]:
    """Give free parameters with the values of the lesson as it gives them: from strained ones a fit may not find its way back."""
    return [replace(item, start=item.given) if np.isfinite(item.uncertainty) else item for item in free]


def is_strained(fitted: Fitted) -> bool:
    """Say whether values of the lesson are further off than it holds possible, one by itself or all together."""
    off = strains(fitted)
    return float(off @ off) > STRAIN or float(off.max(initial=0.0)) > STRAINED


def strains_anew(before: Fitted, after: Fitted) -> bool:
    """Say whether a value of the lesson is strained after an effect was taken in, and none was before: the effect needs a machine that is
    not there."""
    return bool(strains(after).max(initial=0.0) > STRAINED >= strains(before).max(initial=0.0))


def strains(fitted: Fitted) -> FloatArray:
    """Give by how many declared standard deviations each value of the lesson is off; how a recording starts is none of them."""
    known = [(value, item) for value, item in zip(fitted.values, fitted.free, strict=True) if np.isfinite(item.low + item.high)]
    return np.array([abs(value - item.given) / item.uncertainty for value, item in known if np.isfinite(item.uncertainty)], dtype=float)


def _far(before: Fitted, after: Fitted) -> bool:
    """Say whether a value that both have moved by more than three of its standard errors."""
    values = after.by_name
    both = [(name, start) for name, start in zip(before.names, before.values, strict=True) if name in values]
    return any(abs(values[name] - start) > 3.0 * before.error(name) for name, start in both)


def term_free(term: Term, start: FloatArray) -> list[Free]:
    """Give the parameters of a term as free ones, starting at ``start``."""
    spread = np.maximum(np.abs(term.points).max(axis=0, initial=0.0), np.abs(start)) if len(term.points) else np.abs(start)
    spread = np.where(spread > 0.0, spread, term.usual)
    free = [
        Free(name, float(value), max(float(scale) * 0.3, 1e-12), float(low), float(high))
        for name, value, scale, low, high in zip(term.parameters, start, spread, term.low, term.high, strict=True)
    ]
    # an order is a whole number
    return [replace(item, uncertainty=_WHOLE, given=round(item.start)) if item.name.endswith(".order") else item for item in free]


def judged_score(rig: Rig, fitted: Fitted) -> Score:
    """Give the likelihood of a fit, less half its penalty."""
    noise = noise_of(fitted.residual, rig.sensed.noise_shapes(fitted.by_name))
    penalty = 0.5 * fitted.penalty
    return Score(log_likelihood(fitted.residual, noise, wide=False) - penalty, log_likelihood(fitted.residual, noise) - penalty)
