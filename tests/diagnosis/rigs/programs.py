"""What the rigs are led along: trapezoids and S-curves, sums of sines, steps, speeds and voltages of a spindle; loads, and added inputs."""

from __future__ import annotations

import numpy as np

Program = tuple[str, ...]
"""Names of the pieces that a program is put together of, in turn."""


def course(
    rng: np.random.Generator, program: Program, samples: int, period: float, top: float, stroke: float, acceleration: float
) -> np.ndarray:
    """Return positions [m or rad] that begin at rest and stay within a stroke of where they began."""
    pieces, count, turn = [np.zeros(round(0.2 / period))], round(0.2 / period), 0
    shares = [1.0, 0.3, 0.08]
    while count < samples:
        share = shares[(turn // len(program)) % len(shares)] * float(rng.uniform(0.8, 1.0))
        piece = _PIECES[program[turn % len(program)]](rng, period, top * share, stroke, acceleration)
        rest = np.zeros(round(float(rng.uniform(0.06, 0.2)) / period))
        pieces += [piece, rest]
        count, turn = count + len(piece) + len(rest), turn + 1
    values: np.ndarray = np.concatenate(pieces)[:samples]
    return values


def _there_and_back(out: np.ndarray, period: float) -> np.ndarray:
    """Return the positions of a move of positive speeds and of its way back, with a short rest between."""
    there = np.cumsum(out) * period
    rest = np.full(round(0.08 / period), there[-1])
    back: np.ndarray = np.concatenate([there, rest, there[-1] - there, np.zeros(1)])
    return back


def _ramps(rng: np.random.Generator, period: float, speed: float, stroke: float, acceleration: float) -> np.ndarray:
    way = float(rng.choice([-1.0, 1.0])) * min(stroke, speed * float(rng.uniform(0.5, 1.2)) + speed**2 / acceleration)
    ramp = max(round(speed / acceleration / period), 1)
    flat = max(round(abs(way) / speed / period) - ramp, 0)
    return np.copysign(speed, way) * np.concatenate([np.arange(ramp) / ramp, np.ones(flat), 1.0 - np.arange(1, ramp + 1) / ramp])


def _trapezoid(rng: np.random.Generator, period: float, speed: float, stroke: float, acceleration: float) -> np.ndarray:
    return _there_and_back(_ramps(rng, period, speed, stroke, acceleration), period)


def _s_curve(rng: np.random.Generator, period: float, speed: float, stroke: float, acceleration: float) -> np.ndarray:
    plain = _ramps(rng, period, speed, stroke, acceleration)
    length = max(round(0.6 * speed / acceleration / period), 2)
    smooth = np.convolve(plain, np.full(length, 1.0 / length))
    return _there_and_back(smooth, period)


def _sines(rng: np.random.Generator, period: float, speed: float, stroke: float, acceleration: float) -> np.ndarray:
    rates = 2.0 * np.pi * rng.uniform(0.5, 4.0, 3)
    sizes = np.minimum(np.minimum(speed / rates, acceleration / rates**2), stroke) / 3.0
    time = np.arange(round(2.0 / period)) * period
    faded = np.minimum(1.0, np.minimum(time, time[-1] - time) / 0.25)
    values: np.ndarray = faded**2 * (3.0 - 2.0 * faded) * (sizes[:, None] * np.sin(rates[:, None] * time)).sum(axis=0)
    return values


def _steps(rng: np.random.Generator, period: float, speed: float, stroke: float, acceleration: float) -> np.ndarray:
    """Return a staircase; a step is as long as a loop of some 50 ms answers with the speed."""
    height = min(0.05 * speed, 0.2 * stroke)
    up = int(rng.integers(1, 4))
    levels = height * float(rng.choice([-1.0, 1.0])) * np.r_[np.arange(1, up + 1), np.arange(up - 1, -1, -1)]
    return np.repeat(levels, round(0.25 / period))


_PIECES = {"trapezoid": _trapezoid, "s_curve": _s_curve, "sines": _sines, "steps": _steps}


def speeds(rng: np.random.Generator, samples: int, period: float, top: float, acceleration: float) -> np.ndarray:
    """Return the speeds [rad/s] asked of a spindle: plateaus of both directions joined by ramps, and small steps on them."""
    values, level = [np.zeros(round(0.2 / period))], 0.0
    while sum(map(len, values)) < samples:
        goal = top * float(rng.choice([-1.0, -0.6, -0.2, 0.15, 0.5, 1.0])) * float(rng.uniform(0.8, 1.0))
        ramp = max(round(abs(goal - level) / acceleration / period), 1)
        flat = goal + 0.04 * top * np.repeat(rng.choice([-1.0, 0.0, 1.0], 4), round(0.12 / period))
        values += [np.linspace(level, goal, ramp), flat]
        level = goal
    joined: np.ndarray = np.concatenate(values)[:samples]
    return joined


def cuts(rng: np.random.Generator, samples: int, period: float, most: float) -> np.ndarray:
    """Return the torque [N m] of cuts that come and go with an entry of 50 ms."""
    levels = most * np.maximum(rng.uniform(-0.6, 1.0, samples), 0.0)
    plain = np.repeat(levels, round(0.7 / period))[:samples]
    entry = round(0.05 / period)
    smooth: np.ndarray = np.convolve(plain, np.full(entry, 1.0 / entry))[:samples]
    return smooth


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
