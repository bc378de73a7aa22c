"""Machines of another structure: cascade of P and PI loops, motor and table on a spring, friction on both sides, play at the scale.

Nothing here comes from the program under test, its part programs apart: these are read by a few lines of their own. Two ways of
interpolation are drawn: blocks that stop at their end, and blocks that run into each other under a moving average.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numba import njit

FINE = 5


@dataclass(frozen=True)
class Axis:
    """Numbers of one axis [SI]; with ``scale_in_loop`` the position loop is closed over the table."""

    motor: float
    table: float
    stiffness: float
    damping: float
    position_gain: float
    speed_gain: float
    integral_rate: float
    motor_friction: float
    table_friction: float
    viscous: float
    play: float
    scale_in_loop: bool


@dataclass(frozen=True)
class Machine:
    """Two axes behind one interpolator: its period [s], acceleration, jerk, and the rest after each block [s]."""

    x: Axis
    z: Axis
    period: float
    acceleration: float
    jerk: float
    rest: float


def drawn_machine(seed: int) -> Machine:
    """Return a machine drawn by its seed."""
    rng = np.random.default_rng([seed, 77])

    def axis() -> Axis:
        mass, share = float(rng.uniform(50.0, 150.0)), float(rng.uniform(0.3, 0.7))
        motor, table = mass * (1.0 - share), mass * share
        swing, loop = 2.0 * np.pi * float(rng.uniform(15.0, 80.0)), float(rng.uniform(100.0, 250.0))
        stiffness = swing**2 * motor * table / mass
        return Axis(
            motor, table, stiffness, 2.0 * float(rng.uniform(0.03, 0.1)) * np.sqrt(stiffness * motor * table / mass),
            float(rng.uniform(10.0, 40.0)), 0.6 * loop * mass, float(rng.uniform(5.0, 40.0)), float(rng.uniform(0.0, 20.0)),
            float(rng.uniform(0.0, 10.0)), float(rng.uniform(0.0, 200.0)), float(rng.choice([0.0, 0.0, 5e-6, 15e-6, 30e-6])),
            bool(rng.random() < 0.5),
        )  # fmt: skip

    x, z = axis(), axis()
    rest = float(rng.choice([0.0, 0.0, 8e-3, 20e-3]))
    return Machine(
        x, z, float(rng.choice([1e-3, 2e-3, 4e-3])), float(rng.choice([0.3, 0.5, 1.0, 2.0])), float(rng.choice([5.0, 20.0, 50.0])), rest
    )


def blocks_of(program: Path) -> list[tuple[float, float, float, float]]:
    """Return the blocks of a program in millimetres and radii: end x, end z [m], feed [m/s], dwell [s]. Arcs are no part of it."""
    found = []
    x = z = feed = 0.0
    for line in program.read_text(encoding="utf-8").splitlines():
        words = dict(re.findall(r"([A-Z])(-?[\d.]+)", re.sub(r"\(.*?\)", "", line)))
        if words.get("G") in ("2", "3"):
            raise ValueError(f"{program}: arcs are not read here")
        if line.startswith("G4"):
            found.append((x, z, feed, float(words["P"])))
        elif "X" in words or "Z" in words:
            feed = float(words["F"]) / 6e4 if "F" in words else feed
            x, z = float(words.get("X", 1e3 * x)) / 1e3, float(words.get("Z", 1e3 * z)) / 1e3
            found.append((x, z, feed, 0.0))
    return found


def references(program: Path, machine: Machine) -> tuple[np.ndarray, np.ndarray]:
    """Return the references of both axes [m] at 1 kHz."""
    period, width = machine.period, max(1, round(machine.acceleration / machine.jerk / machine.period))
    xs, zs = [0.0], [0.0]
    x = z = 0.0
    for end_x, end_z, feed, dwell in blocks_of(program):
        length = float(np.hypot(end_x - x, end_z - z))
        if length > 0.0:
            peak = min(feed, np.sqrt(length * machine.acceleration))
            ramp = peak / machine.acceleration
            whole = length / peak + ramp
            time = np.arange(1, int(np.ceil(whole / period - 1e-9)) + 1) * period
            level = 0.5 * machine.acceleration * np.minimum(time, ramp) ** 2 + peak * np.clip(time - ramp, 0.0, whole - 2.0 * ramp)
            late = np.clip(time - (whole - ramp), 0.0, ramp)
            way = np.minimum(level + peak * late - 0.5 * machine.acceleration * late**2, length) / length
            xs += list(x + (end_x - x) * way)
            zs += list(z + (end_z - z) * way)
        count = int(np.ceil((dwell + (machine.rest if length > 0.0 else 0.0)) / period - 1e-9))
        x, z = end_x, end_z
        xs += [x] * count
        zs += [z] * count
    still = round(1.0 / period)
    every = round(period / 1e-3)
    held = []
    for row, end in ((xs, x), (zs, z)):
        padded = np.concatenate([np.full(width - 1, row[0]), row, np.full(still, end)])
        held.append(np.repeat(np.convolve(padded, np.ones(width) / width, mode="valid"), every))
    return held[0], held[1]


@njit(cache=True)
def _followed(  # type: ignore[no-untyped-def]
    reference, motor, table, stiffness, damping, position_gain, speed_gain, integral_rate, motor_friction, table_friction, viscous, play,
    scale_in_loop,
):  # fmt: skip
    read = np.zeros(len(reference))
    h = 1e-3 / FINE
    x = v = xt = vt = summed = seen = 0.0
    for k in range(len(reference)):
        read[k] = seen
        for _ in range(FINE):
            error = reference[k] - (xt if scale_in_loop else x)
            speed_error = position_gain * error - v
            summed += integral_rate * speed_error * h
            force = speed_gain * (speed_error + summed)
            spring = stiffness * (x - xt) + damping * (v - vt)
            v += h * (force - viscous * v - motor_friction * np.tanh(v / 1e-4) - spring) / motor
            x += h * v
            vt += h * (spring - table_friction * np.tanh(vt / 1e-4)) / table
            xt += h * vt
            if xt - seen > 0.5 * play:
                seen = xt - 0.5 * play
            elif seen - xt > 0.5 * play:
                seen = xt + 0.5 * play
    return read


def followed(reference: np.ndarray, axis: Axis) -> np.ndarray:
    """Return what the scale reads [m] at 1 kHz while the axis follows a reference."""
    return np.asarray(
        _followed(
            reference, axis.motor, axis.table, axis.stiffness, axis.damping, axis.position_gain, axis.speed_gain, axis.integral_rate,
            axis.motor_friction, axis.table_friction, axis.viscous, axis.play, axis.scale_in_loop,
        )
    )  # fmt: skip


def waypoints(program: Path, machine: Machine, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return uneven times [s] at 10 Hz, and where the machine is at them [m] (2, times), without and with noise and rounding."""
    rng = np.random.default_rng([seed, 78])
    places = np.array([followed(row, axis) for row, axis in zip(references(program, machine), (machine.x, machine.z), strict=True)])
    time = np.arange(0.0, 1e-3 * places.shape[1] - 0.05, 0.1)
    time = time + rng.uniform(0.0, 0.03, len(time))
    clean = np.array([np.interp(time, 1e-3 * np.arange(places.shape[1]), row) for row in places])
    return time, clean, np.round(clean + rng.normal(0.0, 10e-6, clean.shape), 6)
