"""The watch: residuals block by block, what is usual learnt first, and a change or a drift told with its time and place.

Two tests look for what lasts. :class:`ChangeTest` looks for a change in a direction that the uncertain values cannot go: a load that steps
or a machine that warms up is no alarm. A CUSUM looks at the logarithm of the noise that is left in each block: chatter, ripple, a worn
bearing. Memory does not depend on the length of the stream.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from lathesim.live.sample_clock import Stretch
from lathesim.live.watching.change_test import ChangeTest, FoundChange
from lathesim.live.watching.noise_test import NoiseTest, others_noise
from lathesim.live.watching.residual_stream import LIKE, Residual, ResidualStream, averaged, averaged_others, direction_names
from lathesim.live.watching.thresholds import CHANGE, FOLLOWING
from lathesim.live.watching.usual import Usual, learn
from lathesim.live.watching.value_course import CoursePoint, Expected, ValueCourse, expected_values
from lathesim.record import FloatArray

SETTLE = 2.0
"""Seconds after a restart that are not judged: the simulation has to get to where the machine is."""
_BETWEEN = 5.0
"""Seconds between two notes of the uncertain values."""
_REMEMBERED = 120
"""Notes of the uncertain values that are kept: of ten minutes."""
_GETTING_THERE = 0.5
"""Seconds that the simulation needs to get to where it would be with other values."""
_NOISE = "in its noise"


@dataclass(frozen=True)
class ReportedChange:
    """A change that was told: ``time`` [s] it was told, ``begun`` [s] since when, the ``channel``, in which ``state``, whether it is a
    ``drift``, and how many usual deviations of a block (``size``) it measures."""

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


@dataclass(frozen=True)
class Moved:
    """A step of a value that may move: the ``parameter`` went from ``before`` to ``after`` [scales from the lesson's], ``begun`` [s]."""

    time: float
    begun: float
    parameter: str
    before: float
    after: float


class Watch:
    """Watches the residuals of one machine. ``take`` gets whole stretches of samples and returns the alarms they bring.

    ``learn`` [s] is how long what is usual is learnt, ``block`` [s] the length of a block; ``plain`` is the machine without the changes
    that ``residuals`` follow, against which a :class:`Point` tells what they do.
    """

    def __init__(
        self, residuals: ResidualStream, period: float, *, learn: float = 60.0, block: float = 0.2, plain: ResidualStream | None = None
    ) -> None:
        self.residuals, self._plain = residuals, plain
        self.period = period
        self.size = max(4, round(block / period))
        self._block_time = self.size * period
        self._like = max(1, min(round(LIKE / period), self.size // 20))
        self._to_learn = max(20, round(learn / self._block_time))
        self._waiting: FloatArray = np.zeros((len(residuals.drive) + len(residuals.compare), 0))
        self._time = 0.0
        self._settled_at = -np.inf
        self._learning: list[tuple[float, Residual, FloatArray]] = []
        self._others: list[list[tuple[FloatArray, FloatArray]]] = []
        self._usual: Usual | None = None
        self._test: ChangeTest | None = None
        self._noise: NoiseTest | None = None
        self._limit = self._step_limit = float(CHANGE.least_ratio)
        self._centred = not residuals.parameters
        self._theta = np.zeros(len(residuals.parameters))
        self._unsettled = -np.inf
        self._seen_since = np.inf
        self._excess = np.zeros(len(residuals.compare))
        self._sensitive = np.zeros((len(residuals.parameters), len(residuals.compare)))
        self._base: FloatArray | None = None
        self._before: deque[tuple[float, FloatArray]] = deque(maxlen=_REMEMBERED)
        self._held: FloatArray | None = None
        self._sound: list[tuple[float, FloatArray]] = []
        self._first_sound: list[tuple[float, FloatArray]] = []
        self._reference: Usual | None = None
        self._course: ValueCourse | None = None
        self._reference_values: dict[str, float] = {}
        self._new = np.zeros(len(residuals.parameters))
        self.points: deque[CoursePoint] = deque(maxlen=_REMEMBERED)
        self._paused = False
        self._names = direction_names(residuals.drive)
        self.blocks = 0
        self.moved: deque[Moved] = deque(maxlen=_REMEMBERED)
        self._chain = _Chain()

    @property
    def learnt(self) -> bool:
        """Return whether what is usual is known."""
        return self._usual is not None

    @property
    def paused(self) -> bool:
        """Return whether nothing is judged, as a verdict is due."""
        return self._paused

    @property
    def values(self) -> dict[str, float]:
        """Return how far each value that may move is from the lesson's, in its scale: for an uncertain value its standard deviation."""
        return dict(zip(self.residuals.parameters, self._theta.tolist(), strict=True))

    def expected(self, time: float) -> dict[str, tuple[float, float]]:
        """Return each uncertain value that is expected at a time [s] from the laps before the last alarm, with its standard deviation.

        Both are in the value's scale, the value from the lesson's. It is empty where nothing was noted before.
        """
        found = _expected(self._sound, time)
        if found is None:
            return {}
        rows = zip(self.residuals.parameters, found.values.tolist(), found.deviations.tolist(), self.residuals.free, strict=True)
        return {name: (value, deviation) for name, value, deviation, free in rows if not free}

    def excess(self, channel: str) -> float:
        """Return by how much the mean square of a channel's newest residual is above that of the first laps.

        The uncertain values that held before the last alarm are taken off.
        """
        return float(self._excess[self.residuals.compare.index(channel)])

    def excess_by_values(self, channel: str) -> float:
        """Return the mean square of what the uncertain values may do to a channel, moving since the first alarm as before it."""
        found = _expected(self._first_sound, self._time)
        deviations = np.ones(len(self._sensitive)) if found is None else found.deviations
        return float(np.square(deviations) @ self._sensitive[:, self.residuals.compare.index(channel)])

    def take(self, stretch: Stretch) -> list[ReportedChange]:
        """Return the alarms of a stretch."""
        if stretch.fresh:
            self.residuals.restart()
            if self._plain is not None:
                self._plain.restart()
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

    def _block(self, values: FloatArray) -> ReportedChange | None:
        residual = self.residuals.take(values)
        plain = None if self._plain is None else self._plain.take(values)
        self._time += self._block_time
        if self._time < self._settled_at or not np.isfinite(residual.values).all():
            return None
        self.blocks += 1
        mean, quick = averaged(residual, self._like)
        self._measure(mean, quick)
        if self._paused:
            return None
        if self._course is not None:
            difference = None if plain is None else mean.simulated - averaged(plain, self._like)[0].simulated
            point = self._course.take(mean, quick, self.residuals.nominal, difference, self._time)
            if point is not None:
                self.points.append(point)
                self._resize(point)
        if self._usual is None:
            self._learning.append((self._time, mean, quick))
            self._others.append(averaged_others(residual, self._like))
            if len(self._learning) >= (self._to_learn if self._centred else self._to_learn // 3):
                self._learn()
            return None
        return self._judge(mean, quick)

    def _resize(self, point: CoursePoint) -> None:
        """Go on with the sizes of known effects as a whole segment shows them; no shorter time tells them surely enough."""
        sure = np.abs(point.values - self.residuals.nominal) > FOLLOWING.telling * point.deviations
        if (self.residuals.free & sure).any():
            self._theta = np.where(self.residuals.free, point.values, self.residuals.nominal)
            self._move()

    def _measure(self, mean: Residual, quick: FloatArray) -> None:
        """Take down how far the machine is from what the first laps showed, and which values held when."""
        if self._base is None:
            return
        theta = self._theta if self._held is None else self._held
        self._excess = _mean_square(mean, quick, theta - self.residuals.nominal) - self._base
        self._sensitive = np.mean(mean.sensitivities**2, axis=2)
        if not self._before or self._time - self._before[-1][0] >= _BETWEEN:
            self._before.append((self._time, self._theta.copy()))

    def _new_course(self, usual: Usual) -> ValueCourse:
        """Return the course of the values from now on, against what was ``usual`` in the first laps."""
        centre = np.array([self._reference_values.get(name, 0.0) for name in self.residuals.parameters])
        return ValueCourse(usual, self.residuals.free, centre, self._new, self._block_time)

    def _learn(self) -> None:
        """Find what is usual from the first blocks, and how large the statistics get without a change."""
        times = np.array([time for time, _, _ in self._learning])
        residuals, quick, others = [item for _, item, _ in self._learning], [item for _, _, item in self._learning], self._others
        usual, blocks = learn(residuals, quick, times, np.where(self.residuals.free, 0.0, -self.residuals.nominal))
        if not self._centred:
            self._centred = True
            self._theta = self.residuals.nominal + usual.theta
            if np.abs(usual.theta).max(initial=0.0) > FOLLOWING.far:
                self._learning, self._others = [], []
                self._move()
            return
        self._learning, self._others = [], []
        self._usual, self._theta = usual, self.residuals.nominal + usual.theta
        self._noise = NoiseTest(np.array([block.left for block in blocks]), others_noise(usual, residuals, others), self._block_time)
        self._test = ChangeTest(usual, self._block_time, self.size // self._like, self.residuals.nominal, self.residuals.free)
        if self._base is None:
            self._base = np.mean([_mean_square(item, fast, usual.theta) for item, fast in zip(residuals, quick, strict=True)], axis=0)
        if self._reference is None:
            self._reference = usual
            self._reference_values = self.values
            self._course = self._new_course(usual)
        largest, moved = 0.0, 0.0
        for number, block in enumerate(blocks):
            self._test.take(block)
            found = self._test.test() if number % 3 == 0 else None
            if found is not None:
                largest, moved = max(largest, found.statistic), max(moved, found.moved)
        self._limit = max(CHANGE.least_ratio, CHANGE.over_learnt * largest)
        self._step_limit = max(CHANGE.least_ratio, CHANGE.over_learnt * moved)

    def _move(self) -> None:
        """Go on with the simulation at the uncertain values that were found; until it has got there nothing is judged."""
        by = self.residuals.move(self._theta)
        if self._plain is not None:
            self._plain.follow(self.residuals)
        if self._test is not None:
            self._test.move(by)
        if np.any(by):
            self._settled_at = self._time + _GETTING_THERE

    def _judge(self, residual: Residual, quick: FloatArray) -> ReportedChange | None:
        assert self._usual is not None
        assert self._test is not None
        assert self._noise is not None
        block = self._usual.sums(residual, quick, self._time)
        self._test.take(block)
        found = self._test.test()
        if found is not None and found.moved > self._step_limit:
            self._unsettled = self._time + FOLLOWING.believed * self._block_time
        noisy = self._noise.take(block.left if self._time > self._unsettled else np.full(len(block.left), np.nan), self._time)
        if found is not None and found.statistic > self._limit:
            return self._changed(found)
        if noisy is not None:
            channel, begun, size = noisy
            return self._told(channel % len(self.residuals.compare), begun, _NOISE, self._time - begun > CHANGE.slow, size)
        if found is not None and found.statistic < 0.5 * self._limit:
            self._follow(found)
        return None

    def _follow(self, found: FoundChange) -> None:
        """Take the uncertain values that explain the newest blocks; what was before their last step is not looked at any more."""
        assert self._test is not None
        stepped = found.moved > self._step_limit
        self._seen_since = min(self._seen_since, self._time - self._block_time) if stepped else np.inf
        if stepped and self._time - max(found.moved_at, self._seen_since) < FOLLOWING.believed * self._block_time:
            return
        self._seen_since = np.inf
        before, self._theta = self._theta, self.residuals.nominal + found.theta
        if stepped:
            moved = np.abs(self._theta - before)
            likeliest = int(np.argmax(moved / found.deviations)) if len(moved) else 0
            if moved.max(initial=0.0) > FOLLOWING.far:
                name = self.residuals.parameters[likeliest]
                self.moved.append(Moved(self._time, found.moved_at, name, float(before[likeliest]), float(self._theta[likeliest])))
            self._chain.take(found.moved_at)
            self._test.forget_before(found.moved_at)
        if np.abs(found.theta[~self.residuals.free]).max(initial=0.0) > FOLLOWING.far and found.power > FOLLOWING.power:
            self._theta[self.residuals.free] = self.residuals.nominal[self.residuals.free]
            self._move()
            self._test.forget_before(self._time)

    def _changed(self, found: FoundChange) -> ReportedChange:
        begun = self._chain.begun(found.begun)
        return self._told(found.channel, begun, self._names[found.direction], self._time - begun > CHANGE.slow, found.size)

    def _told(self, channel: int, begun: float, state: str, drift: bool, size: float) -> ReportedChange:
        told = ReportedChange(self._time, begun, self.residuals.compare[channel], state, drift, size)
        self._sound = self._sound or [(time, theta) for time, theta in self._before if time <= begun - _BETWEEN]
        if self._held is None:
            self._first_sound = self._sound
            self._held = self._sound[-1][1] if self._sound else self._theta.copy()
        self._course = None
        self.relearn()
        return told

    def relearn(self) -> None:
        """Learn anew what is usual: after an alarm the machine is another."""
        self._usual, self._test, self._noise = None, None, None
        self._learning, self._others, self._centred = [], [], not self.residuals.parameters

    def pause(self) -> None:
        """Judge and learn nothing until :meth:`go_on`: what changed is not known yet."""
        self._paused = True

    def go_on(
        self, residuals: ResidualStream | None = None, plain: ResidualStream | None = None, new: FloatArray | None = None, *,
        as_changed: bool = False,
    ) -> None:  # fmt: skip
        """Go on from the changed state: with the ``residuals`` of a model that holds what changed, or of the same model.

        What is usual is learnt anew. The values are followed against what the machine showed before, or, where it is taken
        ``as_changed``, against what is learnt next. ``new`` (parameters,) is how large followed effects are [scales] that are new.
        """
        self._paused = False
        self._new = self._new if new is None else new
        if as_changed:
            self._reference, self._sound = None, []
            self._before.clear()
        if residuals is not None:
            self.residuals, self._plain = residuals, plain
            self._theta = np.zeros(len(residuals.parameters))
            self._before.clear()
            self._held, self._base, self._sound = None, None, []
            self._excess = np.zeros(len(residuals.compare))
            self._sensitive = np.zeros((len(residuals.parameters), len(residuals.compare)))
            self._settled_at = max(self._settled_at, self._time + SETTLE)
        if self._reference is not None:
            self._course = self._new_course(self._reference)
        self.relearn()


def _expected(notes: list[tuple[float, FloatArray]], time: float) -> Expected | None:
    """Return the values expected at a time [s] from notes of them; None where there are none."""
    if not notes:
        return None
    return expected_values(np.array([at for at, _ in notes]), np.array([theta for _, theta in notes]), time)


def _mean_square(mean: Residual, quick: FloatArray, theta: FloatArray) -> FloatArray:
    """Return the mean square of each channel of a block with the values ``theta`` from the nominal ones, (channels,)."""
    left = mean.values - np.einsum("p,pcn->cn", theta, mean.sensitivities)
    return np.asarray(np.mean(left**2, axis=1) + quick)


class _Chain:
    """Steps of the uncertain values that followed one another closely: what at first was taken for them may be what is told then."""

    def __init__(self) -> None:
        self._first, self._last = np.nan, -np.inf

    def take(self, time: float) -> None:
        """Take a step at a time [s]."""
        if time - self._last > CHANGE.linked:
            self._first = time
        self._last = time

    def begun(self, time: float) -> float:
        """Return when it began [s], where a change was found since ``time``."""
        return min(self._first, time) if time - self._last <= CHANGE.linked else time
