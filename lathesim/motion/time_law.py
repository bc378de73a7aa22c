"""A path with its times: s(t) as pieces of polynomials, each exact, and the set-points sampled from it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lathesim.motion.joint_path import FloatArray, JointPath, PathCurve
from lathesim.record import Channel, Record

_SAME = 1e-13
"""Share of the whole time within which two instants are one."""


@dataclass(frozen=True, eq=False)
class TimeLaw:
    """The path parameter s over the time: between the instants ``time`` (knots,) a cubic of s.

    ``place``, ``speed``, ``acceleration``, ``jerk`` (knots,) are s and its derivatives just after each instant; after the last one s stays.
    """

    time: FloatArray
    place: FloatArray
    speed: FloatArray
    acceleration: FloatArray
    jerk: FloatArray

    @property
    def duration(self) -> float:
        """Return how long the motion lasts [s]."""
        return float(self.time[-1])

    def at(self, time: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return s and its first three derivatives at the instants ``time`` [s]; before the start and after the end the axes stand."""
        inside = np.clip(time, 0.0, self.duration)
        piece = np.clip(np.searchsorted(self.time, inside, side="right") - 1, 0, max(0, len(self.time) - 2))
        h = inside - self.time[piece]
        s, v, a, j = self.place[piece], self.speed[piece], self.acceleration[piece], self.jerk[piece]
        moving = (time >= 0.0) & (time <= self.duration)
        rates = (v + h * (a + h * j / 2.0), a + h * j, np.broadcast_to(j, h.shape))
        places = np.clip(s + h * (v + h * (a / 2.0 + h * j / 6.0)), self.place[0], self.place[-1])
        return (places, *(np.where(moving, rate, 0.0) for rate in rates))  # type: ignore[return-value]

    def going_through(self, time: FloatArray) -> FloatArray:
        """Return the middle of the stretch of the path that is gone through at the instants ``time`` [s]."""
        piece = np.clip(np.searchsorted(self.time, np.asarray(time), side="right") - 1, 0, max(0, len(self.time) - 2))
        middles: FloatArray = 0.5 * (self.place[piece] + self.place[np.minimum(piece + 1, len(self.place) - 1)])
        return middles

    def slowed(self, factor: float) -> TimeLaw:
        """Return the law ``factor`` times as long: speeds fall by it, accelerations by its square, jerks by its cube."""
        return TimeLaw(self.time * factor, self.place, self.speed / factor, self.acceleration / factor**2, self.jerk / factor**3)


def law_of(s: FloatArray, b: FloatArray) -> TimeLaw:
    """Return the law of a grid: ``s`` (nodes,) and b = (ds/dt)^2 there; the path acceleration is constant from node to node."""
    ds = np.diff(s)
    speeds = np.sqrt(np.maximum(b, 0.0))
    seconds = 2.0 * ds / (speeds[:-1] + speeds[1:])
    acceleration = (speeds[1:] - speeds[:-1]) / seconds
    return TimeLaw(np.concatenate([[0.0], np.cumsum(seconds)]), s, speeds, np.append(acceleration, 0.0), np.zeros(len(s)))


def smoothed(law: TimeLaw, width: float) -> TimeLaw:
    """Return the moving average of a law over ``width`` [s]: it goes over the same path, ``width`` later at its end.

    The average of s over [t - width, t] has the acceleration (v(t) - v(t - width)) / width, without jumps and 0 at both ends, and the jerk
    (a(t) - a(t - width)) / width. On a line that reaches speed v and acceleration a, width = a / j gives the quickest motion with jerk j:
    d / v + v / a + a / j.
    """
    end = law.duration + width
    time = np.unique(np.concatenate([law.time, law.time + width]))
    time = time[np.concatenate([[True], np.diff(time) > _SAME * end])]
    time[-1] = end
    middle = 0.5 * (time[1:] + time[:-1])
    jerk = (_piecewise(law, middle) - _piecewise(law, middle - width)) / width
    here, before = _rates(law, time), _rates(law, time - width)
    place = (_integral(law, time) - _integral(law, time - width)) / width
    speed, acceleration = (here[0] - before[0]) / width, (here[1] - before[1]) / width
    place[0], place[-1] = law.place[0], law.place[-1]
    for rate in (speed, acceleration):
        rate[0] = rate[-1] = 0.0
    return TimeLaw(time, np.maximum.accumulate(place), speed, acceleration, np.append(jerk, 0.0))


def _piecewise(law: TimeLaw, time: FloatArray) -> FloatArray:
    piece = np.clip(np.searchsorted(law.time, time, side="right") - 1, 0, len(law.time) - 1)
    return np.where((time > 0.0) & (time < law.duration), law.acceleration[piece], 0.0)


def _rates(law: TimeLaw, time: FloatArray) -> tuple[FloatArray, FloatArray]:
    places, speeds, _, _ = law.at(time)
    return places, speeds


