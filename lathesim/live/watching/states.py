"""The states of a watch: it learns what is usual, judges what comes, or is paused; and what it remembers from one to the next.

Each state is frozen, and ``after(block)`` returns the next one with the events of the block. A state holds what is valid in it and nothing
else: only one that judges has tests and their limits. The tests and the course of the values add up blocks; nothing but the state that
holds them does so.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lathesim.live.watching.change_test import ChangeTest, FoundChange, NoiseTest, others_noise
from lathesim.live.watching.residual_stream import BlockSums, Residual, direction_names
from lathesim.live.watching.thresholds import CHANGE, FOLLOWING
from lathesim.live.watching.usual import CoursePoint, Expected, Usual, ValueCourse, expected_values, learn
from lathesim.record import FloatArray

BETWEEN = 5.0
"""Seconds between two notes of the uncertain values."""
REMEMBERED = 120
"""Notes of the uncertain values that are kept: of ten minutes."""
_NOISE = "in its noise"
_OFTEN = 3
"""Blocks between two looks at how large the statistics get without a change."""
_FIRST = 3
"""Share of the blocks to learn, 1 / 3, after which the uncertain values are found a first time."""


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


@dataclass(frozen=True, eq=False)
class GoOn:
    """The simulation is to go on with its values at ``theta`` (parameters,) [scales from the lesson's]."""

    theta: FloatArray


Event = ReportedChange | Moved | CoursePoint | GoOn


@dataclass(frozen=True)
class WatchedChannels:
    """What is watched and how: the names of the values that may move, which of them are ``free``, of the compared channels and of the
    directions; seconds of a block, samples that are averaged in one and their number, and how many blocks are learnt."""

    parameters: tuple[str, ...]
    free: NDArray[np.bool_]
    compare: tuple[str, ...]
    drive: tuple[str, ...]
    block_time: float
    averages: int
    to_learn: int


@dataclass(frozen=True, eq=False)
class WatchedBlock:
    """A block that ends at ``time`` [s]: ``mean`` residuals and the ``quick`` rest of the channels, the same of the machines with other
    values, and the ``nominal`` values that were simulated."""

    time: float
    mean: Residual
    quick: FloatArray
    others: list[tuple[FloatArray, FloatArray]]
    nominal: FloatArray


@dataclass(frozen=True)
class Steps:
    """Steps of the uncertain values that followed one another closely: the ``first`` and the ``last`` [s], and since when the one that is
    not believed yet is ``seen``. What was taken for them may be what is told then."""

    first: float = np.nan
    last: float = -np.inf
    seen: float = np.inf

    def with_one(self, time: float) -> Steps:
        """Return them with a step at a time [s]."""
        return replace(self, first=time if time - self.last > CHANGE.linked else self.first, last=time)

    def begun(self, time: float) -> float:
        """Return when it began [s], where a change was found since ``time``."""
        return min(self.first, time) if time - self.last <= CHANGE.linked else time


@dataclass(frozen=True, eq=False)
class WatchMemory:
    """What a watch remembers in every state.

    ``theta`` (parameters,) are the values that may move as they are now; ``notes`` are those of the last minutes with their times [s].
    ``base`` (channels,) is the usual mean square of the first laps, ``excess`` by how much the newest block is above it, and ``sensitive``
    (parameters, channels) the mean square of what each value does. ``first`` is what was usual in the first laps, with the values found
    then, and ``course`` goes on from there until an alarm; ``new`` are the sizes that the lesson did not have at first.
    ``held`` are the values before the first alarm, ``sound`` the notes before the last one and ``first_sound`` those before the first.
    """

    theta: FloatArray
    new: FloatArray
    excess: FloatArray
    sensitive: FloatArray
    notes: tuple[tuple[float, FloatArray], ...] = ()
    base: FloatArray | None = None
    held: FloatArray | None = None
    sound: tuple[tuple[float, FloatArray], ...] = ()
    first_sound: tuple[tuple[float, FloatArray], ...] = ()
    first: tuple[Usual, Mapping[str, float]] | None = None
    course: ValueCourse | None = None
    steps: Steps = Steps()

    def measured(self, block: WatchedBlock) -> WatchMemory:
        """Return it with how far the machine is from what the first laps showed, and with which values hold now."""
        if self.base is None:
            return self
        theta = self.theta if self.held is None else self.held
        noted = not self.notes or block.time - self.notes[-1][0] >= BETWEEN
        return replace(
            self,
            excess=_mean_square(block.mean, block.quick, theta - block.nominal) - self.base,
            sensitive=np.mean(block.mean.sensitivities**2, axis=2),
            notes=(*self.notes, (block.time, self.theta))[-REMEMBERED:] if noted else self.notes,
        )

    def after_alarm(self, begun: float) -> WatchMemory:
        """Return it after an alarm about what began at a time [s]: what the values were before is kept, and their course ends."""
        sound = self.sound or tuple((time, theta) for time, theta in self.notes if time <= begun - BETWEEN)
        if self.held is not None:
            return replace(self, sound=sound, course=None)
        return replace(self, sound=sound, first_sound=sound, held=sound[-1][1] if sound else self.theta, course=None)

    def expected(self, time: float) -> Expected | None:
        """Return the values expected at a time [s] from those before the last alarm; None where none were noted."""
        return _expected(self.sound, time)

    def deviations(self, time: float) -> FloatArray:
        """Return how far the values may have moved since the first alarm [scales], (parameters,)."""
        found = _expected(self.first_sound, time)
        return np.ones(len(self.sensitive)) if found is None else found.deviations


@dataclass(frozen=True, eq=False)
class LearningState:
    """Learns what is usual: ``rows`` are the blocks so far, and ``centred`` says whether the simulation has the values of the machine."""

    watched: WatchedChannels
    memory: WatchMemory
    centred: bool
    rows: tuple[WatchedBlock, ...] = ()

    @classmethod
    def anew(cls, watched: WatchedChannels, memory: WatchMemory) -> LearningState:
        """Return the state in which nothing is usual yet: at first, and after an alarm, as the machine is another then."""
        return cls(watched, memory, centred=not watched.parameters)

    def moved(self, by: FloatArray) -> LearningState:
        """Return the state after the simulation went on with values that are ``by`` (parameters,) others."""
        return self

    def after(self, block: WatchedBlock) -> tuple[LearningState | JudgingState, list[Event]]:
        """Return the state after a block: once there are enough of them it judges."""
        rows, to_learn = (*self.rows, block), self.watched.to_learn
        if len(rows) < (to_learn if self.centred else to_learn // _FIRST):
            return replace(self, rows=rows), []
        lesson = np.where(self.watched.free, 0.0, -block.nominal)
        usual, sums = learn([row.mean for row in rows], [row.quick for row in rows], np.array([row.time for row in rows]), lesson)
        memory = replace(self.memory, theta=block.nominal + usual.theta)
        if self.centred:
            return JudgingState.begun(self.watched, memory, rows, usual, sums), []
        far = bool(np.abs(usual.theta).max(initial=0.0) > FOLLOWING.far)
        return LearningState(self.watched, memory, True, () if far else rows), [GoOn(memory.theta)] if far else []


@dataclass(frozen=True, eq=False)
class JudgingState:
    """Judges blocks against what is ``usual``, by a ``test`` for changes and one of the ``noise``.

    ``limit`` is what the statistic of a change must exceed, ``step_limit`` that of a step of the uncertain values; the noise is not judged
    before ``settled`` [s].
    """

    watched: WatchedChannels
    memory: WatchMemory
    usual: Usual
    test: ChangeTest
    noise: NoiseTest
    limit: float
    step_limit: float
    settled: float = -np.inf

    @classmethod
    def begun(
        cls, watched: WatchedChannels, memory: WatchMemory, rows: tuple[WatchedBlock, ...], usual: Usual, sums: Sequence[BlockSums]
    ) -> JudgingState:
        """Return the state after learning from ``rows`` what is ``usual``: limits are held above what the blocks themselves reach."""
        means, nominal = [row.mean for row in rows], rows[-1].nominal
        noise = NoiseTest(
            np.array([item.left for item in sums]), others_noise(usual, means, [row.others for row in rows]), watched.block_time
        )
        test = ChangeTest(usual, watched.block_time, watched.averages, nominal, watched.free)
        if memory.base is None:
            memory = replace(memory, base=np.mean([_mean_square(row.mean, row.quick, usual.theta) for row in rows], axis=0))
        if memory.first is None:
            memory = replace(memory, first=(usual, dict(zip(watched.parameters, memory.theta.tolist(), strict=True))))
            memory = replace(memory, course=course_of(watched, memory))
        largest, moved = 0.0, 0.0
        for number, item in enumerate(sums):
            test.take(item)
            found = test.test() if number % _OFTEN == 0 else None
            if found is not None:
                largest, moved = max(largest, found.statistic), max(moved, found.moved)
        limit, step_limit = (max(CHANGE.least_ratio, CHANGE.over_learnt * reached) for reached in (largest, moved))
        return cls(watched, memory, usual, test, noise, limit, step_limit)

    def moved(self, by: FloatArray) -> JudgingState:
        """Return the state after the simulation went on with values that are ``by`` (parameters,) others."""
        self.test.move(by)
        return self

    def after(self, block: WatchedBlock) -> tuple[LearningState | JudgingState, list[Event]]:
        """Return the state after a block: it learns anew where there is an alarm."""
        sums = self.usual.sums(block.mean, block.quick, block.time)
        self.test.take(sums)
        found = self.test.test()
        stepped = found is not None and found.moved > self.step_limit
        settled = block.time + FOLLOWING.believed * self.watched.block_time if stepped else self.settled
        noisy = self.noise.take(sums.left if block.time > settled else np.full(len(sums.left), np.nan), block.time)
        state = replace(self, settled=settled)
        if found is not None and found.statistic > self.limit:
            begun = self.memory.steps.begun(found.begun)
            return state._alarm(block.time, found.channel, begun, direction_names(self.watched.drive)[found.direction], found.size)
        if noisy is not None:
            channel, begun, size = noisy
            return state._alarm(block.time, channel % len(self.watched.compare), begun, _NOISE, size)
        if found is not None and found.statistic < CHANGE.quiet * self.limit:
            return state._followed(block, found, stepped)
        return state, []

    def _alarm(self, time: float, channel: int, begun: float, state: str, size: float) -> tuple[LearningState, list[Event]]:
        change = ReportedChange(time, begun, self.watched.compare[channel], state, time - begun > CHANGE.slow, size)
        return LearningState.anew(self.watched, self.memory.after_alarm(begun)), [change]

    def _followed(self, block: WatchedBlock, found: FoundChange, stepped: bool) -> tuple[JudgingState, list[Event]]:
        """Return the state with the values that explain the newest blocks; what was before their last step is not looked at any more."""
        memory, watched, time = self.memory, self.watched, block.time
        seen = min(memory.steps.seen, time - watched.block_time) if stepped else np.inf
        if stepped and time - max(found.moved_at, seen) < FOLLOWING.believed * watched.block_time:
            return replace(self, memory=replace(memory, steps=replace(memory.steps, seen=seen))), []
        steps, events = replace(memory.steps, seen=np.inf), list[Event]()
        before, theta = memory.theta, block.nominal + found.theta
        if stepped:
            moved = np.abs(theta - before)
            likeliest = int(np.argmax(moved / found.deviations)) if len(moved) else 0
            if moved.max(initial=0.0) > FOLLOWING.far:
                step = (float(before[likeliest]), float(theta[likeliest]))
                events.append(Moved(time, found.moved_at, watched.parameters[likeliest], *step))
            steps = steps.with_one(found.moved_at)
            self.test.forget_before(found.moved_at)
        if np.abs(found.theta[~watched.free]).max(initial=0.0) > FOLLOWING.far and found.power > FOLLOWING.power:
            theta = np.where(watched.free, block.nominal, theta)
            events.append(GoOn(theta))
            self.test.forget_before(time)
        return replace(self, memory=replace(memory, theta=theta, steps=steps)), events


@dataclass(frozen=True, eq=False)
class PausedState:
    """Judges and learns nothing, as what changed is not known yet; ``held`` is the state in which the watch was before."""

    held: LearningState | JudgingState
    memory: WatchMemory

    def moved(self, by: FloatArray) -> PausedState:
        """Return the state; the simulation does not go on with other values while nothing is judged."""
        return self

    def after(self, block: WatchedBlock) -> tuple[PausedState, list[Event]]:
        """Return the state."""
        return self, []


WatchState = LearningState | JudgingState | PausedState


def course_of(watched: WatchedChannels, memory: WatchMemory) -> ValueCourse | None:
    """Return the course of the values from now on, against what was usual in the first laps; None before that is known."""
    if memory.first is None:
        return None
    usual, values = memory.first
    centre = np.array([values.get(name, 0.0) for name in watched.parameters])
    return ValueCourse(usual, watched.free, centre, memory.new, watched.block_time)


def _expected(notes: tuple[tuple[float, FloatArray], ...], time: float) -> Expected | None:
    """Return the values expected at a time [s] from notes of them; None where there are none."""
    return None if not notes else expected_values(np.array([at for at, _ in notes]), np.array([theta for _, theta in notes]), time)


def _mean_square(mean: Residual, quick: FloatArray, theta: FloatArray) -> FloatArray:
    """Return the mean square of each channel of a block with the values ``theta`` from the nominal ones, (channels,)."""
    left = mean.values - np.einsum("p,pcn->cn", theta, mean.sensitivities)
    return np.asarray(np.mean(left**2, axis=1) + quick)
