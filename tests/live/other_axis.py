"""An axis under cascade control by an integrator of its own, with friction, play, gain and delay that change on the way.

It shares no code with the engine: Euler steps of 50 us in one compiled loop.
"""

from __future__ import annotations

import numba
import numpy as np

from lathesim.record import FloatArray

PERIOD = 1e-3
_FINE = 20
POSITION_GAIN, VELOCITY_GAIN, LIMIT = 160.18, 243.45, 10.0
MASS, VISCOUS, EFFORT = 95.1089, 203.5034, 35.15065


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def _run(
    reference: FloatArray, mass: FloatArray, viscous: FloatArray, friction: FloatArray, gain: FloatArray, play: FloatArray,
    noise: FloatArray, counts: float,
) -> FloatArray:  # fmt: skip
    samples = len(reference)
    out = np.zeros((4, samples))
    x = v = table = 0.0
    before = earlier = 0.0
    step = PERIOD / _FINE
    for k in range(samples):
        motor = np.round((x + noise[k, 0]) / counts) * counts
        if k == 0:
            before = earlier = motor
        speed = (motor - earlier) / (2.0 * PERIOD)  # of the mean of two samples, as the lesson's controller
        earlier, before = before, motor
        u = VELOCITY_GAIN * (POSITION_GAIN * (reference[k] - motor) - speed)
        u = min(LIMIT, max(-LIMIT, u))
        out[0, k] = motor
        out[1, k] = np.round((table + noise[k, 1]) / counts) * counts
        out[2, k] = u
        out[3, k] = gain[k] * u + noise[k, 2]
        for _ in range(_FINE):
            force = EFFORT * gain[k] * u - viscous[k] * v
            free = v + step * force / mass[k]
            held = step * friction[k] / mass[k]  # what dry friction takes of the speed in a step, at most all of it
            gained = (0.0 if abs(free) <= held else free - held if free > 0.0 else free + held) - v
            x += step * (v + 0.5 * gained)
            v += gained
            half = 0.5 * play[k]
            table = x - half if x - table > half else x + half if table - x > half else table
    return out


def reference(seconds: float) -> FloatArray:
    """Return an exercise out and back at three speeds, with rests, again and again (samples,)."""
    legs = [(0.06, 0.05), (-0.06, 0.05), (0.03, 0.1), (-0.03, 0.1), (0.01, 0.02), (-0.01, 0.02)]
    pieces, place = [np.zeros(int(0.3 / PERIOD))], 0.0
    for way, top in legs:
        ramp = top / 1.0
        cruise = max(0.0, abs(way) / top - ramp)
        speed = np.concatenate(
            [np.linspace(0, top, int(ramp / PERIOD)), np.full(int(cruise / PERIOD), top), np.linspace(top, 0, int(ramp / PERIOD))]
        )
        moved = place + np.sign(way) * np.cumsum(speed) * PERIOD
        place = float(moved[-1])
        pieces += [moved, np.full(int(0.2 / PERIOD), place)]
    lap = np.concatenate(pieces)
    laps = int(np.ceil(seconds / PERIOD / len(lap)))
    drift = np.arange(laps)[:, None] * (lap[-1] - lap[0])
    return (lap[None, :] + drift).ravel()[: int(seconds / PERIOD)]


def stream(
    seconds: float,
    seed: int,
    *,
    mass: float | FloatArray = 1.0,
    viscous: float | FloatArray = 1.0,
    friction: float | FloatArray = 0.0,
    gain: float | FloatArray = 1.0,
    play: float | FloatArray = 0.0,
) -> FloatArray:
    """Return reference, motor, table, voltage and current, (5, samples); factors and sizes are numbers or (samples,)."""
    wanted = reference(seconds)
    count = len(wanted)
    rng = np.random.default_rng(seed)
    full = [np.broadcast_to(np.asarray(item, dtype=np.float64), count).copy() for item in (mass, viscous, friction, gain, play)]
    noise = rng.normal(size=(count, 3)) * np.array([3e-8, 3e-8, 2e-3])
    measured = _run(wanted, MASS * full[0], VISCOUS * full[1], full[2], full[3], full[4], noise, 5e-8)
    return np.vstack([wanted, measured])


def step(seconds: float, at: float, before: float, after: float) -> FloatArray:
    """Return a value that changes at a time [s]."""
    return np.where(np.arange(int(seconds / PERIOD)) * PERIOD < at, before, after)
