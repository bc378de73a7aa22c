"""What follows from values that move: growth of known effects, values that leave their range, and when a drift reaches a tolerance."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from lathesim.live.watching.known_effects import FollowedSize, KnownEffects
from lathesim.live.watching.states import Moved
from lathesim.live.watching.thresholds import ERRORS, FOLLOWING
from lathesim.live.watching.usual import SEGMENT, CoursePoint
from lathesim.live.watching.watch import Watch
from lathesim.live.watching.watch_verdict import WatchEvent
from lathesim.record import FloatArray

LEAST_POINTS = 5
"""Points that a line needs: two for the line, and three to tell how far they lie from it."""


@dataclass(frozen=True)
class Forecast:
    """When a tolerance is reached: ``time`` [s] and its 95 % interval ``low`` to ``high``, which may be infinite."""

    time: float
    low: float
    high: float


@dataclass(frozen=True)
class TrendLine:
    """A straight line ``place + slope (t - middle)`` through ``count`` points: their ``variance`` about it, larger where they depend on
    their neighbours, and the ``spread`` of their times (sum of squares)."""

    middle: float
    place: float
    slope: float
    variance: float
    spread: float
    count: int

    def at(self, time: float) -> float:
        """Return the value of the line at a time [s]."""
        return float(self.place + self.slope * (time - self.middle))

    def rises(self, error: float) -> float:
        """Return the sign of the slope where it is not 0 at a probability of ``error`` to be wrong, else 0."""
        from scipy.special import stdtrit  # what scipy.stats calls for the same number, after checks that take ten times as long

        limit = stdtrit(max(1.0, self.count - 2.0), 1.0 - 0.5 * error) * np.sqrt(self.variance / self.spread)
        return float(np.sign(self.slope)) if abs(self.slope) > limit else 0.0


def line_through(time: FloatArray, value: FloatArray) -> TrendLine | None:
    """Return the line through points by least squares; None with less than five of them.

    Points that depend on their neighbours are counted by their first autocorrelation rho: as n (1 - rho) / (1 + rho).
    """
    known = np.isfinite(value)
    t, v = time[known], value[known]
    if len(t) < LEAST_POINTS:
        return None
    middle = float(t.mean())
    slope, place = np.polyfit(t - middle, v, 1)
    rest = v - place - slope * (t - middle)
    square = float(np.sum(rest * rest))
    correlation = float(np.clip(np.sum(rest[1:] * rest[:-1]) / max(square, 1e-300), 0.0, 0.95))
    variance = square / max(1.0, len(t) - 2) * len(t) / max(3.0, len(t) * (1.0 - correlation) / (1.0 + correlation))
    return TrendLine(middle, float(place), float(slope), variance, float(np.sum((t - middle) ** 2)), len(t))


def forecast(time: FloatArray, value: FloatArray, tolerance: float, doubt: float = 0.0, bend: float = 0.0) -> Forecast | None:
    """Return when a value reaches ``tolerance`` from below, from at least five points; None where a line through them does not rise.

    The value is a line, a slope that wanders (an integrated Wiener process), and noise:

        v(t) = a + b t + w(t) + e,   cov(w(s), w(t)) = q (3 max(s, t) - min(s, t)) min(s, t)^2 / 6,   q = (share b)^2 / span

    Over the time seen (``span``) the slope wanders by a ``share`` of itself: 0, a half of ``bend``, or all of it, weighed by how likely
    each makes the points. The variance of the noise and the line are integrated out, so that each share foretells a Student distribution.
    The time is where the value is as likely above the tolerance as below, the interval from 2.5 to 97.5 %. ``doubt`` is the standard
    deviation of what all values may be off by together, as a share of them: an error of the model, which no scatter shows.

    Source: G. Wahba, Spline Models for Observational Data (1990), ch. 1; C. E. Rasmussen, C. K. I. Williams, Gaussian Processes for Machine
    Learning (2006), sec. 2.7.
    """
    line = line_through(time, value)
    if line is None or line.rises(FOLLOWING.flat) <= 0.0:
        return None
    known = np.isfinite(value)
    seen, values = time[known] - time[known][0], value[known]
    last, span = float(seen[-1]), float(np.ptp(seen))
    straight = float(max(line.middle + (tolerance - line.place) / line.slope - time[known][0], last))
    ahead = np.concatenate([[last], last + np.geomspace(1e-3, 10.0, 400) * max(span, straight - last)])
    each, weights = _above(seen, values, ahead, tolerance, doubt, line, bend)
    likely = np.average(each, axis=0, weights=weights)
    at, low, high = (_first(ahead, likely, share) + float(time[known][0]) for share in (0.5, 0.025, 0.975))
    return Forecast(at if np.isfinite(at) else straight + float(time[known][0]), low, high)


def _above(
    seen: FloatArray, values: FloatArray, ahead: FloatArray, tolerance: float, doubt: float, line: TrendLine, bend: float
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Return the probability (shares, times) of a value above the tolerance for each share of the slope, and the weight of each."""
    from scipy.stats import t as student

    count = len(seen)
    noise = max(line.variance, (1e-6 * tolerance) ** 2)
    basis, further = np.column_stack([np.ones(count), seen]), np.column_stack([np.ones(len(ahead)), ahead])
    found, weights = [], []
    for share in (0.0, 0.5 * bend, bend):
        ratio = (share * line.slope) ** 2 / float(np.ptp(seen)) / noise
        root = np.linalg.cholesky(np.eye(count) + ratio * _wandering(seen, seen))
        white, aims = np.linalg.solve(root, basis), np.linalg.solve(root, values)
        normal = white.T @ white
        rest = aims - white @ np.linalg.solve(normal, white.T @ aims)
        square = max(float(rest @ rest), count * (1e-9 * tolerance) ** 2)
        weights.append(-np.log(np.diag(root)).sum() - 0.5 * np.linalg.slogdet(normal)[1] - 0.5 * (count - 2) * np.log(square))
        shared = np.linalg.solve(root, ratio * _wandering(seen, ahead))
        missed = further.T - white.T @ shared
        mean = further @ np.linalg.solve(normal, white.T @ aims) + shared.T @ rest
        own = ratio * _wandering(ahead, ahead, paired=True) - np.sum(shared**2, axis=0)
        variance = square / (count - 2) * (np.maximum(own, 0.0) + np.sum(missed * np.linalg.solve(normal, missed), axis=0))
        found.append(student.sf((tolerance - mean) / np.sqrt(variance + (doubt * tolerance) ** 2), count - 2))
    return np.array(found), np.exp(np.array(weights) - max(weights))


