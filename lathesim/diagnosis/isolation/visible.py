"""From which size on a recording shows an effect, by the limits with which a diagnosis keeps one.

A candidate with values q changes the channels by r(q). The lesson's uncertain values, each within its declared deviation, and the start of
the recording take up a part of that; what they leave, d(q), is least in the metric of the noise W at the frequencies of the motion:

    d = r - J x,        x = argmin |W (r - J x)|^2 + sum (x_i / deviation_i)^2

Whoever lacks the effect takes d for noise, so W is that of e + d, with e what the model leaves: it is found in a few rounds.
The effect is seen where the recording is likelier with it by what a diagnosis asks for: a gain above chance and the due, a share of what
is left, and a reading and a force that change by more than errors of laws and sensors make. Each is a ratio that grows with the square of
the size where the effect is in proportion to it; between the sizes that are run the ratios are interpolated, log over log.

Sources: L. L. Scharf, B. Friedlander, Matched subspace detectors, IEEE Trans. Signal Process. 42 (1994) (generalised likelihood ratio
beside nuisance parameters); D. Eriksson, E. Frisk, M. Krysander, A method for quantitative fault diagnosability analysis of stochastic
linear descriptor models, Automatica 49 (2013) (a distance in noise units in the place of structural isolability).
Left out: what a loop does with a change of its own motion, as parts are replayed along the recorded one.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import ClassVar

import numpy as np

from lathesim.diagnosis.candidates.screening import is_limit
from lathesim.diagnosis.candidates.starting_points import limit_points
from lathesim.diagnosis.explaining.chance import chance_level
from lathesim.diagnosis.explaining.density import gain
from lathesim.diagnosis.explaining.plausible import IMPLAUSIBLE, is_of_a_clock
from lathesim.diagnosis.explaining.resolution import least_size
from lathesim.diagnosis.explaining.study import Study
from lathesim.diagnosis.explanations.lacking_force import lacking
from lathesim.diagnosis.records.found import Gain
from lathesim.engine.assembly import FloatArray, Place
from lathesim.identification.estimation.least_squares import log_likelihood
from lathesim.identification.execution import together
from lathesim.identification.noise import NoiseModel, fit_noise_model, whitened
from lathesim.identification.records import Candidate, Fitted, Model, instants_of, is_full_band, known_beforehand
from lathesim.identification.signal import BEYOND, root_mean_square

_NO_GAIN = Gain(0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Taken:
    """What the free values of a fit take up of a change of the channels; ``names`` are those values."""

    names: tuple[str, ...]
    slopes: FloatArray
    """Change of the channels for one unit of each value (values, channels, samples)."""
    noise: tuple[NoiseModel, ...]
    held: FloatArray
    """What holds each value: one over its standard deviation beforehand (values,)."""

    @classmethod
    def of(cls, fitted: Fitted) -> Taken:
        """Return what the values of a fit take up."""
        slopes = np.zeros((0, *fitted.residual.shape)) if fitted.sensitivity is None else -fitted.sensitivity
        return cls(tuple(fitted.names), slopes, fitted.noise, np.sqrt(known_beforehand(fitted.free)))

    @cached_property
    def white(self) -> FloatArray:
        """The slopes as independent numbers of variance one where the noise is that of the fit, (values, numbers)."""
        return whitened(self.noise, self.slopes, full_band=False)

    def amounts(self, change: FloatArray, noise: Sequence[NoiseModel]) -> FloatArray:
        """Return by how much each value takes up a change (channels, samples) where the noise is such, (values,)."""
        white = self.white if noise is self.noise else whitened(noise, self.slopes, full_band=False)
        known = white @ white.T + np.diag(self.held**2)
        wanted = white @ whitened(noise, change[None], full_band=False)[0]
        size = np.sqrt(np.maximum(np.diag(known), 1e-300))
        return np.asarray(np.linalg.lstsq(known / np.outer(size, size), wanted / size)[0] / size)

    def left(self, change: FloatArray, noise: Sequence[NoiseModel]) -> FloatArray:
        """Return what is left of a change (channels, samples) of the channels."""
        return np.asarray(change - np.tensordot(self.amounts(change, noise), self.slopes, axes=1))


@dataclass(frozen=True, eq=False)
class Shape:
    """A candidate of one shape: its values are those of a ``point``, of which the sizes grow by a factor, or a limit comes down by one."""

    candidate: Candidate
    point: FloatArray

    @property
    def sizes(self) -> np.ndarray:
        """Which values are sizes: without them the effect is nothing."""
        return np.array([Place.of(name).port in self.candidate.effect.neutral for name in self.candidate.parameters])

    @property
    def size(self) -> str:
        """The free name of the size by which it is reported."""
        there = self.sizes & (self.point != self.candidate.neutral)
        return self.candidate.parameters[int(np.argmax(there if there.any() else self.sizes))]

    @property
    def is_size_from_neutral(self) -> bool:
        """Whether the size counts from where the effect is none, as that of a factor does; a limit is none far beyond."""
        return not bool(is_limit(self.candidate)[self.candidate.parameters.index(self.size)])

    def grown(self, factor: float) -> FloatArray:
        """Return the values (parameters,) with sizes so many times those of the point, within their bounds."""
        candidate, limits = self.candidate, is_limit(self.candidate)
        larger = candidate.neutral + factor * (self.point - candidate.neutral)
        values = np.where(limits, self.point / factor, np.where(self.sizes, larger, self.point))
        return np.asarray(np.clip(values, candidate.low, candidate.high))


def shapes(study: Study, candidates: Sequence[Candidate], few: int = 3) -> list[Shape]:
    """Return so ``few`` shapes of each candidate, of usual size: periods, speeds and frequencies over their usual range, limits where the
    recording comes to, events within it, waves that repeat."""
    experiment = study.estimation
    duration = len(experiment.record) * experiment.machine.assembly.sample_period
    limits = limit_points(experiment, candidates)
    found = []
    for candidate in candidates:
        points = np.array(limits[candidate.part][:1] if candidate.part in limits else candidate.points)
        points = points[np.unique(np.linspace(0, len(points) - 1, few).round().astype(int))] if len(points) else points
        for place, name in enumerate(candidate.parameters):
            if name in instants_of(candidate):
                points[:, place] = duration * (np.arange(len(points)) + 1.0) / (len(points) + 1.0)
        found += [Shape(candidate, point) for point in points if np.any(point != candidate.neutral)]
    return [shape for shape in found if np.any(shape.sizes & (shape.point != shape.candidate.neutral))]


@dataclass(frozen=True, eq=False)
class ChannelChange:
    """What a candidate with some values does to the channels (channels, samples), and what the model's values leave of it; by what the
    recording is likelier with it, and how far that is above what it needs to be seen (1: it is just seen)."""

    candidate: Candidate
    values: FloatArray
    run: FloatArray
    left: FloatArray
    gain: Gain = _NO_GAIN
    above: float = 0.0

    @property
    def by_name(self) -> dict[str, float]:
        """The values by the names of their parameters without the part."""
        return {Place.of(name).port: value for name, value in zip(self.candidate.parameters, self.values.tolist(), strict=True)}


@dataclass(frozen=True, eq=False)
class Looking:
    """A recording beside a model of it, with what the values of the model take up: where changes of the channels are judged."""

    study: Study
    fitted: Fitted
    taken: Taken
    least: FloatArray
    """The smallest force behind each channel that errors of laws do not make (channels,)."""
    long_steps: FloatArray
    """What the model leaves of the channels where it is simulated with one step a sample."""

    @classmethod
    def at(cls, study: Study, fitted: Fitted) -> Looking:
        """Return the recording of a study beside a fit."""
        model = Model((), fitted, fitted)
        least = [least_size(study, model, row) for row in range(len(fitted.residual))]
        return cls(study, fitted, Taken.of(fitted), np.array(least), study.estimation.sensed.with_long_steps(fitted.by_name))

    @cached_property
    def idle(self) -> dict[str, float]:
        """The values of the model, and of all other candidates where they are nothing: runs of the same names share their machine code."""
        candidates = self.study.estimation.candidates
        neutral = {name: value for one in candidates for name, value in zip(one.parameters, one.neutral.tolist(), strict=True)}
        return {**neutral, **self.fitted.by_name}

    def changes(self, shaped: Sequence[tuple[Candidate, FloatArray]], *, judged: bool = True) -> list[ChannelChange | None]:
        """Return what candidates with some values each do, none where a run is lost; not ``judged`` it is not said how clearly."""
        names = list(self.idle)
        rows = np.tile(np.array(list(self.idle.values())), (len(shaped), 1))
        for row, (candidate, values) in zip(rows, shaped, strict=True):
            row[[names.index(name) for name in candidate.parameters]] = values
        many = 48  # held in memory by one worker
        parts = [slice(first, first + many) for first in range(0, len(rows), many)]

        def some(part: slice) -> list[ChannelChange | None]:
            references = (self.long_steps, self.fitted.residual)
            runs = self.study.estimation.sensed.responses(names, rows[part], references, lambda difference: difference.copy())
            return [run if run is None else self._change(*one, run, judged) for one, run in zip(shaped[part], runs, strict=True)]

        return list(itertools.chain.from_iterable(together(some, parts)))

    def _change(self, candidate: Candidate, values: FloatArray, run: FloatArray, judged: bool) -> ChannelChange:
        """Return a change of the channels (channels, samples) that a candidate makes, judged as a diagnosis judges an effect."""
        method = self.study.method
        if not judged:
            return ChannelChange(candidate, values, run, self.taken.left(run, self.fitted.noise))
        without = self._without(run)
        left = without.residual - self.fitted.residual
        gained = gain(self.fitted, without, full_band=is_full_band((candidate,)))
        needed = self.study.least_share / (1.0 - self.study.least_share)
        share = gained.share / max(1.0 - gained.share, 1e-12) / needed if needed else math.inf
        enough = gained.nats / chance_level(gained, method, len(candidate.parameters))
        above = max(0.0, min(enough, share, self._moves(left)))
        return ChannelChange(candidate, values, run, left, gained, above if self._is_of_a_clock(candidate, values) else 0.0)

    def _without(self, run: FloatArray) -> Fitted:
        """Return the fit of a model that lacks a change of the channels, with the noise taken anew in each round, as in a fit.

        What is left of the change passes for noise: a channel that is off by far says little about the values, and the others hold them.
        Values that are further off than the lesson holds possible are freed where they leave less, as by a diagnosis.
        """
        residual, noise = self.fitted.residual + run, self.fitted.noise
        for _ in range(3):
            noise = self._noise_of(residual)
            residual = self.fitted.residual + self.taken.left(run, noise)
        amounts = self.taken.amounts(run, self.fitted.noise)
        if np.max(np.abs(amounts) * self.taken.held, initial=0.0) > IMPLAUSIBLE:
            freed = self.fitted.residual + run - np.tensordot(amounts, self.taken.slopes, axes=1)
            both = [(residual, noise), (freed, self._noise_of(freed))]
            residual, noise = max(both, key=lambda one: log_likelihood(*one, full_band=False))
        return replace(self.fitted, residual=residual, noise=noise)

    def _noise_of(self, residual: FloatArray) -> tuple[NoiseModel, ...]:
        """Return the noise of a residual; that of the fit where a channel is as it was."""
        shapes = self.study.estimation.sensed.noise_shapes(self.fitted.by_name)
        changed = [not np.array_equal(one, other) for one, other in zip(residual, self.fitted.residual, strict=True)]
        found = zip(residual, shapes, self.fitted.noise, changed, strict=True)
        return tuple(fit_noise_model(row, shape) if anew else noise for row, shape, noise, anew in found)

    def as_recorded(self, run: FloatArray) -> FloatArray:
        """Return a change of the channels as they are judged as one of the channels as they are recorded, (channels, samples)."""
        sensed, found = self.study.estimation.sensed, run.copy()
        for sight in sensed.redundant_sensors:
            found[sight.row] += sight.expected(run[sight.first], sensed.period)
        return found

    def _is_of_a_clock(self, candidate: Candidate, values: FloatArray) -> bool:
        experiment = self.study.estimation
        period = experiment.machine.assembly.sample_period
        by_name = dict(zip(candidate.parameters, values.tolist(), strict=True))
        return is_of_a_clock(candidate, by_name, period, period * len(experiment.record), method=self.study.method)

    def _moves(self, left: FloatArray) -> float:
        """Return how far a change is above the noise of a reading and, where that shows a force, above errors of laws; as squares.

        A reading that drifts with any value of the model, as a place does that is simulated from a force, differs by more than its noise
        between any two fits: only the force counts.
        """
        experiment, found = self.study.estimation, []
        for row, (floor, noise) in enumerate(zip(experiment.sensed.seen_floors, self.fitted.noise, strict=True)):
            force = lacking(experiment, replace(self.fitted, residual=left), row)
            ratios = [] if force.is_force and noise.differences else [root_mean_square(left[row]) / floor]
            ratios += [root_mean_square(force.values) / max(float(self.least[row]), 1e-300)] if force.is_force else []
            found.append(min(ratios))
        return min(float(max(found)), BEYOND) ** 2


@dataclass(eq=False)
class Visible:
    """A shape of an effect as it is looked for: factors on its usual sizes that were tried, with what each does."""

    shape: Shape
    smallest: float
    largest: float
    least: ClassVar[float] = 0.01
    """Ratio below which it is so far from being seen that how far does not matter."""
    tried: dict[float, ChannelChange] = field(default_factory=dict)

    @property
    def next(self) -> float:
        """The factor at which it begins to be seen, as far as is known: between two that were tried in proportion, log over log."""
        unseen = [factor for factor, change in self.tried.items() if change.above < 1.0]
        seen = [factor for factor, change in self.tried.items() if change.above >= 1.0]
        if not self.tried:
            return max(1.0, self.smallest)
        near: float = min(seen) if seen else max(unseen)
        above = max(self.tried[near].above, self.least)
        found = near / math.sqrt(above)
        if seen and (below := [factor for factor in unseen if factor < near]):
            low = max(below)
            rise = math.log(above / max(self.tried[low].above, self.least)) / math.log(near / low)
            # a ratio that jumps is halved between
            found = min(max(near / above ** (1.0 / rise), low * (near / low) ** 0.1), near / (near / low) ** 0.1)
        return float(min(max(found, self.smallest), self.largest))

    @property
    def is_known(self) -> bool:
        """Whether the next factor is one that was tried, but for a tenth."""
        precision = 0.1
        return any(abs(math.log(self.next / factor)) < precision for factor in self.tried) or self.largest <= self.smallest

    @property
    def factor(self) -> float:
        """The factor from which on it is seen; infinite where it is not, even at the largest size that is believed."""
        return self.next if self.next < self.largest or any(change.above >= 1.0 for change in self.tried.values()) else math.inf

    @property
    def nearest(self) -> ChannelChange | None:
        """What was tried nearest to where it begins to be seen."""
        return self.tried[min(self.tried, key=lambda factor: abs(math.log(factor / self.next)))] if self.tried else None


def unseen(looking: Looking, shaped: Sequence[Shape]) -> list[Visible]:
    """Return the shapes that are not seen even at the largest size that is believed."""
    found = [Visible(shape, *_factors(shape, looking.study)) for shape in shaped]
    changes = looking.changes([(one.shape.candidate, one.shape.grown(one.largest)) for one in found])
    for one, change in zip(found, changes, strict=True):
        one.tried |= {} if change is None else {one.largest: change}
    return [one for one in found if any(change.above < 1.0 for change in one.tried.values())]


def smallest_visible(looking: Looking, shaped: Sequence[Shape]) -> list[Visible]:
    """Return from which factor on each shape is seen."""
    found = [Visible(shape, *_factors(shape, looking.study)) for shape in shaped]
    for _ in range(5):
        unknown = [one for one in found if not one.is_known]
        tried = [one.next for one in unknown]
        changes = looking.changes([(one.shape.candidate, one.shape.grown(factor)) for one, factor in zip(unknown, tried, strict=True)])
        for one, factor, change in zip(unknown, tried, changes, strict=True):
            if change is None:
                one.largest = 0.5 * factor
            else:
                one.tried[factor] = change
    return found


def _factors(shape: Shape, study: Study) -> tuple[float, float]:
    """Return the smallest and the largest factor on the sizes of a shape that are tried."""
    if bool(np.any(is_limit(shape.candidate))):
        return 1.0, 30.0
    place = shape.candidate.parameters.index(shape.size)
    usual = abs(float(shape.point[place] - shape.candidate.neutral[place]))
    smallest = 1e-4
    if shape.size == f"{shape.candidate.part}.{shape.candidate.effect.identification.whole_samples}":
        # a replay knows no shorter delay than a sample
        smallest = max(smallest, study.estimation.machine.assembly.sample_period / usual)
    return smallest, max(study.method.sizes.largest, study.possible.get(shape.size, 0.0) / usual)
