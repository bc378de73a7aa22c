"""One candidate on top of a model: everything refitted, and how much better both recordings are explained."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from lathesim.diagnosis.fit import Fitted, Free, fit, log_likelihood, noise_of, with_start
from lathesim.diagnosis.noise_model import NoiseModel, carried_over
from lathesim.diagnosis.problem import Rig
from lathesim.diagnosis.terms import Term
from lathesim.engine.assembly import FloatArray

_FAST_FAMILIES = frozenset({"lag", "structure", "once per turn", "encoder", "drive range", "recording"})
"""Families that show above the frequencies of the motion; a model with one of them is fitted on all frequencies."""

SETTLING = 0.02
"""Share of a recording at its beginning that is left out of residuals: controllers start with memories that nobody recorded."""
STRAIN = 16.0
"""Penalty of a baseline one of whose values is four declared standard deviations away from what the lesson says."""
_VAGUE = 0.02
"""A value whose standard error is a larger share of it than this is left open by a recording."""
_ROUGH = 1e-4
"""A trial's descent ends when a step gains less than this share of the cost; what is reported is fitted more finely."""

_WHOLE = 2e-3
"""How far an order may be from a whole number: as far as the speed is known."""
_TURNS = (0.0, 0.5 * np.pi, np.pi, -0.5 * np.pi)

Tell = Callable[[str], None]


@dataclass(frozen=True)
class Score:
    """Likelihood of a recording under a model [nats]: on the frequencies of the motion, and on all."""

    motion: float
    wide: float

    def above(self, other: Score, *, wide: bool) -> float:
        """Give by how much this one is better."""
        return self.wide - other.wide if wide else self.motion - other.motion


@dataclass(frozen=True)
class Model:
    """The baseline with the effects believed so far.

    ``error`` is what each channel is off above its floor, weighed as the baseline's residual is; ``held_out_fit`` the model on the
    held-out recording, with only what belongs to a recording fitted anew.
    """

    terms: tuple[Term, ...]
    fitted: Fitted
    score: Score
    held_out_fit: Fitted
    held_out: Score
    error: FloatArray

    @property
    def free(self) -> list[Free]:
        """The free parameters, starting where they ended."""
        return with_start(self.fitted)


@dataclass(frozen=True)
class Trial:
    """A candidate fitted on top of a model: its gains in likelihood on both recordings [nats] and the share of the error it removes."""

    term: Term
    model: Model
    gain: float
    held_out_gain: float
    moves: float
    share_of_all: float
    share_of_rest: float
    relieves: bool = False
    """Whether the baseline, strained beyond what the lesson holds possible, no longer is: the error had been absorbed by its values."""
    wide_gain: float = 0.0
    """The gains on all frequencies, on which trials of slow and of fast effects are held against each other: fitted and held out."""
    wide_held_out_gain: float = 0.0


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

    def error(self, rig: Rig, fitted: Fitted) -> FloatArray:
        """Give for each channel the squared error of a fit above the floor: in the band of the motion, and then on all frequencies.

        It is weighed as forces and sensor noise of the baseline's size are: an error of force counts alike in every model.
        """
        return self._error(rig, fitted)[0]

    def _error(self, rig: Rig, fitted: Fitted) -> tuple[FloatArray, FloatArray]:
        shapes = rig.sensed.noise_shapes(fitted.by_name)
        errors, floors = [], []
        for row, shape, base in zip(fitted.residual, shapes, self.weights or fitted.noise, strict=True):
            weight = carried_over(base, shape)
            for wide in (False, True):
                white = weight.whiten(row, wide=wide)
                kept = slice(0, len(weight.power) if wide else min(weight.band, len(weight.power)))
                floor = float(np.sum(2.0 * shape.floor**2 * shape.shapes[0][kept] / weight.power[kept]))
                errors.append(max(float(np.sum(white * white)) - floor, 1e-9))
                floors.append(floor)
        return np.array(errors), np.array(floors)

    def settled(self, model: Model) -> Model:
        """Fit a model anew from where it stands, with all slopes taken afresh."""
        return self.model(model.terms, fit(self.rig.sensed, model.free, model.fitted.constant, rounds=2, wide=is_wide(model.terms)))

    def trial(self, before: Model, term: Term, kept: tuple[Term, ...], free: Sequence[Free], starts: Sequence[FloatArray]) -> Trial:
        """Fit a term from some starting values on top of ``kept`` and hold it against the model before.

        What the model before had free moves along its slopes there: a trial needs only the runs of its own parameters.
        """
        terms = (*kept, term)
        wide = is_wide(terms)
        known = dict(zip(before.fitted.names, before.fitted.sensitivity, strict=True)) if before.fitted.sensitivity is not None else {}
        best: Fitted | None = None
        for start in starts:
            freed = [*free, *term_free(term, start)]
            fitted = fit(self.rig.sensed, freed, before.fitted.constant, rounds=2, iterations=8, wide=wide, tolerance=_ROUGH, known=known)
            if best is None or fitted.score > best.score:
                best = fitted
        assert best is not None
        if _far(before.fitted, best):
            # the slopes taken over hold no longer: without them two forms of one thing would end in different places of a valley
            best = fit(self.rig.sensed, with_start(best), before.fitted.constant, rounds=2, wide=wide)
        gain = judged_score(self.rig, best).above(before.score, wide=is_wide((*before.terms, term)))
        if gain <= 0.0:
            return Trial(term, replace(before, terms=terms, fitted=best), gain, -np.inf, 0.0, 0.0, 0.0)
        model = self.model(terms, best)
        held = model.held_out.above(before.held_out, wide=is_wide((*before.terms, term)))
        lost = before.error - model.error
        rest = before.error + np.maximum(self.everything - self.baseline_error, 0.0)
        shares = float(np.max(lost / self.everything)), float(np.max(lost / rest))
        wide_gains = model.score.above(before.score, wide=True), model.held_out.above(before.held_out, wide=True)
        relieves = before.fitted.penalty > STRAIN > 4.0 * best.penalty
        trial = Trial(term, model, gain, held, moves(self.rig, best, term), *shares, relieves, *wide_gains)
        removes = f"removes {shares[0]:.1%} of all, {shares[1]:.0%} of the rest"
        self.say(f"  {term.name} at {term.at}: {gain:.0f} nats, held out {held:.0f}, {removes}")
        return trial


