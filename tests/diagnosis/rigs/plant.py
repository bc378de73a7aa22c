"""The plant of the rigs: converter, amplifier with limit and tachometer loop, DC motor, transmission, load; stepped by small Euler steps.

It is written in what stands on the motor's shaft, and shares no code with the program under test. Dry friction is set-valued: what would
bring the shaft to rest within the step, at most its level. Source of that step: V. Acary, B. Brogliato, Numerical Methods for Nonsmooth
Dynamical Systems (2008), chapter 1.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

RANGE = 10.0
P, PID, CASCADE, OPEN = 0.0, 1.0, 2.0, 3.0


class Physics(NamedTuple):
    """Numbers of a rig [SI], of the motor's shaft unless a name says otherwise; zero, or a huge limit, means absent."""

    inertia: float
    viscous: float
    ratio: float
    resistance: float
    amplifier: float
    torque_constant: float
    voltage_constant: float
    tachometer: float
    period: float
    law: float
    proportional: float = 0.0
    integral: float = 0.0
    derivative: float = 0.0
    position_gain: float = 0.0
    velocity_gain: float = 0.0
    integral_rate: float = 0.0
    bits: float = 12.0
    encoder: float = 1e-6
    encoder_noise: float = 0.0
    scale: float = 1e-6
    current_noise: float = 0.0
    current_step: float = 0.0
    current_limit: float = 1e9
    # hidden in some cases
    coulomb: float = 0.0
    stribeck: float = 0.0
    stribeck_speed: float = 1.0
    offset_torque: float = 0.0
    converter_offset: float = 0.0
    dead_zone: float = 0.0
    delay: float = 0.0
    inductance_time: float = 0.0
    cogging: float = 0.0
    cogging_turn: float = 1.0
    backlash: float = 0.0
    pitch: float = 0.0
    pitch_turn: float = 1.0
    drag: float = 0.0
    spring: float = 0.0


@njit(cache=True)
def _level(voltage: float, bits: float) -> float:
    quantum = 2.0 * RANGE / (2.0**bits - 1.0)
    clipped = min(max(voltage, -RANGE), RANGE)
    return -RANGE + math.floor((clipped + RANGE) / quantum + 0.5) * quantum


@njit(cache=True)
def _rounded(value: float, step: float) -> float:
    return step * math.floor(value / step + 0.5) if step > 0.0 else value


@njit(cache=True)
def _command(p: Physics, reference: float, measured: float, memory: np.ndarray, first: bool) -> float:
    """The control law; memory: 0 error before, 1 sum, 2 measured before, 3 mean before."""
    if p.law == OPEN:
        return reference
    if p.law < CASCADE:
        error = reference - measured
        slope = 0.0 if first else (error - memory[0]) / p.period
        total = memory[1] + error * p.period
        wanted = p.proportional * error + p.integral * total + p.derivative * slope
        if abs(wanted) > RANGE and wanted * p.integral * error > 0.0:
            total = memory[1]
            wanted = p.proportional * error + p.integral * total + p.derivative * slope
        memory[0], memory[1] = error, total
        return min(max(wanted, -RANGE), RANGE)
    if first:
        memory[2], memory[3] = measured, measured
    mean = 0.5 * (measured + memory[2])
    speed_error = p.position_gain * (reference - measured) - (mean - memory[3]) / p.period
    summed = memory[1] + p.velocity_gain * p.integral_rate * p.period * speed_error
    wanted = p.velocity_gain * speed_error + summed
    memory[2], memory[3] = measured, mean
    if abs(wanted) > RANGE:
        return RANGE if wanted > 0.0 else -RANGE
    memory[1] = summed
    return wanted


@njit(cache=True)
def run(p: Physics, reference: np.ndarray, load: np.ndarray, chance: np.ndarray, fine: int, added: np.ndarray) -> np.ndarray:
    """Return rows of command, converter's voltage, current, encoder, scale and speed of the load at the sample instants.

    ``reference`` is a position, or the voltage of an open loop; ``load`` a torque on the shaft; ``chance`` two rows of normal numbers;
    ``added`` a voltage that somebody adds to the command.
    """
    samples, h = len(reference), p.period / fine
    out = np.zeros((6, samples))
    memory = np.zeros(4)
    late = np.zeros(math.ceil(p.delay / h) + 1)
    speed, angle, current, behind, tick = 0.0, 0.0, 0.0, 0.0, 0
    for k in range(samples):
        place = p.ratio * angle
        measured = _rounded(place + p.encoder_noise * chance[0, k], p.encoder)
        command = _command(p, reference[k], measured, memory, k == 0) + added[k]
        held = _level(command, p.bits) if p.law != OPEN else command
        for step in range(fine + 1):
            late[tick % len(late)] = held
            given = late[(tick + 1) % len(late)] + p.converter_offset
            if p.dead_zone > 0.0:
                given = math.copysign(max(abs(given) - p.dead_zone, 0.0), given)
            wanted = (p.amplifier * (given - p.tachometer * speed) - p.voltage_constant * speed) / p.resistance
            if p.inductance_time > 0.0:
                if step > 0:
                    current += h / p.inductance_time * (wanted - current)
            else:
                current = wanted
            current = min(max(current, -p.current_limit), p.current_limit)
            if step == 0:
                place = p.ratio * angle
                half = 0.5 * p.backlash
                behind = min(max(behind, place - half), place + half)
                table = behind + p.pitch * math.sin(2.0 * math.pi * place / p.pitch_turn)
                out[0, k], out[1, k] = command, held
                out[2, k] = _rounded(current + p.current_noise * chance[1, k], p.current_step)
                out[3, k], out[4, k], out[5, k] = measured, _rounded(table, p.scale), p.ratio * speed
                continue
            place = p.ratio * angle
            pushed = p.torque_constant * current - p.viscous * speed - p.offset_torque - load[k]
            pushed -= p.cogging * math.sin(2.0 * math.pi * place / p.cogging_turn) + p.drag * speed * abs(speed) + p.spring * place**3
            level = p.coulomb + p.stribeck * math.exp(-abs(speed) / p.stribeck_speed)
            stop = pushed + p.inertia * speed / h
            speed += h / p.inertia * (pushed - min(max(stop, -level), level))
            angle += h * speed
            behind = min(max(behind, p.ratio * angle - 0.5 * p.backlash), p.ratio * angle + 0.5 * p.backlash)
            tick += 1
    return out
