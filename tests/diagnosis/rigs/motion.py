"""Courses that the rigs are led along: strokes of several speeds in both directions, small ones, a chirp, rests."""

from __future__ import annotations

import numpy as np


def _stroke(distance: float, speed: float, acceleration: float, period: float) -> np.ndarray:
    speed = min(speed, float(np.sqrt(abs(distance) * acceleration)))
    ramp = max(int(speed / acceleration / period), 2)
    flat = max(int(abs(distance) / speed / period) - ramp, 0)
    shape = np.r_[np.sin(np.linspace(0.0, np.pi / 2, ramp)) ** 2, np.ones(flat), np.cos(np.linspace(0.0, np.pi / 2, ramp)) ** 2]
    return shape * distance / (shape.sum() * period)


def course(rng: np.random.Generator, seconds: float, period: float, top: float, stroke: float, acceleration: float) -> np.ndarray:
    """Return positions that begin and end at rest, and come back to where they began after each pair of strokes."""
    samples = round(seconds / period)
    pieces = [np.zeros(int(0.15 / period))]
    shares = list(rng.permutation([1.0, 0.5, 0.2, 0.06]))
    while sum(map(len, pieces)) < 0.8 * samples:
        share = shares.pop() if shares else float(rng.choice([1.0, 0.5, 0.2]))
        way = stroke * min(1.0, 0.02 + share) * rng.uniform(0.7, 1.0) * rng.choice([-1.0, 1.0])
        for sign in (1.0, -1.0):
            pieces += [_stroke(sign * way, top * share * rng.uniform(0.8, 1.0), acceleration, period)]
            pieces += [np.zeros(int(rng.uniform(0.05, 0.2) / period))]
    used = min(sum(map(len, pieces)), samples)
    left = samples - used
    if left > 0.4 / period:
        time = np.arange(left) * period
        sweep = np.sin(2.0 * np.pi * (0.7 + (2.5 * time / time[-1])) * time) * np.sin(np.pi * time / time[-1]) ** 2
        pieces.append(0.5 * top * sweep)
    velocity = np.concatenate([*pieces, np.zeros(samples)])[:samples]
    return np.cumsum(velocity) * period


def voltages(rng: np.random.Generator, seconds: float, period: float, top: float) -> np.ndarray:
    """Return the voltages of an open loop: plateaus of both signs, joined by ramps, with a small binary signal on them."""
    samples = round(seconds / period)
    knots = np.arange(0.0, seconds + 0.5, 0.5)
    levels = top * rng.uniform(-1.0, 1.0, len(knots))
    levels[0] = 0.0
    plain = np.interp(
        np.arange(samples) * period, np.repeat(knots, 2)[1:-1] + np.tile([0.0, -0.12], len(knots))[1:-1], np.repeat(levels, 2)[:-2]
    )
    binary = np.repeat(rng.choice([-1.0, 1.0], samples // int(0.04 / period) + 1), int(0.04 / period))[:samples]
    return np.round((plain + 0.05 * top * binary) * 4096.0) / 4096.0


def wandering(rng: np.random.Generator, samples: int, period: float, deviation: float, corner: float = 8.0) -> np.ndarray:
    """Return first-order noise of the standard deviation and the corner frequency [Hz]."""
    keep = float(np.exp(-2.0 * np.pi * corner * period))
    values, value = np.empty(samples), 0.0
    for k, new in enumerate(rng.standard_normal(samples) * deviation * np.sqrt(1.0 - keep * keep)):
        value = keep * value + new
        values[k] = value
    return values


def added(rng: np.random.Generator, shape: str, samples: int, period: float, size: float) -> np.ndarray:
    """Return a voltage that somebody adds to a command: pulses, two steps or a sine, within the middle of a recording."""
    values, begin, end = np.zeros(samples), int(0.2 * samples), int(0.8 * samples)
    height = size * float(rng.uniform(0.7, 1.3)) * float(rng.choice([-1.0, 1.0]))
    if shape == "pulse":
        length = max(3, round(float(rng.uniform(0.05, 0.15)) / period))
        for start in rng.choice(np.arange(begin, end - length, 4 * length), 4, replace=False):
            values[start : start + length] = height
    elif shape == "step":
        first, second = sorted(rng.integers(begin, end, 2))
        values[first:], values[second:] = height, 2.0 * height
    else:
        values[begin:end] = height * np.sin(2.0 * np.pi * float(rng.uniform(1.0, 3.0)) * np.arange(end - begin) * period)
    return values
