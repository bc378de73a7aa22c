"""The watch: residuals block by block, what is usual learnt first, and a change or a drift told with its time and place.

Two tests look for what lasts. :class:`ChangeTest` looks for a change in a direction that the uncertain values cannot go: a load that steps
or a machine that warms up is no alarm. A CUSUM looks at the logarithm of the noise that is left in each block: chatter, ripple, a worn
bearing. Memory does not depend on the length of the stream.
"""

from __future__ import annotations

from collections import deque
from dataclasses import replace

import numpy as np

from lathesim.live.even_clock import Stretch
from lathesim.live.watching.residual_stream import LIKE, ResidualStream, averaged, averaged_others
from lathesim.live.watching.states import (
    REMEMBERED,
    GoOn,
    JudgingState,
    LearningState,
    Moved,
    PausedState,
    ReportedChange,
    WatchedBlock,
    WatchedChannels,
    WatchMemory,
    WatchState,
    course_of,
)
from lathesim.live.watching.thresholds import FOLLOWING
from lathesim.live.watching.usual import CoursePoint
from lathesim.record import FloatArray

SETTLE = 2.0
"""Seconds after a restart that are not judged: the simulation has to get to where the machine is."""
_GETTING_THERE = 0.5
"""Seconds that the simulation needs to get to where it would be with other values."""
_LEAST_BLOCK = 4
"""Samples of a block at least."""
_LEAST_LEARNT = 20
"""Blocks from which what is usual is learnt at least."""
_LEAST_AVERAGES = 20
"""Averages of a block at least, where it has so many samples."""