def _integral(law: TimeLaw, time: FloatArray) -> FloatArray:
    """Return the integral of s from 0 to each instant; s is the first place before and the last after."""
    seconds = np.diff(law.time)
    parts = seconds * (law.place[:-1] + seconds * (law.speed[:-1] / 2.0 + seconds * law.acceleration[:-1] / 6.0))
    sums = np.concatenate([[0.0], np.cumsum(parts)])
    inside = np.clip(time, 0.0, law.duration)
    piece = np.clip(np.searchsorted(law.time, inside, side="right") - 1, 0, len(law.time) - 2)
    h = inside - law.time[piece]
    within = h * (law.place[piece] + h * (law.speed[piece] / 2.0 + h * law.acceleration[piece] / 6.0))
    outside = np.minimum(time, 0.0) * law.place[0] + np.maximum(time - law.duration, 0.0) * law.place[-1]
    return np.asarray(sums[piece] + within + outside)


def joined(laws: list[TimeLaw]) -> TimeLaw:
    """Return laws one after another; each begins where the last one ends, and the axes stand between them."""
    if len(laws) == 1:
        return laws[0]
    begins = np.concatenate([[0.0], np.cumsum([law.duration for law in laws])])
    time = [law.time[:-1] + begin for law, begin in zip(laws, begins, strict=False)] + [begins[-1:]]
    columns = [
        np.concatenate([*(getattr(law, name)[:-1] for law in laws), getattr(laws[-1], name)[-1:]])
        for name in ("place", "speed", "acceleration", "jerk")
    ]
    return TimeLaw(np.concatenate(time), *columns)


@dataclass(frozen=True, eq=False)
class Timing:
    """A path with its times: ``curve`` q(s) and ``law`` s(t)."""

    path: JointPath
    curve: PathCurve
    law: TimeLaw

    @property
    def duration(self) -> float:
        """Return how long the motion lasts [s]."""
        return self.law.duration

    def at(self, time: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return positions, velocities, accelerations and jerks of the axes at instants [s], each (instants, axes)."""
        return motion_at(self.curve, self.law, time)


def motion_at(curve: PathCurve, law: TimeLaw, time: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return q and its first three derivatives by t: q' s', q' s'' + q'' s'^2, q' s''' + 3 q'' s' s'' + q''' s'^3."""
    s, v, a, j = (rate[:, None] for rate in law.at(np.asarray(time, dtype=np.float64)))
    spans = np.clip(np.searchsorted(curve.knots, s[:, 0], side="right") - 1, 0, max(0, len(curve.knots) - 2))
    if len(curve.stops) > 2:
        # s at a retraction may be rounded to either side of it; which of the two directions is meant is known from the time
        piece = np.clip(np.searchsorted(curve.knots[curve.stops], law.going_through(time), side="right") - 1, 0, len(curve.stops) - 2)
        spans = np.clip(spans, curve.stops[piece], curve.stops[piece + 1] - 1)
    offsets = s[:, 0] - curve.knots[spans]
    q, q1, q2, q3 = (curve.derivative(order, spans, offsets) for order in range(4))
    return q, q1 * v, q1 * a + q2 * v * v, q1 * j + 3.0 * q2 * v * a + q3 * v**3


_BLOCK = 16384
_ORDERS = (("position", ""), ("velocity", "/s"), ("acceleration", "/s^2"))


def sample_times(duration: float, period: float) -> FloatArray:
    """Return the instants k period from 0 up to the first at or after ``duration``; the last shows the axes at rest."""
    return np.arange(int(np.ceil(duration / period - 1e-9)) + 1, dtype=np.float64) * period


def set_points(timing: Timing, period: float) -> Record:
    """Return positions, velocities and accelerations of the axes at every servo period [s], as channels ``x.position`` and so on."""
    time = sample_times(timing.duration, period)
    columns = timing.at(time)
    channels = {
        channel.name: Channel(channel.name, channel.unit, columns[place % 3][:, place // 3], channel.description)
        for place, channel in enumerate(_channels(timing))
    }
    return Record(time, channels, _meta(timing, period))


def save_set_points(timing: Timing, period: float, path: str | Path, more: Mapping[str, str | float | int] | None = None) -> int:
    """Write the set-points block by block, so that memory stays bounded; return their number."""
    from lathesim.record_writer import RecordWriter

    time = sample_times(timing.duration, period)
    with RecordWriter(path, _channels(timing), block=min(len(time), _BLOCK)) as writer:
        for begin in range(0, len(time), _BLOCK):
            here = time[begin : begin + _BLOCK]
            columns = timing.at(here)
            writer.write(here, [columns[place % 3][:, place // 3] for place in range(3 * len(timing.path.names))])
        writer.finish({**_meta(timing, period), **(more or {})})
    return len(time)


def _channels(timing: Timing) -> list[Channel]:
    empty = np.zeros(0)
    return [
        Channel(f"{name}.{order}", f"{unit}{per}", empty, f"{order} of the axis {name}")
        for name, unit in zip(timing.path.names, timing.path.units, strict=True)
        for order, per in _ORDERS
    ]


def _meta(timing: Timing, period: float) -> dict[str, str | float | int]:
    return {"sample_period": period, "status": "complete", "duration": timing.duration, "kind": "set-points"}
