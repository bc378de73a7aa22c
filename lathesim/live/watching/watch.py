"""The watch: residuals block by block, what is usual learnt first, and a change or a drift told with its time and place.

The statistics of a block are the mean residual of each channel while the first driven axis moves backwards, stands and moves forwards, and
the logarithm of its mean square. Uncertain values follow slowly, within what the lesson allows: warm-up and another load are no alarm.
Memory does not depend on the length of the stream.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from lathesim.live.sources.sample_clock import Stretch
from lathesim.live.watching.block_sums import STATES, BlockSums, block_sums, features, fitted
from lathesim.live.watching.cusum import Cusum
from lathesim.live.watching.residual_stream import ResidualStream
from lathesim.record import FloatArray

SETTLE = 2.0
"""Seconds after a restart that are not judged: the simulation has to get to where the machine is."""
_KEPT = 300
"""Blocks that the uncertain values follow."""
_BEHIND = 50
"""Newest blocks that they do not follow yet: a change is to be seen before it is taken for another value."""
_REFIT = 10
_SHIFT = 0.5
"""k of the CUSUM [standard deviations]: half of the smallest shift that is worth telling."""
_LEAST_LIMIT = 15.0
"""h at least: with k = 0.5 and independent blocks a false alarm in 1e7 blocks."""
_OVER_LEARNT = 2.5
"""h is this many times the largest sum while learning, where blocks depend on one another."""
_LARGEST = 5.0
"""Standard deviations that one block counts at most: no single block makes an alarm."""
_TOGETHER = 20.0
"""Samples that tell something of their own together: residuals are correlated."""
_ABSORBED = 1.0
"""Mean of the statistics up to which other values of the uncertain parameters explain a change."""
_LEAST_FLOOR = 0.02
"""Floor of a channel at least, in what a standard deviation of an uncertain value does there: the model is no better than that."""
_LINEAR = 0.1
"""Share of what an uncertain value does that its sensitivity may be wrong by: the lesson's machine is not linear."""
_BY_CHANCE = 2.0
"""Standard errors of that mean that are allowed besides."""
_LARGEST_VALUE = 3.0
"""Standard deviations up to which an uncertain value may be off."""
_SLOW = 15.0
"""Seconds from the beginning to the alarm from which on it is a drift."""


@dataclass(frozen=True)
class Alarm:
    """A change that was told: ``time`` [s] it was told, ``begun`` [s] since when, the ``channel``, in which ``state``, whether it is a
    ``drift``, and how many usual deviations (``size``) it measures."""

    time: float
    begun: float
    channel: str
    state: str
    drift: bool
    size: float

    @property
    def kind(self) -> str:
        """Return ``drift`` or ``change``."""
        return "drift" if self.drift else "change"


@dataclass(frozen=True, eq=False)
class _Usual:
    """What was learnt: noise floor and weight of each channel, mean and deviation of each statistic, the limit of its sum."""

    noise: FloatArray
    weight: FloatArray
    mean: FloatArray
    deviation: FloatArray