def _wandering(first: FloatArray, second: FloatArray, *, paired: bool = False) -> FloatArray:
    """Return the covariance of an integrated Wiener process between times (first, second), or of ``paired`` times alone."""
    one, other = (first, second) if paired else (first[:, None], second[None])
    least, most = np.minimum(one, other), np.maximum(one, other)
    return np.asarray(least**2 * (3.0 * most - least) / 6.0)


def _first(times: FloatArray, likely: FloatArray, share: float) -> float:
    """Return the first time at which a probability is a share or more; infinite where it never is."""
    above = np.flatnonzero(likely >= share)
    if not len(above):
        return float("inf")
    at = int(above[0])
    return float(times[0]) if at == 0 else float(np.interp(share, likely[at - 1 : at + 1], times[at - 1 : at + 1]))


def bend(time: FloatArray, value: FloatArray) -> float:
    """Return since when [s] a value goes on a slope, having been level before: least squares over the place of the bend."""
    best, at = np.inf, float(time[0])
    for begin in time[:-2]:
        _, rest, *_ = np.linalg.lstsq(np.column_stack([np.ones_like(time), np.maximum(0.0, time - begin)]), value, rcond=None)
        square = float(rest[0]) if len(rest) else np.inf
        if square < best:
            best, at = square, float(begin)
    return at


POINTS = 400
"""Points of a course that are kept; with more of them every second one goes."""
_EVERY = 60.0
"""Seconds between two forecasts."""


@dataclass
class Series:
    """Points of a course in time; fewer as time goes on."""

    times: list[float] = field(default_factory=list)
    values: list[float] = field(default_factory=list)

    def add(self, time: float, value: float) -> None:
        """Add a point."""
        self.times.append(time)
        self.values.append(value)
        if len(self.times) > POINTS:
            self.times, self.values = self.times[::2], self.values[::2]

    def clear(self) -> None:
        """Begin anew."""
        self.times, self.values = [], []


@dataclass
class DriftCourse:
    """A channel on its way to a tolerance: by how much it differs from the first laps, as a root mean square over segments."""

    channel: str
    tolerance: float
    series: Series = field(default_factory=Series)
    _next_told: float = 0.0
    _reached: bool = False

    def only_since(self, time: float) -> None:
        """Forget the points before ``time`` [s], when it began to move."""
        points = [(at, value) for at, value in zip(self.series.times, self.series.values, strict=True) if at >= time]
        self.series.times, self.series.values = [at for at, _ in points], [value for _, value in points]

    def take(self, time: float, value: float, now: float, *, drifts: bool = True, doubt: float = 0.0) -> WatchEvent | None:
        """Take a point of the course. Where it ``drifts``, return a forecast every minute until the tolerance is reached.

        ``doubt`` [SI] is the standard deviation of what other causes may do to the channel.
        """
        if self._reached or not np.isfinite(value):
            return None
        self.series.add(time, value)
        if now < self._next_told or not drifts:
            return None
        unsure = float(np.hypot(ERRORS.least_floor, doubt / self.tolerance))
        found = forecast(np.array(self.series.times), np.array(self.series.values), self.tolerance, unsure, FOLLOWING.bend)
        if found is None:
            return None
        self._next_told = now + _EVERY
        self._reached = found.time <= now
        if self._reached:
            sentence = f"t = {now:.1f} s: {self.channel} has reached its tolerance."
            return WatchEvent("forecast", now, sentence, {"channel": self.channel, "at_s": found.time, "low_s": now, "high_s": now})
        left, low, high = (max(0.0, time - now) for time in (found.time, found.low, found.high))
        until = f"between {low:.0f} and {high:.0f} s" if np.isfinite(high) else f"{low:.0f} s at least"
        sentence = f"t = {now:.1f} s: {self.channel} reaches its tolerance in {left:.0f} s, {until} from now (95 %)."
        data = {"channel": self.channel, "at_s": found.time, "low_s": found.low, "high_s": high + now if np.isfinite(high) else None}
        return WatchEvent("forecast", now, sentence, data)


