"""The machines of the campaign, by integrators of their own: an axis, a lathe of two axes, and a turning cut.

They share no code with the engine: steps of 50 us, with the mean velocity for an axis and a flexible tool for the cut. Each returns what
is driven and what is compared, in the order of its lesson's ``recordings:``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numba
import numpy as np

from lathesim.record import FloatArray
from tests.live.campaign.flexible_tool import CLAMPED, PRESSURE, SHARE, loose, thickness

PERIOD = 1e-3
_FINE = 20
_LONGEST_DELAY = 400
"""Steps of 50 us that a command may be late at most."""
LEARN = 60.0
Changes = Mapping[str, FloatArray]


@dataclass(frozen=True)
class Axis:
    """Constants of an axis: gains of its cascade, mass [kg], viscous friction [N s/m], force per ampere [N/A]."""

    position_gain: float
    velocity_gain: float
    mass: float
    viscous: float
    effort: float


X = Axis(160.18, 243.45, 95.1089, 203.5034, 35.15065)
Z = Axis(120.0, 400.0, 180.0, 350.0, 50.0)


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def _run(
    reference: FloatArray, mass: FloatArray, viscous: FloatArray, friction: FloatArray, gain: FloatArray, play: FloatArray,
    delay: FloatArray, load: FloatArray, noise: FloatArray, position_gain: float, velocity_gain: float, effort: float,
) -> FloatArray:  # fmt: skip
    samples = len(reference)
    out = np.zeros((4, samples))
    line = np.zeros(_LONGEST_DELAY + _FINE)
    x = v = table = before = earlier = 0.0
    step, counts = PERIOD / _FINE, 5e-8
    for k in range(samples):
        motor = np.round((x + noise[k, 0]) / counts) * counts
        if k == 0:
            before = earlier = motor
        speed = (motor - earlier) / (2.0 * PERIOD)  # of the mean of two samples, as the lesson's controller
        earlier, before = before, motor
        u = min(10.0, max(-10.0, velocity_gain * (position_gain * (reference[k] - motor) - speed)))
        out[0, k] = motor
        out[1, k] = np.round((table + noise[k, 1]) / counts) * counts
        out[2, k] = u
        late = int(delay[k] / step + 0.5)
        for j in range(_FINE):
            at = k * _FINE + j
            line[at % len(line)] = u
            acting = line[(at - late) % len(line)]
            if j == 0:
                out[3, k] = gain[k] * acting + noise[k, 2]
            force = effort * gain[k] * acting - viscous[k] * v + load[k]
            free = v + step * force / mass[k]
            held = step * friction[k] / mass[k]  # what dry friction takes of the speed in a step, at most all of it
            gained = (0.0 if abs(free) <= held else free - held if free > 0.0 else free + held) - v
            x += step * (v + 0.5 * gained)
            v += gained
            half = 0.5 * play[k]
            table = x - half if x - table > half else x + half if table - x > half else table
    return out


def _leg(way: float, top: float, acceleration: float = 1.0) -> FloatArray:
    """Return positions along a way [m] from rest to rest, at a speed [m/s] and an acceleration [m/s^2], and 0.2 s of rest."""
    ramp = top / acceleration
    cruise = max(0.0, abs(way) / top - ramp)
    speed = np.concatenate(
        [np.linspace(0, top, int(ramp / PERIOD)), np.full(int(cruise / PERIOD), top), np.linspace(top, 0, int(ramp / PERIOD))]
    )
    moved = np.sign(way) * np.cumsum(speed) * PERIOD
    moved *= abs(way) / max(abs(moved[-1]), 1e-12)
    return np.concatenate([moved, np.full(200, moved[-1])])


def _again(lap: FloatArray, seconds: float) -> FloatArray:
    """Return a lap (rows, samples) again and again, so many seconds."""
    laps = int(np.ceil(seconds / PERIOD / lap.shape[1]))
    return np.tile(lap, laps)[:, : round(seconds / PERIOD)]


def axis_reference(seconds: float) -> FloatArray:
    """Return an exercise out and back at four speeds, (1, samples)."""
    place, pieces = 0.0, [np.zeros(300)]
    for way, top in ((0.06, 0.05), (-0.06, 0.05), (0.03, 0.1), (-0.03, 0.1), (0.01, 0.02), (-0.01, 0.02), (0.005, 0.008), (-0.005, 0.008)):
        pieces.append(place + _leg(way, top))
        place += way
    return _again(np.concatenate(pieces)[None], seconds)


def lathe_reference(seconds: float) -> FloatArray:
    """Return passes of a turned part: in, along, out, back; X and Z, (2, samples)."""
    at, pieces = np.zeros(2), [np.zeros((2, 200))]
    moves = [
        (0, -0.012, 0.06),
        (1, -0.05, 0.04),
        (0, 0.004, 0.02),
        (1, 0.05, 0.12),
        (0, -0.006, 0.05),
        (1, -0.03, 0.015),
        (0, 0.014, 0.08),
        (1, 0.03, 0.1),
    ]
    for axis, way, top in moves:
        leg = _leg(way, top)
        both = np.repeat(at[:, None], len(leg), axis=1)
        both[axis] += leg
        at[axis] += way
        pieces.append(both)
    return _again(np.concatenate(pieces, axis=1), seconds)


def _axis(axis: Axis, reference: FloatArray, changes: Changes, noise: FloatArray) -> FloatArray:
    count = len(reference)

    def of(name: str, sound: float) -> FloatArray:
        return np.asarray(changes.get(name, np.full(count, sound)), dtype=np.float64)

    return np.asarray(
        _run(
            reference, axis.mass * of("mass", 1.0), axis.viscous * of("viscous", 1.0), of("friction", 0.0), of("gain", 1.0),
            of("play", 0.0), of("delay", 0.0), of("load", 0.0), noise, axis.position_gain, axis.velocity_gain, axis.effort,
        )
    )  # fmt: skip


def _noise(count: int, seed: int) -> FloatArray:
    return np.random.default_rng(seed).normal(size=(count, 3)) * np.array([3e-8, 3e-8, 2e-3])


def axis(seconds: float, seed: int, changes: Changes) -> FloatArray:
    """Return reference, motor, table, voltage and current of the axis of lesson 22, (5, samples)."""
    wanted = axis_reference(seconds)
    return np.vstack([wanted, _axis(X, wanted[0], changes, _noise(wanted.shape[1], seed))])


def lathe(seconds: float, seed: int, changes: Changes) -> FloatArray:
    """Return both references, then X's motor, table, voltage and current and Z's motor and voltage, (8, samples); X changes."""
    wanted = lathe_reference(seconds)
    x = _axis(X, wanted[0], changes, _noise(wanted.shape[1], seed))
    warm = {"viscous": changes["viscous"]} if "viscous" in changes else {}
    z = _axis(Z, wanted[1], warm, _noise(wanted.shape[1], seed + 100_000))
    return np.vstack([wanted, x, z[[0, 2]]])


def cut(seconds: float, seed: int, changes: Changes) -> FloatArray:
    """Return feed, depth, speed, then main, thrust and feed force of a cut with rests, (6, samples).

    ``chatter`` is zero while the clamp holds; then it is the depth of the deep passes over the border of stability, one value in a stream.
    """
    passes = [
        (0.2e-3, 1e-3, 2.0, 5.0),
        (0.0, 1e-3, 2.0, 1.0),
        (0.1e-3, 1e-3, 2.0, 5.0),
        (0.0, 0.0, 2.0, 1.5),
        (0.3e-3, 0.6e-3, 2.5, 4.0),
        (0.0, 0.6e-3, 2.0, 1.0),
    ]
    lap = np.concatenate([np.repeat(np.array(row[:3])[:, None], int(row[3] / PERIOD), axis=1) for row in passes], axis=1)
    driven = _again(lap, seconds)
    count = driven.shape[1]

    def of(name: str, sound: float) -> FloatArray:
        return np.asarray(changes.get(name, np.full(count, sound)), dtype=np.float64)

    beyond = of("chatter", 0.0)
    edge = PRESSURE * driven[1] * of("hardness", 1.0) * (1.0 + of("wear", 0.0))
    along = SHARE * (1.0 + 0.4 * of("wear", 0.0))
    tools = (CLAMPED, loose(float(beyond.max())) if beyond.any() else CLAMPED)
    main = edge * thickness(driven[0], along * edge, driven[2], tools, beyond, PERIOD)
    thrust = 0.4 * main * (1.0 + 0.6 * of("wear", 0.0))
    feed = along * main
    noise = np.random.default_rng(seed).normal(size=(3, count)) * np.array([[4.0], [3.0], [3.0]])
    outside = of("load", 0.0)
    return np.vstack([driven, main * of("gain", 1.0), thrust + outside, feed]) + np.vstack([0.0 * driven, noise])


def step(seconds: float, at: float, before: float, after: float) -> FloatArray:
    """Return a value that changes at a time [s], (samples,)."""
    return np.where(np.arange(round(seconds / PERIOD)) * PERIOD < at, before, after)


MACHINES = {"axis": axis, "lathe": lathe, "cut": cut}