class Watch:
    """Watches the residuals of one machine. ``take`` gets whole stretches of samples and returns the alarms they bring.

    ``learn`` [s] is how long what is usual is learnt, ``block`` [s] the length of a block.
    """

    def __init__(self, residuals: ResidualStream, period: float, *, learn: float = 60.0, block: float = 0.2) -> None:
        self.residuals = residuals
        self.period = period
        self.size = max(4, round(block / period))
        self._to_learn = max(20, round(learn / (self.size * period)))
        self._waiting: FloatArray = np.zeros((len(residuals.drive) + len(residuals.compare), 0))
        self._time = 0.0
        self._settled_at = -np.inf
        self._learning: list[BlockSums] = []
        self._blocks: deque[BlockSums] = deque(maxlen=_KEPT)
        self._usual: _Usual | None = None
        self._cusum: Cusum | None = None
        self._theta = np.zeros(len(residuals.parameters))
        self._since_fit = 0
        self._suspected = np.nan
        self._still = 0.0
        self._frozen = False
        self.blocks = 0
        self.absorbed: list[tuple[float, str]] = []

    @property
    def learnt(self) -> bool:
        """Return whether what is usual is known."""
        return self._usual is not None

    @property
    def values(self) -> dict[str, float]:
        """Return how far each uncertain value is from the lesson's, in its standard deviations."""
        return dict(zip(self.residuals.parameters, self._theta.tolist(), strict=True))

    def level(self, channel: str) -> float | None:
        """Return the root mean square of a channel's newest residual, the uncertain values taken off; None before there is one."""
        if not self._blocks:
            return None
        none = np.zeros(len(self.residuals.compare))
        return float(np.exp(0.5 * features(self._blocks[-1], self._theta, none)[self.residuals.compare.index(channel), -1]))

    def take(self, stretch: Stretch) -> list[Alarm]:
        """Return the alarms of a stretch."""
        if stretch.fresh:
            self.residuals.restart()
            self._waiting = self._waiting[:, :0]
            self._settled_at = stretch.begin + SETTLE
        if not self._waiting.shape[1]:
            self._time = stretch.begin
        values = np.concatenate([self._waiting, stretch.values], axis=1)
        whole = values.shape[1] // self.size * self.size
        self._waiting = values[:, whole:].copy()
        alarms = []
        for begin in range(0, whole, self.size):
            alarm = self._block(values[:, begin : begin + self.size])
            if alarm is not None:
                alarms.append(alarm)
        return alarms

    def _block(self, values: FloatArray) -> Alarm | None:
        residual = self.residuals.take(values)
        self._time += self.size * self.period
        self._still = max(self._still, 1e-3 * float(np.abs(residual.speed).max()))
        if self._time < self._settled_at or not np.isfinite(residual.values).all():
            return None
        block = block_sums(residual, self._time, self._still)
        self.blocks += 1
        self._blocks.append(block)
        if self._usual is None:
            self._learning.append(block)
            if len(self._learning) >= self._to_learn:
                self._learn()
            return None
        self._follow()
        return self._judge(block)

    def _learn(self) -> None:
        """Find what is usual from the first blocks."""
        blocks, self._learning = self._learning, []
        count = np.array([block.count.sum() for block in blocks])
        noise = np.sqrt(np.maximum(np.median([block.square for block in blocks] / count[:, None], axis=0), 1e-30))
        allowed = np.mean([np.einsum("cpp->cp", block.normal) / block.count.sum() for block in blocks], axis=0)
        least = _LEAST_FLOOR * np.sqrt(allowed.max(axis=1, initial=0.0))
        noise = np.maximum(noise, least)
        for _ in range(3):
            weight = 1.0 / (_TOGETHER * noise**2)
            self._theta = self._theta if self._frozen else fitted(blocks, weight)
            rest = np.array([np.exp(features(block, self._theta, 0.0 * noise)[:, -1]) for block in blocks])
            noise = np.maximum(np.sqrt(np.maximum(np.median(rest, axis=0), 1e-30)), least)
        table = np.array([features(block, self._theta, noise) for block in blocks])
        mean, deviation = _mean_and_deviation(table, noise, np.sqrt(min(1.0, _TOGETHER / self.size)))
        self._usual = _Usual(noise, 1.0 / (_TOGETHER * noise**2), mean, deviation)
        trial = Cusum(mean.shape, _SHIFT, np.full(mean.shape, np.inf))
        largest = np.zeros(mean.shape)
        for row in table:
            trial.take(np.clip((row - mean) / deviation, -_LARGEST, _LARGEST), 0.0)
            largest = np.maximum(largest, trial.sums.max(axis=0))
        self._cusum = Cusum(mean.shape, _SHIFT, np.maximum(_LEAST_LIMIT, _OVER_LEARNT * largest))

    def _follow(self) -> None:
        """Let the uncertain values follow the older blocks."""
        self._since_fit += 1
        if self._frozen:
            return
        if self._since_fit >= _REFIT and len(self._blocks) > 2 * _BEHIND and self._usual is not None:
            self._since_fit = 0
            theta = fitted(list(self._blocks)[:-_BEHIND], self._usual.weight)
            self._theta = np.clip(theta, -_LARGEST_VALUE, _LARGEST_VALUE)

    def _scores(self, block: BlockSums, theta: FloatArray) -> FloatArray:
        assert self._usual is not None
        raw = (features(block, theta, self._usual.noise) - self._usual.mean) / self._usual.deviation
        return np.clip(raw, -_LARGEST, _LARGEST)

    def _judge(self, block: BlockSums) -> Alarm | None:
        assert self._cusum is not None
        above = self._cusum.take(self._scores(block, self._theta), block.time - self.size * self.period)
        if not (above > 0.0).any():
            return None
        side, channel, statistic = (int(place) for place in np.unravel_index(np.argmax(above), above.shape))
        begun = float(self._cusum.begun[side, channel, statistic])
        since = [item for item in self._blocks if item.time > begun + 0.5 * self.size * self.period]
        if self._explained(since):
            return None
        drift = block.time - begun > _SLOW
        begun = begun if drift else self._change_point(since, channel, statistic, begun)
        if np.isfinite(self._suspected) and block.time - self._suspected < 60.0:
            begun = min(begun, self._suspected)
        self._suspected = np.nan
        size = float(self._cusum.sums[side, channel, statistic]) / max(1, len(since)) + _SHIFT
        state = STATES[statistic] if statistic < len(STATES) else "at all times"
        told = Alarm(block.time, begun, self.residuals.compare[channel], state, drift, size)
        self.relearn()
        return told

    def _change_point(self, since: list[BlockSums], channel: int, statistic: int, begun: float) -> float:
        """Return when the statistic changed [s]: where splitting what followed from what was before is likeliest."""
        scores = np.array([self._scores(block, self._theta)[channel, statistic] for block in since])
        known = np.flatnonzero(np.isfinite(scores))
        if not len(known):
            return begun
        sums = np.cumsum(scores[known][::-1])[::-1]
        best = known[int(np.argmax(sums**2 / np.arange(len(known), 0, -1)))]
        return float(since[best].time - self.size * self.period)

    def _explained(self, since: list[BlockSums]) -> bool:
        """Return whether other values of the uncertain parameters, within what the lesson allows, explain what changed."""
        assert self._usual is not None
        assert self._cusum is not None
        if self._frozen:
            return False
        theta = fitted(since, self._usual.weight)
        if np.abs(theta).max(initial=0.0) > _LARGEST_VALUE or not len(theta):
            return False
        scores = np.array([self._left_over(block, theta) for block in since])
        known = np.isfinite(scores)
        seen = known.sum(axis=0)
        means = np.where(known, scores, 0.0).sum(axis=0) / np.maximum(1, seen)
        # the mean of a few blocks deviates by chance
        allowed = _ABSORBED + _BY_CHANCE / np.sqrt(np.maximum(1, seen))
        if np.any((means > allowed) & (seen >= 3)):
            return False
        moved = self.residuals.parameters[int(np.argmax(np.abs(theta - self._theta)))]
        if len(self.absorbed) < 1000:
            self.absorbed.append((since[-1].time, moved))
        self._suspected = since[0].time
        self._theta = theta
        while self._blocks and self._blocks[0].time < since[0].time:
            self._blocks.popleft()
        self._cusum.reset()
        return True

    def _left_over(self, block: BlockSums, theta: FloatArray) -> FloatArray:
        """Return by how many usual deviations the means of a block are off, beyond what the sensitivities may be wrong by themselves."""
        assert self._usual is not None
        states = len(STATES)
        with np.errstate(invalid="ignore", divide="ignore"):
            effect = np.abs(block.slope @ theta) / block.count
        off = np.abs(features(block, theta, self._usual.noise)[:, :states] - self._usual.mean[:, :states])
        beyond = np.maximum(0.0, off - _LINEAR * effect) / self._usual.deviation[:, :states]
        return np.minimum(beyond, _LARGEST)

    def relearn(self) -> None:
        """Learn anew what is usual: after an alarm the machine is another.

        The uncertain values stay where they are: what the lesson leaves out now would be taken for them.
        """
        self._frozen = True
        self._usual, self._cusum = None, None
        self._learning, self._suspected = [], np.nan
        self._blocks.clear()


def _mean_and_deviation(table: FloatArray, noise: FloatArray, share: float) -> tuple[FloatArray, FloatArray]:
    """Return mean and deviation of each statistic; one that was hardly seen has an infinite deviation and says nothing.

    A mean deviates by ``share`` of the noise at least: that of the samples of a block that depend on one another.
    """
    known = np.isfinite(table)
    seen = known.sum(axis=0)
    mean = np.where(known, table, 0.0).sum(axis=0) / np.maximum(1, seen)
    square = np.where(known, (table - mean) ** 2, 0.0).sum(axis=0) / np.maximum(1, seen - 1)
    least = np.column_stack([np.repeat(share * noise[:, None], table.shape[2] - 1, axis=1), np.full(len(noise), 0.05)])
    deviation = np.maximum(np.sqrt(square), least) * (1.0 + 1.0 / np.sqrt(np.maximum(1, seen)))
    return mean, np.where(seen >= 5, deviation, np.inf)