class Watch:
    """Watches the residuals of one machine. ``take`` gets whole stretches of samples and returns the alarms they bring.

    ``learn`` [s] is how long what is usual is learnt, ``block`` [s] the length of a block; ``plain`` is the machine without the changes
    that ``residuals`` follow, against which a :class:`CoursePoint` tells what they do. The watch runs the simulation and cuts the stream
    into blocks; what it makes of a block is said by its ``state``.
    """

    def __init__(
        self, residuals: ResidualStream, period: float, *, learn: float = 60.0, block: float = 0.2, plain: ResidualStream | None = None
    ) -> None:
        self.period, self.size = period, max(_LEAST_BLOCK, round(block / period))
        self._like = max(1, min(round(LIKE / period), self.size // _LEAST_AVERAGES))
        self._to_learn = max(_LEAST_LEARNT, round(learn / (self.size * period)))
        self._waiting: FloatArray = np.zeros((len(residuals.drive) + len(residuals.compare), 0))
        self._time, self._settled_at = 0.0, -np.inf
        self.blocks = 0
        self.points: deque[CoursePoint] = deque(maxlen=REMEMBERED)
        self.moved: deque[Moved] = deque(maxlen=REMEMBERED)
        self.residuals, self._plain = residuals, plain
        self.state: WatchState = LearningState.anew(self._watched, self._new_memory(np.zeros(len(residuals.parameters))))

    @property
    def _watched(self) -> WatchedChannels:
        of = self.residuals
        return WatchedChannels(
            of.parameters, of.free, of.compare, of.drive, self.size * self.period, self.size // self._like, self._to_learn
        )  # fmt: skip

    def _new_memory(self, new: FloatArray) -> WatchMemory:
        values, channels = len(self.residuals.parameters), len(self.residuals.compare)
        return WatchMemory(np.zeros(values), new, np.zeros(channels), np.zeros((values, channels)))

    @property
    def learnt(self) -> bool:
        """Return whether what is usual is known."""
        return isinstance(self.state.held if isinstance(self.state, PausedState) else self.state, JudgingState)

    @property
    def paused(self) -> bool:
        """Return whether nothing is judged, as a verdict is due."""
        return isinstance(self.state, PausedState)

    @property
    def values(self) -> dict[str, float]:
        """Return how far each value that may move is from the lesson's, in its scale: for an uncertain value its standard deviation."""
        return dict(zip(self.residuals.parameters, self.state.memory.theta.tolist(), strict=True))

    def expected(self, time: float) -> dict[str, float]:
        """Return each uncertain value that is expected at a time [s] from the laps before the last alarm, in its scale, from the lesson's.

        It is empty where nothing was noted before.
        """
        found = self.state.memory.expected(time)
        if found is None:
            return {}
        rows = zip(self.residuals.parameters, found.values.tolist(), self.residuals.free, strict=True)
        return {name: value for name, value, free in rows if not free}

    def excess(self, channel: str) -> float:
        """Return by how much the mean square of a channel's newest residual is above that of the first laps.

        The uncertain values that held before the last alarm are taken off.
        """
        return float(self.state.memory.excess[self.residuals.compare.index(channel)])

    def excess_by_values(self, channel: str) -> float:
        """Return the mean square of what the uncertain values may do to a channel, moving since the first alarm as before it."""
        memory = self.state.memory
        return float(np.square(memory.deviations(self._time)) @ memory.sensitive[:, self.residuals.compare.index(channel)])

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
        alarms: list[ReportedChange] = []
        for begin in range(0, whole, self.size):
            alarms += self._block(values[:, begin : begin + self.size])
        return alarms

    def _block(self, values: FloatArray) -> list[ReportedChange]:
        """Simulate a block, hand it to the state, and do what that asks for."""
        residual = self.residuals.take(values)
        plain = None if self._plain is None else self._plain.take(values)
        self._time += self.size * self.period
        if self._time < self._settled_at or not np.isfinite(residual.values).all():
            return []
        self.blocks += 1
        mean, quick = averaged(residual, self._like)
        others = averaged_others(residual, self._like) if isinstance(self.state, LearningState) else []
        block = WatchedBlock(self._time, mean, quick, others, self.residuals.nominal)
        self.state = replace(self.state, memory=self.state.memory.measured(block))
        if not isinstance(self.state, PausedState):
            self._follow_course(block, None if plain is None else mean.simulated - averaged(plain, self._like)[0].simulated)
        self.state, events = self.state.after(replace(block, nominal=self.residuals.nominal))
        self.moved.extend(event for event in events if isinstance(event, Moved))
        for event in events:
            if isinstance(event, GoOn):
                self._go_on_at(event.theta)
        return [event for event in events if isinstance(event, ReportedChange)]

    def _follow_course(self, block: WatchedBlock, difference: FloatArray | None) -> None:
        """Go on with the sizes of known effects as a whole segment shows them; no shorter time tells them surely enough."""
        course, nominal, free = self.state.memory.course, block.nominal, self.residuals.free
        point = None if course is None else course.take(block.mean, block.quick, nominal, difference, block.time)
        if point is None:
            return
        self.points.append(point)
        if (free & (np.abs(point.values - nominal) > FOLLOWING.telling * point.deviations)).any():
            theta = np.where(free, point.values, nominal)
            self.state = replace(self.state, memory=replace(self.state.memory, theta=theta))
            self._go_on_at(theta)

    def _go_on_at(self, theta: FloatArray) -> None:
        """Go on with the simulation at other values; until it has got there nothing is judged."""
        by = self.residuals.move(theta)
        if self._plain is not None:
            self._plain.follow(self.residuals)
        self.state = self.state.moved(by)
        if np.any(by):
            self._settled_at = self._time + _GETTING_THERE

    def pause(self) -> None:
        """Judge and learn nothing until :meth:`go_on`: what changed is not known yet."""
        if not isinstance(self.state, PausedState):
            self.state = PausedState(self.state, self.state.memory)

    def go_on(
        self, residuals: ResidualStream | None = None, plain: ResidualStream | None = None, new: FloatArray | None = None, *,
        as_changed: bool = False,
    ) -> None:  # fmt: skip
        """Go on from the changed state: with the ``residuals`` of a model that holds what changed, or of the same model.

        What is usual is learnt anew. The values are followed against what the machine showed before, or, where it is taken
        ``as_changed``, against what is learnt next. ``new`` (parameters,) is how large followed effects are [scales] that are new.
        """
        memory = self.state.memory
        if as_changed:
            memory = replace(memory, first=None, sound=(), notes=())
        if residuals is not None:
            self.residuals, self._plain = residuals, plain
            fresh = self._new_memory(memory.new if new is None else new)
            memory = replace(fresh, first=memory.first, first_sound=memory.first_sound, steps=memory.steps)
            self._settled_at = max(self._settled_at, self._time + SETTLE)
        watched = self._watched
        course = memory.course if memory.first is None else course_of(watched, memory)
        self.state = LearningState.anew(watched, replace(memory, course=course))
