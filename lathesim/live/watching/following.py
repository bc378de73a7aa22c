"""What follows from the values that move: steps and growth of known effects, values that leave their range, forecasts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from lathesim.live.watching.event import WatchEvent
from lathesim.live.watching.forecast import DriftCourse, GrowthCourse
from lathesim.live.watching.known_effects import FollowedSize, KnownEffects
from lathesim.live.watching.thresholds import ERRORS, FOLLOWING
from lathesim.live.watching.value_course import SEGMENT, CoursePoint
from lathesim.live.watching.watch import Moved, Watch

_MINUTE = 60.0
"""Seconds between two sentences about the same uncertain value."""


class Following:
    """Follows the values of a watch. ``news`` returns what is to be told; ``alarmed`` says that something else changed.

    ``sizes`` are those of the effects that the simulation holds, ``tolerance`` maps channels to theirs [SI]; ``before`` was followed before
    the simulation got what was named.
    """

    def __init__(
        self, watch: Watch, sizes: Mapping[str, FollowedSize], known: KnownEffects, tolerance: Mapping[str, float], before: Following | None
    ) -> None:  # fmt: skip
        self._watch, self._sizes, self._known = watch, sizes, known
        self._names = watch.residuals.parameters
        self._courses = {
            name: GrowthCourse(watch.residuals.scales[name], sizes[name].value, known.drifting_since(sizes[name]))
            for name, free in zip(self._names, watch.residuals.free, strict=True)
            if free
        }
        self._drifts: list[DriftCourse] = (
            [DriftCourse(channel, limit) for channel, limit in tolerance.items()] if before is None else before._drifts
        )
        self._drifting: bool = before is not None and before._drifting
        self._outside: set[str] = set() if before is None else before._outside
        self._told: dict[str, float] = {} if before is None else before._told
        self._raw: list[list[tuple[float, float]]] = [[] for _ in self._drifts]
        self._raw_since = np.nan
        for drift in self._drifts:
            drift.begin()

    def alarmed(self, drift: bool) -> None:
        """Take note of an alarm: from a drift on forecasts are made."""
        self._drifting = self._drifting or drift

    def news(self, now: float) -> Iterator[WatchEvent]:
        """Return what the newest blocks tell until ``now`` [s]."""
        while self._watch.moved:
            yield from self._moved(self._watch.moved.popleft())
        while self._watch.points:
            yield from self._point(self._watch.points.popleft(), now)
        if not self._courses and self._drifting and not self._watch.paused:
            yield from self._unnamed(now)

    def _moved(self, moved: Moved) -> Iterator[WatchEvent]:
        """Return what a step of a value is: of an uncertain one an event; of a known size the next whole segment tells."""
        name = moved.parameter
        if name in self._courses:
            self._courses[name].stepped(moved.begun)
            return
        if moved.time - self._told.get(name, -np.inf) < _MINUTE:
            return
        self._told[name] = moved.time
        sentence = f"t = {moved.time:.1f} s: {name} moved, within what the lesson calls uncertain."
        yield WatchEvent("values", moved.time, sentence, {"parameter": name})

    def _growth(self, name: str, before: float, now: float, since: float, until: float, rate: float, time: float) -> WatchEvent:
        size = self._sizes[name]
        effect = self._known.moved(size, now, since, until)
        smaller = abs(now - size.neutral) < abs(before - size.neutral)
        what = ("shrinks" if smaller else "grows") if rate else ("has shrunk" if smaller else "has grown")
        speed = f", by {abs(3600.0 * rate):.3g} {size.unit} an hour".replace("  ", " ") if rate else ""
        span = f"{size.parameter} from {before:.4g} to {now:.4g} {size.unit}".rstrip()
        sentence = f"t = {time:.1f} s: {effect.name} {what}: {span} since t = {since:.1f} s{speed}."
        data = {"grown": [effect.name], "since_s": since, "parameter": name, "from": before, "to": now, "unit": size.unit, "rate": rate,
                "shrinks": smaller}  # fmt: skip
        return WatchEvent("growth", time, sentence, data)

    def _point(self, point: CoursePoint, now: float) -> Iterator[WatchEvent]:
        for at, name in enumerate(self._names):
            if name in self._courses:
                size, course = self._sizes[name], self._courses[name]
                found = course.take(
                    point.time, size.value + float(point.values[at]) * course.scale, float(point.deviations[at]) * course.scale
                )
                if found is not None:
                    self._drifting = True
                    for drift in self._drifts:
                        drift.only_since(found.since)
                    yield self._growth(name, found.before, found.now, found.since, point.time, found.rate, now)
                elif course.told:
                    self._known.moved(size, course.newest, point.time, course.until)
            else:
                yield from self._range(name, float(point.values[at]), float(point.deviations[at]), now)
        for drift in self._drifts if self._courses else []:
            excess = float(point.excess[self._watch.residuals.compare.index(drift.channel)])
            # what followed sizes do is known by sensitivities
            told = drift.take(point.time, excess, now, drifts=self._drifting, doubt=ERRORS.linear * drift.tolerance)
            if told is not None:
                yield told

    def _range(self, name: str, value: float, deviation: float, now: float) -> Iterator[WatchEvent]:
        """Return the event of an uncertain value that has left what the lesson allows, once."""
        if name in self._outside or abs(value) - FOLLOWING.range * deviation < ERRORS.furthest:
            return
        self._outside.add(name)
        sentence = (
            f"t = {now:.1f} s: {name} leaves its range: it is {value:+.1f} standard deviations from the lesson's, "
            f"and {ERRORS.furthest:g} are allowed."
        )
        yield WatchEvent("range", now, sentence, {"parameter": name, "deviations": value})

    def _unnamed(self, now: float) -> Iterator[WatchEvent]:
        """Return forecasts from by how much channels differ while nothing is named; what moved values may do there is not known."""
        self._raw_since = now if np.isnan(self._raw_since) else self._raw_since
        for drift, squares in zip(self._drifts, self._raw, strict=True):
            squares.append((self._watch.excess(drift.channel), self._watch.excess_by_values(drift.channel)))
        if now - self._raw_since < SEGMENT:
            return
        middle, self._raw_since = 0.5 * (self._raw_since + now), now
        for drift, squares in zip(self._drifts, self._raw, strict=True):
            excess, doubt = np.sqrt(np.maximum(0.0, np.mean(squares, axis=0))).tolist()
            told = drift.take(middle, excess, now, doubt=doubt)
            squares.clear()
            if told is not None:
                yield told