_FALSE = SEGMENT / (8.0 * 3600.0)
"""Probability of each test to be wrong: one in eight hours of segments, as asked of the alarms."""


_NEWEST = 10
"""Segments from which the next one is foretold: of some minutes, over which a drift is straight."""


@dataclass(frozen=True)
class Growth:
    """A size moved from ``before`` to ``now`` [SI], ``since`` [s], at a ``rate`` [SI/s]; 0 for a step."""

    before: float
    now: float
    since: float
    rate: float = 0.0


@dataclass
class GrowthCourse:
    """The course of one size whose scale is ``scale`` [SI]; ``named`` [s] is since when it is known to drift, where it is known."""

    scale: float
    value: float
    named: float | None = None
    told: bool = False
    _series: Series = field(default_factory=Series)
    _stepped: float | None = None
    _mixed: tuple[float, float] | None = None

    def take(self, time: float, value: float, deviation: float) -> Growth | None:
        """Take the size over a segment around ``time`` [s], with its standard deviation; return its growth where that can be told, once."""
        if self._stepped is not None and time - 0.5 * SEGMENT < self._stepped:
            self._mixed = (time, value)  # a segment with the step in it is neither before nor after
            return None
        stepped, self._stepped = self._stepped, None
        if stepped is not None:
            step = self._confirmed(stepped, time, value, deviation)
            if step is not None:
                return step
        self._series.add(time, value)
        times, values = np.array(self._series.times), np.array(self._series.values)
        if self.told or not self._moves(times, values):
            return None
        bent = bend(times, values)
        line = line_through(times[times >= bent], values[times >= bent]) or line_through(times[-_NEWEST:], values[-_NEWEST:])
        if line is None or abs(line.at(time) - line.at(max(bent, times[0]))) < FOLLOWING.worth * self.scale:
            return None
        self.told = True
        return Growth(line.at(max(bent, float(times[0]))), line.at(time), bent if self.named is None else self.named, line.slope)

    def _confirmed(self, begun: float, time: float, value: float, deviation: float) -> Growth | None:
        """Return the step at ``begun`` [s] that the segment around ``time`` [s] confirms, and begin anew there; None where it does not."""
        expected, unsure = self._expected(time)
        mixed, self._mixed = self._mixed, None
        if abs(value - expected) <= max(FOLLOWING.worth * self.scale, FOLLOWING.step * np.hypot(deviation, unsure)):
            if mixed is not None:
                self._series.add(*mixed)
            return None
        self._series.clear()
        self.told = False
        self._series.add(time, value)
        return Growth(expected, value, begun)

    def _moves(self, times: FloatArray, values: FloatArray) -> bool:
        """Return whether the size rises or falls over the newest ten segments, or twice, four times ... as many."""
        counts = [_NEWEST * 2**power for power in range(12) if power == 0 or _NEWEST * 2 ** (power - 1) < len(times)]
        lines = [line_through(times[-count:], values[-count:]) for count in counts]
        return any(line is not None and line.rises(_FALSE / len(counts)) != 0.0 for line in lines)

    def stepped(self, begun: float) -> None:
        """Take note that the size seems to have stepped at ``begun`` [s]; the next whole segment tells."""
        self._stepped = begun if self._stepped is None else self._stepped

    def _expected(self, time: float) -> tuple[float, float]:
        """Return the size at ``time`` [s] as the newest segments go on, and its standard deviation."""
        times, values = np.array(self._series.times[-_NEWEST:]), np.array(self._series.values[-_NEWEST:])
        line = line_through(times, values)
        if line is None:  # a slope is not known, and what the few points differ by may be one
            return self.newest, float(np.ptp(values)) if len(values) > 1 else np.inf
        unsure = np.sqrt(line.variance * (1.0 + 1.0 / line.count + (time - line.middle) ** 2 / line.spread))
        return line.at(time), float(unsure)

    @property
    def until(self) -> float:
        """Return the time [s] of the newest segment that counts."""
        return self._series.times[-1]

    @property
    def newest(self) -> float:
        """Return the size now: of the line where it moves, else the mean of the newest segments; the lesson's before the first."""
        if not self._series.times:
            return self.value
        times, values = np.array(self._series.times[-_NEWEST:]), np.array(self._series.values[-_NEWEST:])
        line = line_through(times, values)
        return float(values.mean()) if line is None or not self.told else line.at(times[-1])


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
            drift.series.clear()  # what differs is measured in another way from now on

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
