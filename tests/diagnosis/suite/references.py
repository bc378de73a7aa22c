"""Set-point courses of an axis: shuttles at several speeds, moves, sine sweeps, creep, small sines and rests, strung to 20 to 30 s."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

PERIOD = 1e-3


@dataclass(frozen=True)
class Course:
    """A set-point course [m] at 1 kHz, starting at rest at 0, and what it is made of."""

    position: np.ndarray
    pieces: tuple[str, ...]


def _smoothed(velocity: np.ndarray, width: int) -> np.ndarray:
    box = np.ones(max(width, 1)) / max(width, 1)
    return np.convolve(np.r_[np.zeros(width), velocity, np.zeros(width)], box, mode="same")


def _stroke(distance: float, speed: float, acceleration: float, smoothing: int) -> np.ndarray:
    """Velocity of one move with a trapezoid profile, jerk limited by a moving mean; the distance is exact."""
    speed = min(speed, np.sqrt(abs(distance) * acceleration))
    ramp = max(int(speed / acceleration / PERIOD), 1)
    flat = max(int(abs(distance) / speed / PERIOD) - ramp, 0)
    profile = np.r_[np.linspace(0.0, 1.0, ramp, endpoint=False), np.ones(flat + 1), np.linspace(1.0, 0.0, ramp + 1)[1:]]
    shaped = _smoothed(profile, smoothing)
    return shaped * distance / (np.sum(shaped) * PERIOD)


def _rest(seconds: float) -> np.ndarray:
    return np.zeros(int(seconds / PERIOD))


def _shuttle(rng: np.random.Generator, speeds: list[float], stroke: float, acceleration: float) -> np.ndarray:
    parts = []
    for speed in speeds:
        distance = min(stroke, max(1.2 * speed, 0.004)) * rng.uniform(0.9, 1.1)
        smoothing = int(rng.integers(15, 60))
        parts += [_stroke(distance, speed, acceleration, smoothing), _rest(rng.uniform(0.02, 0.15))]
        parts += [_stroke(-distance, speed * rng.uniform(0.85, 1.15), acceleration, smoothing), _rest(rng.uniform(0.02, 0.15))]
    return np.concatenate(parts)


def _sweep(rng: np.random.Generator, seconds: float, low: float, high: float, peak_speed: float) -> np.ndarray:
    """Velocity of a logarithmic sine sweep with constant peak speed up to 3 Hz, falling with the frequency beyond."""
    time = np.arange(int(seconds / PERIOD)) * PERIOD
    rate = np.log(high / low) / seconds
    frequency = low * np.exp(rate * time)
    phase = 2.0 * np.pi * low * (np.exp(rate * time) - 1.0) / rate
    envelope = np.minimum(1.0, (3.0 / frequency) ** 0.8) * np.minimum(1.0, time / 0.3) * np.minimum(1.0, (seconds - time) / 0.3)
    velocity = peak_speed * envelope * np.sin(phase)
    return velocity - np.mean(velocity) * np.hanning(len(velocity)) / np.mean(np.hanning(len(velocity)))


def _small_sine(seconds: float, amplitude: float, frequency: float) -> np.ndarray:
    time = np.arange(int(seconds / PERIOD)) * PERIOD
    cycles = round(seconds * frequency)
    return amplitude * np.sin(2.0 * np.pi * cycles / seconds * time) * np.pi * cycles / seconds * np.minimum(1.0, time / 0.1)


def _creep(rng: np.random.Generator) -> np.ndarray:
    parts = []
    for speed, distance in ((rng.uniform(0.8e-3, 1.5e-3), 1.2e-3), (rng.uniform(2e-3, 4e-3), 2e-3)):
        parts += [_stroke(distance, speed, 0.1, 15), _rest(0.05), _stroke(-distance, speed, 0.1, 15), _rest(0.05)]
    return np.concatenate(parts)


def rich_course(rng: np.random.Generator, stroke: float, top_speed: float, acceleration: float) -> Course:
    """Both directions, speeds from creep to the top, sweeps and rests: 20 to 30 s."""
    share = rng.uniform(0.85, 1.15, 6)
    speeds = [float(s) for s in top_speed * share * np.array([1.0, 0.6, 0.3, 0.12, 0.05, 0.02])]
    pieces = {
        "fast": _shuttle(rng, speeds[:3], stroke, acceleration),
        "slow": _shuttle(rng, speeds[3:], stroke * 0.08, acceleration * 0.5),
        "creep": _creep(rng),
        "sweep": _sweep(rng, 4.0, 0.4, rng.uniform(12.0, 20.0), 0.5 * top_speed),
        "small": _small_sine(1.5, rng.uniform(15e-6, 40e-6), rng.uniform(0.9, 1.6)),
        "laps": _shuttle(rng, [speeds[int(i)] for i in rng.integers(0, 3, 2)], stroke * 0.8, acceleration * 0.8),
    }
    if sum(map(len, pieces.values())) > 28000:
        del pieces["laps"]
    order = [str(name) for name in rng.permutation(list(pieces))]
    velocity = [_rest(0.3)]
    for name in order:
        velocity += [pieces[name], _rest(rng.uniform(0.1, 0.4))]
    course = np.concatenate(velocity)
    while len(course) < 20000:
        course = np.r_[course, _shuttle(rng, [speeds[int(rng.integers(0, 4))]], stroke * 0.7, acceleration), _rest(0.2)]
    course = course[:30000]
    return Course(np.cumsum(course) * PERIOD, tuple(order))


def poor_course(rng: np.random.Generator, kind: str, stroke: float, top_speed: float, acceleration: float) -> Course:
    """A course that cannot tell: ``one_direction`` (several speeds, forward only) or ``one_speed`` (to and fro at one speed)."""
    parts = [_rest(0.3)]
    if kind == "one_direction":
        speeds = top_speed * np.array([0.15, 0.3, 0.6, 0.9])
        travelled = 0.0
        while sum(map(len, parts)) < 20000 and travelled < 4.0 * stroke:
            speed = float(speeds[int(rng.integers(0, 4))])
            distance = rng.uniform(0.2, 0.4) * stroke
            travelled += distance
            blend = int(rng.integers(20, 50))
            cruise = np.full(int(distance / speed / PERIOD), speed)
            parts += [cruise if blend == 0 else _smoothed(cruise, blend)]
        kept = np.concatenate(parts)
        # never at rest after the start: a floor of speed joins the strokes
        floor = 0.1 * top_speed * np.minimum(1.0, np.maximum(0.0, np.arange(len(kept)) * PERIOD - 0.3) / 0.2)
        return Course(np.cumsum(np.maximum(kept, floor)) * PERIOD, ("one_direction",))
    speed = 0.4 * top_speed
    while sum(map(len, parts)) < 20000:
        parts += [_stroke(stroke * 0.4, speed, acceleration, 40), _rest(0.05), _stroke(-stroke * 0.4, speed, acceleration, 40), _rest(0.05)]
    return Course(np.cumsum(np.concatenate(parts)) * PERIOD, ("one_speed",))


def coloured_noise(rng: np.random.Generator, samples: int, deviation: float, corner: float) -> np.ndarray:
    """Return first-order (Ornstein-Uhlenbeck) noise of the standard deviation and corner frequency [Hz]."""
    keep = float(np.exp(-2.0 * np.pi * corner * PERIOD))
    white = rng.standard_normal(samples) * deviation * np.sqrt(1.0 - keep * keep)
    white[0] = rng.standard_normal() * deviation
    return np.asarray(lfilter([1.0], [1.0, -keep], white))
