"""A loop with a watermark in numbers: what it costs, what a replay does to the innovation, how soon a guard tells.

    x+ = a x + b u + w,   y = x + v,   u = -L xhat + e,   e ~ N(0, se^2) known to the guard only

xhat is the steady Kalman filter's, nu = y - predicted y the innovation. Honest readings have var nu = S and E[nu_k e_(k-1)] = 0.
A replay of earlier readings gives E[nu_k e_(k-1)] = -b se^2 and var nu = S + 2 b^2 se^2/(1 - g^2), with g = (a - b L)(1 - K): the
filter follows a watermark that the readings do not hold, and the readings hold one that the filter does not know.

Source: Mo, Sinopoli, 47th Allerton Conference (2009); Satchidanandan, Kumar, Proc. IEEE 105 (2017), 219; Page, Biometrika 41 (1954), 100.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from lathesim.engine.assembly import FloatArray


@dataclass(frozen=True)
class WatermarkedLoop:
    """A loop of first order with its feedback and the variances of process and reading."""

    a: float = 0.9
    b: float = 1.0
    feedback: float = 0.5
    process: float = 0.01
    reading: float = 0.01

    @property
    def predicted(self) -> float:
        """Variance of the predicted state, the steady solution of the Riccati equation."""
        first = self.reading * (1.0 - self.a**2) - self.process
        return 0.5 * (-first + math.sqrt(first**2 + 4.0 * self.process * self.reading))

    @property
    def innovation(self) -> float:
        """S: variance of the innovation of honest readings."""
        return self.predicted + self.reading

    @property
    def gain(self) -> float:
        """K: gain of the filter."""
        return self.predicted / self.innovation

    @property
    def memory(self) -> float:
        """g: share of a wrong estimate that is left a sample later, while readings are replayed."""
        return (self.a - self.b * self.feedback) * (1.0 - self.gain)

    def replayed_variance(self, watermark: float) -> float:
        """Return the variance of the innovation while readings are replayed, with a watermark of standard deviation ``watermark``."""
        return self.innovation + 2.0 * self.b**2 * watermark**2 / (1.0 - self.memory**2)

    def replayed_correlation(self, watermark: float) -> float:
        """Return E[nu_k e_(k-1)] while readings are replayed."""
        return -self.b * watermark**2

    def information(self, watermark: float) -> float:
        """Return what a replayed reading is expected to tell [nats]: the mean of the log-likelihood ratio, the Kullback-Leibler distance.

        With V the variance under replay and R = V - b^2 se^2 what the watermark leaves of it: (V/S - 1 + ln(S/R))/2.
        """
        replayed = self.replayed_variance(watermark)
        left = replayed - self.b**2 * watermark**2
        return 0.5 * (replayed / self.innovation - 1.0 + math.log(self.innovation / left))

    def cost(self, watermark: float) -> float:
        """Return E[x^2] with honest readings and a watermark: the exact solution of the covariance equation of state and error."""
        # d = xhat - x; x+ = (a - bL) x - bL d + b e + w;  d+ = (1 - K)(a d - w) + K v
        closed, stay = self.a - self.b * self.feedback, (1.0 - self.gain)
        matrix = np.array([[closed, -self.b * self.feedback], [0.0, stay * self.a]])
        noise = np.array([[self.process + self.b**2 * watermark**2, -stay * self.process], [-stay * self.process, 0.0]])
        noise[1, 1] = stay**2 * self.process + self.gain**2 * self.reading
        return float(np.linalg.solve(np.eye(4) - np.kron(matrix, matrix), noise.ravel())[0])


@dataclass(frozen=True, eq=False)
class Watched:
    """Innovations (samples,) of a loop and the watermarks (samples,) of the sample before each."""

    innovation: FloatArray
    watermark: FloatArray
    state: FloatArray


def simulate_loops(loop: WatermarkedLoop, watermark: float, samples: int, loops: int, seed: int, replay_from: int | None = None) -> Watched:
    """Return (loops, samples) innovations, watermarks of the sample before, and true states.

    From ``replay_from`` on the readings are those of as many samples before, as an attacker who had recorded them would give them again.
    """
    random = np.random.default_rng(seed)
    gain = loop.gain
    state = np.zeros(loops)
    estimate = np.zeros(loops)
    mark = np.zeros(loops)
    control = np.zeros(loops)
    readings = np.zeros((samples, loops))
    innovation, marks, states = np.zeros((loops, samples)), np.zeros((loops, samples)), np.zeros((loops, samples))
    for k in range(samples):
        state = loop.a * state + loop.b * control + math.sqrt(loop.process) * random.standard_normal(loops)
        reading = state + math.sqrt(loop.reading) * random.standard_normal(loops)
        readings[k] = reading
        seen = reading if replay_from is None or k < replay_from else readings[k - replay_from]
        foretold = loop.a * estimate + loop.b * control
        innovation[:, k], marks[:, k], states[:, k] = seen - foretold, mark, state
        estimate = foretold + gain * (seen - foretold)
        mark = watermark * random.standard_normal(loops)
        control = -loop.feedback * estimate + mark
    return Watched(innovation, marks, states)


def log_likelihood_ratio(loop: WatermarkedLoop, watermark: float, seen: Watched) -> FloatArray:
    """Return for each sample the logarithm of the ratio: replayed against honest, of innovation and watermark together.

    Honest: nu ~ N(0, S) apart from e. Replayed: nu ~ N(-b e, V - b^2 se^2), V the variance under replay.
    """
    honest, replayed = loop.innovation, loop.replayed_variance(watermark) - loop.b**2 * watermark**2
    nu, mark = seen.innovation, seen.watermark
    return np.asarray(0.5 * np.square(nu) / honest - 0.5 * np.square(nu + loop.b * mark) / replayed + 0.5 * math.log(honest / replayed))


def alarm_samples(increments: FloatArray, threshold: float) -> FloatArray:
    """Return for each row when s = max(0, s + increment) first exceeds the threshold; NaN where it never does. Source: Page (1954)."""
    rows, samples = increments.shape
    level, when = np.zeros(rows), np.full(rows, np.nan)
    for k in range(samples):
        level = np.maximum(0.0, level + increments[:, k])
        rising = np.isnan(when) & (level > threshold)
        when[rising] = k + 1
        level[rising] = 0.0
    return when


def mean_run(increments: FloatArray, threshold: float) -> float:
    """Return the mean samples between alarms of rows that go on after each alarm from zero."""
    rows, samples = increments.shape
    level, alarms = np.zeros(rows), 0
    for k in range(samples):
        level = np.maximum(0.0, level + increments[:, k])
        rising = level > threshold
        alarms += int(rising.sum())
        level[rising] = 0.0
    return float(rows * samples / max(alarms, 1))


def threshold_for(increments: FloatArray, wanted: float) -> float:
    """Return the threshold at which rows of honest increments alarm once in ``wanted`` samples on average, by bisection."""
    low, high = 0.5, 30.0
    for _ in range(24):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if mean_run(increments, middle) < wanted else (low, middle)
    return 0.5 * (low + high)


@dataclass(frozen=True)
class FrontierPoint:
    """A watermark on the frontier: standard deviation, what it costs (E[x^2]), threshold, and the mean delay [samples] (NaN: never)."""

    watermark: float
    cost: float
    threshold: float
    delay: float


def watermark_within(loop: WatermarkedLoop, samples: float, false_alarm: float) -> float:
    """Return the smallest watermark whose replay is told within so many samples on average, by its expected information.

    At one false alarm in A samples the best guard needs about ln(A) nats: the delay is ln(A) over the information of a sample. The
    correlation of replayed innovations tells more than that counts, so the guard is no later.
    Source: Lorden, Ann. Math. Statist. 42 (1971), 1897.
    """
    from scipy.optimize import brentq

    needed = math.log(false_alarm) / samples
    largest = math.sqrt(loop.innovation) / abs(loop.b)
    while loop.information(largest) < needed:
        largest *= 2.0
    return float(brentq(lambda size: loop.information(size) - needed, 0.0, largest, xtol=1e-9))


def frontier(loop: WatermarkedLoop, watermarks: tuple[float, ...], false_alarm: float, seed: int = 1) -> list[FrontierPoint]:
    """Return for each watermark the mean delay to the alarm of a replay, at one false alarm in ``false_alarm`` samples.

    The statistic is the CUSUM of the joint likelihood ratio. Without a watermark replayed readings are honest in every respect, so the
    ratio is one and no guard ever tells.
    """
    found = []
    for size in watermarks:
        if size == 0.0:
            found.append(FrontierPoint(0.0, loop.cost(0.0), math.inf, math.nan))
            continue
        honest = simulate_loops(loop, size, int(min(false_alarm, 20_000)), 200, seed)
        threshold = threshold_for(log_likelihood_ratio(loop, size, honest)[:, 50:], false_alarm)
        lead = 2000
        attacked = simulate_loops(loop, size, 2 * lead, 1500, seed + 1, replay_from=lead)
        when = alarm_samples(log_likelihood_ratio(loop, size, attacked)[:, lead:], threshold)
        found.append(FrontierPoint(size, loop.cost(size), threshold, float(np.nanmean(when))))
    return found
