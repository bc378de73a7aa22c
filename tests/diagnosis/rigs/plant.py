"""The plant of the rigs: converter, amplifier, motor, transmission and load, in short semi-implicit Euler steps.

It shares no code with the program under test. Dry friction takes what would stop the shaft within a step, at most its level (V. Acary,
B. Brogliato, Numerical Methods for Nonsmooth Dynamical Systems, 2008, chapter 1). Bristles follow P. R. Dahl (1968): dz/dt = v - |v| z/d.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

OPEN, PID, PID_MEASURED, FEED_FORWARD, CASCADE, INTEGRAL_PROPORTIONAL, SPEED = -1.0, 0.0, 1.0, 2.0, 3.0, 4.0, 5.0
RANGE = 10.0
COMMAND, HELD, CURRENT, ENCODER, SCALE = range(5)
"""Rows of what :func:`run` returns."""


class Physics(NamedTuple):
    """Numbers [SI] on the motor's shaft unless a name says otherwise; what is zero, or a huge limit, is absent.

    ``ratio`` is the travel of the load [m or rad] per radian of the shaft. A linear motor has a ratio of 1: its shaft is its slide.
    """

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
    gain: float
    integral: float = 0.0
    derivative: float = 0.0
    velocity_gain: float = 0.0
    feed_forward: float = 0.0
    bits: float = 12.0
    encoder: float = 1e-6
    encoder_noise: float = 0.0
    scale: float = 0.0
    current_noise: float = 0.0
    current_step: float = 0.0
    weight: float = 0.0
    # hidden in some cases
    coulomb: float = 0.0
    asymmetry: float = 0.0
    one_way_viscous: float = 0.0
    stribeck: float = 0.0
    stribeck_speed: float = 1.0
    tight: float = 0.0
    tight_period: float = 1.0
    bristle: float = 0.0
    bristle_travel: float = 1.0
    offset_torque: float = 0.0
    warmed_viscous: float = 0.0
    warm_time: float = 1.0
    current_limit: float = 1e9
    slew: float = 0.0
    sag: float = 0.0
    converter_offset: float = 0.0
    dead_zone: float = 0.0
    delay: float = 0.0
    lag: float = 0.0
    current_filter: float = 0.0
    cogging: float = 0.0
    cogging_period: float = 1.0
    interpolation: float = 0.0
    signal_period: float = 1.0
    backlash: float = 0.0
    pitch: float = 0.0
    pitch_period: float = 1.0
    lead_error: float = 0.0
    growth: float = 0.0
    growth_time: float = 1.0
    wind_up: float = 0.0
    pushed: float = 0.0
    pushed_from: float = 0.0
    shaken: float = 0.0
    shaken_rate: float = 1.0
    buffer: float = 0.0
    buffer_from: float = 0.0
    drag: float = 0.0
    spring: float = 0.0


@njit(cache=True)
def _rounded(value: float, step: float) -> float:
    return step * math.floor(value / step + 0.5) if step > 0.0 else value


@njit(cache=True)
def _converted(voltage: float, bits: float) -> float:
    if bits > 30.0:
        return min(max(voltage, -RANGE), RANGE)
    step = 2.0 * RANGE / (2.0**bits - 1.0)
    return min(-RANGE + _rounded(voltage + RANGE, step), RANGE)


@njit(cache=True)
def _wanted(p: Physics, asked: float, read: float, now: np.ndarray, first: bool) -> float:
    """The control law; ``now`` keeps 0 the reading, 1 the error, 2 the sum, 3 the set-point, 4 the mean reading of the sample before."""
    if p.law == OPEN:
        return asked
    if first:
        now[0], now[1], now[3], now[4] = read, asked - read, asked, read
    moved, course = (read - now[0]) / p.period, (asked - now[3]) / p.period
    actual = 0.0 if first and p.law == SPEED else moved
    error = asked - actual if p.law == SPEED else asked - read
    mean = 0.5 * (read + now[0])
    direct, part = p.gain * error, p.integral * error * p.period
    if p.law == CASCADE or p.law == INTEGRAL_PROPORTIONAL:
        speed_error = p.gain * error + p.feed_forward * course - (mean - now[4]) / p.period
        part = p.velocity_gain * p.integral * speed_error * p.period
        direct = p.velocity_gain * speed_error
        if p.law == INTEGRAL_PROPORTIONAL:
            direct = -p.velocity_gain * (mean - now[4]) / p.period
    elif p.law == PID_MEASURED:
        direct -= p.derivative * moved
    else:
        direct += p.derivative * (error - now[1]) / p.period
        if p.law == FEED_FORWARD:
            direct += p.feed_forward * course
    told = direct + now[2] + part
    if abs(told) > RANGE and told * part > 0.0:
        told = direct + now[2]
    else:
        now[2] += part
    now[0], now[1], now[3], now[4] = read, error, asked, mean
    return min(max(told, -RANGE), RANGE)


@njit(cache=True)
def _friction(p: Physics, speed: float, place: float, stop: float) -> float:
    """What the dry friction takes: ``stop`` would bring the shaft to rest in this step."""
    level = p.coulomb * (1.0 + math.copysign(p.asymmetry, stop)) + p.stribeck * math.exp(-abs(speed) / p.stribeck_speed)
    level += p.tight * math.sin(2.0 * math.pi * place / p.tight_period)
    return min(max(stop, -level), level)


@njit(cache=True)
def _outer(p: Physics, time: float, place: float, speed: float) -> float:
    """All torques against the motion but dry friction and what is recorded as a load."""
    drag = p.viscous + p.warmed_viscous * (1.0 - math.exp(-time / p.warm_time))
    against = (
        drag * speed
        + p.one_way_viscous * abs(speed)
        + p.weight
        + p.offset_torque
        + p.cogging * math.sin(2.0 * math.pi * place / p.cogging_period)
    )
    if p.pushed != 0.0 and time > p.pushed_from:
        against += p.pushed
    against += p.shaken * math.sin(2.0 * math.pi * p.shaken_rate * time) + p.drag * speed * abs(speed) + p.spring * place**3
    return against + p.buffer * max(place - p.buffer_from, 0.0)


@njit(cache=True)
def _scale(p: Physics, time: float, place: float, behind: float, torque: float) -> float:
    longer = p.lead_error + p.growth * (1.0 - math.exp(-time / p.growth_time))
    seen = behind + longer * place + p.pitch * math.sin(2.0 * math.pi * place / p.pitch_period) - p.wind_up * torque
    return _rounded(seen, p.scale)


@njit(cache=True)
def _given(p: Physics, late: float, slewed: float, h: float) -> float:
    """The voltage that the amplifier acts on."""
    given = late + p.converter_offset
    if p.dead_zone > 0.0:
        given = math.copysign(max(abs(given) - p.dead_zone, 0.0), given)
    given *= 1.0 - p.sag * abs(given)
    return min(max(given, slewed - p.slew * h), slewed + p.slew * h) if p.slew > 0.0 else given


@njit(cache=True)
def run(p: Physics, asked: np.ndarray, load: np.ndarray, chance: np.ndarray, fine: int, added: np.ndarray) -> np.ndarray:
    """Return rows of command, converter's voltage, current, encoder and scale at the sample instants.

    ``asked`` is a position [m or rad] or a speed of the load, or the voltage of an open loop; ``load`` a torque on the shaft, ``chance``
    two rows of normal numbers, ``added`` a voltage that somebody adds to the command. Both position sensors are latched before the
    converter takes the new command: the shaft is twisted by the torque until then.
    """
    samples, h = len(asked), p.period / fine
    out, now = np.zeros((5, samples)), np.zeros(5)
    line = np.zeros(math.ceil(p.delay / h) + 1)
    speed, angle, current, behind, given, bent, shown, torque, tick = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0
    for k in range(samples):
        place, twisting = p.ratio * angle, torque - p.viscous * speed
        read = place + p.interpolation * math.sin(2.0 * math.pi * place / p.signal_period)
        read = _rounded(read + p.encoder_noise * chance[0, k], p.encoder)
        command = _wanted(p, asked[k], read, now, k == 0) + added[k]
        held = _converted(command, p.bits)
        for step in range(fine + 1):
            time, place = (k * fine + max(step - 1, 0)) * h, p.ratio * angle
            line[tick % len(line)] = held
            given = _given(p, line[(tick + 1) % len(line)], given, h if step else 0.0)
            steady = (p.amplifier * (given - p.tachometer * speed) - p.voltage_constant * speed) / p.resistance
            if p.lag == 0.0:
                current = steady
            elif step:
                current += h / p.lag * (steady - current)
            current = min(max(current, -p.current_limit), p.current_limit)
            torque = p.torque_constant * current
            if step == 0:
                behind = min(max(behind, place - 0.5 * p.backlash), place + 0.5 * p.backlash)
                shown = current if p.current_filter == 0.0 else shown
                out[COMMAND, k], out[HELD, k], out[ENCODER, k] = command, held, read
                out[CURRENT, k] = _rounded(shown + p.current_noise * chance[1, k], p.current_step)
                out[SCALE, k] = _scale(p, time, place, behind, twisting)
                continue
            if p.current_filter > 0.0:
                shown += h / p.current_filter * (current - shown)
            pushed = torque - _outer(p, time, place, speed) - load[k] - p.bristle * bent
            pushed -= _friction(p, speed, place, pushed + p.inertia * speed / h)
            speed += h / p.inertia * pushed
            bent += h * p.ratio * (speed - abs(speed) * bent) / p.bristle_travel
            angle += h * speed
            behind = min(max(behind, p.ratio * angle - 0.5 * p.backlash), p.ratio * angle + 0.5 * p.backlash)
            tick += 1
    return out