def _far(before: Fitted, after: Fitted) -> bool:
    """Say whether a value that both have moved by more than three of its standard errors."""
    values = after.by_name
    both = [(name, start) for name, start in zip(before.names, before.values, strict=True) if name in values]
    return any(abs(values[name] - start) > 3.0 * before.error(name) for name, start in both)


def term_free(term: Term, start: FloatArray) -> list[Free]:
    """Give the parameters of a term as free ones, starting at ``start``."""
    spread = np.maximum(np.abs(term.points).max(axis=0, initial=0.0), np.abs(start)) if len(term.points) else np.abs(start)
    free = [
        Free(name, float(value), max(float(scale) * 0.3, 1e-12), float(low), float(high))
        for name, value, scale, low, high in zip(term.parameters, start, spread, term.low, term.high, strict=True)
    ]
    # an order is a whole number
    return [replace(item, uncertainty=_WHOLE, given=round(item.start)) if item.name.endswith(".order") else item for item in free]


def moves(rig: Rig, fitted: Fitted, term: Term) -> float:
    """Give by how much the effect moves the channel it moves most, over what the model leaves unexplained there (root mean squares).

    It is measured in the lesson's own simulation: where a controller answers to a force that nobody modelled, its command goes with that
    force, and in a replay almost anything between command and motion seems to explain some of it. Where nothing feeds back that cannot
    happen, and a third of the move is enough.
    """
    with_it = fitted.by_name
    without = {**with_it, **dict(zip(term.parameters, term.neutral.tolist(), strict=True))}
    names = list(with_it)
    runs = rig.own.outputs(names, np.array([[with_it[name] for name in names], [without[name] for name in names]]))
    first, second = (rig.sensed.as_seen(run) for run in runs)
    begin = int(SETTLING * rig.own.samples)
    left = np.sqrt(np.mean(np.nan_to_num(rig.sensed.seen - first)[:, begin:] ** 2, axis=1))
    moved = np.sqrt(np.mean((first - second)[:, begin:] ** 2, axis=1))
    size = float(np.max(np.nan_to_num(moved / np.maximum(left, rig.sensed.seen_floors))))
    return size if rig.feeds_back else 3.0 * size


def is_wide(terms: Sequence[Term]) -> bool:
    """Say whether a model is to be fitted on all frequencies."""
    return any(term.family in _FAST_FAMILIES for term in terms)


def judged_score(rig: Rig, fitted: Fitted) -> Score:
    """Give the likelihood of a fit, less half its penalty."""
    noise = noise_of(fitted.residual, rig.sensed.noise_shapes(fitted.by_name))
    penalty = 0.5 * fitted.penalty
    return Score(log_likelihood(fitted.residual, noise, wide=False) - penalty, log_likelihood(fitted.residual, noise) - penalty)


def on_recording(rig: Rig, fitted: Fitted, terms: Sequence[Term]) -> Fitted:
    """Give a fitted model on another recording: start values and nuisance parameters fitted anew, the rest as it is."""
    starts = rig.start_states(rig.sensed.plan)
    own = {item.name for item in starts}
    nuisance = {name for term in terms for name in term.nuisance}
    values = fitted.by_name
    free = [*starts, *[replace(item, start=values[item.name]) for item in fitted.free if item.name in nuisance]]
    free += [item for item in _vague(fitted) if item.name not in own and item.name not in nuisance]
    freed = {item.name for item in free}
    constant = {name: value for name, value in values.items() if name not in freed and name not in own}
    phases = [item.name for item in free if item.name in nuisance and item.name.endswith("phase")]
    if phases:
        # a phase may be anywhere on another recording, and from the wrong side a fit ends in the wrong hump
        turned = [[replace(item, start=item.start + turn) if item.name in phases else item for item in free] for turn in _TURNS]
        tried = [fit(rig.sensed, start, constant, rounds=1, iterations=4, tolerance=_ROUGH) for start in turned]
        free = with_start(max(tried, key=lambda fitted: fitted.score))
    return fit(rig.sensed, free, constant, rounds=2, iterations=6, tolerance=_ROUGH)


def _vague(fitted: Fitted) -> list[Free]:
    """Give the values that a recording left open, held by what it does say of them: where it tells only a ratio of two, another one is not
    to be judged by where in that valley the fit came to rest."""
    found = []
    for item in fitted.free:
        value, error = fitted.by_name[item.name], fitted.error(item.name)
        if error > _VAGUE * abs(value) > 0.0:
            found.append(replace(item, start=value, given=value, uncertainty=error))
    return found
