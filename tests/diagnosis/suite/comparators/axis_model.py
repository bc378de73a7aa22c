"""A grey box of a feed-drive axis, coded by hand: controller once a sample, plant in three exact steps between, every effect a number.

Free motion over a step h:  v' = v e^(-c h) + (f/m)(1 - e^(-c h))/c,  c = (b + K G E)/m;  dry friction brings v' at most to rest.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from tests.diagnosis.suite.comparators.read_case import PERIOD

STEPS = 3
LIMIT = 10.0


class AxisNumbers(NamedTuple):
    """Numbers of the grey box [SI]; zero (or a huge limit) means absent. Waves are given by their sine and cosine."""

    mass: float = 95.0
    viscous: float = 200.0
    conductance: float = 1.0
    effort_constant: float = 35.0
    back_emf: float = 0.0
    pid: float = 0.0
    position_gain: float = 0.0
    velocity_gain: float = 0.0
    integral_rate: float = 0.0
    mean_share: float = 0.0
    proportional: float = 0.0
    integral: float = 0.0
    derivative_gain: float = 0.0
    coulomb: float = 0.0
    dry: float = 0.0
    dry_difference: float = 0.0
    viscous_difference: float = 0.0
    excess: float = 0.0
    stribeck_velocity: float = 0.005
    level: float = 0.0
    distance: float = 5e-6
    offset: float = 0.0
    spots_sin: float = 0.0
    spots_cos: float = 0.0
    spots_period: float = 0.05
    force_sin: float = 0.0
    force_cos: float = 0.0
    force_period: float = 0.005
    share_sin: float = 0.0
    share_cos: float = 0.0
    share_period: float = 0.005
    width: float = 0.0
    slope: float = 0.0
    pitch_sin: float = 0.0
    pitch_cos: float = 0.0
    lead: float = 0.005
    strain: float = 0.0
    growth_time: float = 20.0
    compliance: float = 0.0
    table_share: float = 0.0
    frequency: float = 100.0
    damping: float = 0.05
    lag: float = 0.0
    loop_time: float = 0.0
    loop_damping: float = 0.7
    half_width: float = 0.0
    saturation: float = 1e9
    converter_offset: float = 0.0
    converter_step: float = 0.0
    delay: float = 0.0
    turn_sin: float = 0.0
    turn_cos: float = 0.0
    turn: float = 0.005
    fine_sin: float = 0.0
    fine_cos: float = 0.0
    fine_period: float = 20e-6
    jump: float = 0.0
    instant: float = 1e9
    coarse: float = 0.0
    factor: float = 0.0


@njit(cache=True, error_model="numpy")
def _wave(sine: float, cosine: float, period: float, place: float) -> float:
    if sine == 0.0 and cosine == 0.0:
        return 0.0
    angle = 2.0 * math.pi * place / period
    return sine * math.sin(angle) + cosine * math.cos(angle)


@njit(cache=True, error_model="numpy")
def simulate_axis_numbers(p: AxisNumbers, reference: np.ndarray, start: float) -> np.ndarray:
    """Return command [V], encoder, scale [m] and current [A] along a reference [m], from rest at ``start``; shape (4, samples)."""
    samples = reference.shape[0]
    out = np.zeros((4, samples))
    h = PERIOD / STEPS
    x, v, xt, vt = start, 0.0, start, 0.0
    before, mean_before, total, error_before = start, start, 0.0, 0.0
    current, rate, bristle, behind = 0.0, 0.0, 0.0, start
    held = np.zeros(samples)
    gain = p.effort_constant * p.conductance
    feedback = p.back_emf if p.lag == 0.0 and p.loop_time == 0.0 else 0.0
    two = p.table_share > 0.0
    motor, table = p.mass * (1.0 - p.table_share), p.mass * p.table_share
    stiffness = table * (2.0 * math.pi * p.frequency) ** 2
    damper = 2.0 * p.damping * table * 2.0 * math.pi * p.frequency
    body = table if two else p.mass
    decay = (p.viscous + (0.0 if two else gain * feedback)) / body
    keep, weight = math.exp(-decay * h), (h if decay * h < 1e-9 else (1.0 - math.exp(-decay * h)) / decay) / body
    slow = math.exp(-h / p.lag) if p.lag > 0.0 else 0.0
    for k in range(samples):
        now = k * PERIOD
        reading = x + _wave(p.turn_sin, p.turn_cos, p.turn, x) + _wave(p.fine_sin, p.fine_cos, p.fine_period, x)
        reading += p.jump if now >= p.instant else 0.0
        if p.coarse > 0.0:
            reading = p.coarse * math.floor(reading / p.coarse + 0.5)
        # the controller
        if p.pid > 0.5:
            error = reference[k] - reading
            slope = 0.0 if k == 0 else (error - error_before) / PERIOD
            summed = total + error * PERIOD
            command = p.proportional * error + p.integral * summed + p.derivative_gain * slope
            if abs(command) > LIMIT and command * p.integral * error > 0.0:
                summed = total
                command = p.proportional * error + p.integral * summed + p.derivative_gain * slope
            total, error_before = summed, error
            command = min(max(command, -LIMIT), LIMIT)
        else:
            if k == 0:
                before, mean_before = reading, reading
            mean = (1.0 - p.mean_share) * reading + p.mean_share * before
            speed_error = p.position_gain * (reference[k] - reading) - (mean - mean_before) / PERIOD
            summed = total + p.velocity_gain * p.integral_rate * PERIOD * speed_error
            command = p.velocity_gain * speed_error + summed
            before, mean_before = reading, mean
            if abs(command) > LIMIT:
                command = LIMIT if command > 0.0 else -LIMIT
            else:
                total = summed
        acting = command
        if p.converter_step > 0.0:
            acting = p.converter_step * math.floor(acting / p.converter_step + 0.5)
        held[k] = acting + p.converter_offset
        for step in range(STEPS):
            # the command as it arrives, its mean over the step
            volts = held[k]
            if p.delay > 0.0:
                late = (step * h - p.delay) / PERIOD + k
                row = math.floor(late + 1e-12)
                rest = min((row + 1 - late) * STEPS, 1.0)
                first = held[row] if row >= 0 else 0.0
                second = held[row + 1] if 0 <= row + 1 <= k else first
                volts = rest * first + (1.0 - rest) * second
            if p.half_width > 0.0:
                volts = math.copysign(max(abs(volts) - p.half_width, 0.0), volts)
            volts = min(max(volts, -p.saturation), p.saturation)
            wanted = p.conductance * (volts - p.back_emf * v)
            if p.lag > 0.0:
                after = wanted + (current - wanted) * slow
                push = p.effort_constant * 0.5 * (after + current)
                current = after
            elif p.loop_time > 0.0:
                rate += h * ((wanted - current) / p.loop_time - 2.0 * p.loop_damping * rate) / p.loop_time
                current += h * rate
                push = p.effort_constant * current
            else:
                current = wanted
                push = gain * volts if not two else p.effort_constant * wanted
            if step == 0:
                out[0, k] = command
                out[1, k] = reading
                load = p.effort_constant * current
                place = xt if two else x
                if p.width > 0.0:
                    behind = min(max(behind, place - 0.5 * p.width), place + 0.5 * p.width)
                    place = behind
                place += p.slope * place + _wave(p.pitch_sin, p.pitch_cos, p.lead, place) - p.compliance * load
                place += p.strain * (1.0 - math.exp(-now / p.growth_time)) * place
                out[2, k] = place * (1.0 + p.factor)
                out[3, k] = current
            elif p.width > 0.0:
                place = xt if two else x
                behind = min(max(behind, place - 0.5 * p.width), place + 0.5 * p.width)
            place, speed = x, v
            if two:
                spring = stiffness * (x - xt) + damper * (v - vt)
                v += h * (push - spring) / motor
                x += h * v
                push, place, speed = spring, xt, vt
            push -= p.offset + p.viscous_difference * abs(speed) + _wave(p.force_sin, p.force_cos, p.force_period, place)
            push -= p.effort_constant * current * _wave(p.share_sin, p.share_cos, p.share_period, place)
            if p.level > 0.0:
                old = bristle
                bristle = (old + h * speed) / (1.0 + h * abs(speed) / p.distance)
                stiff = p.level / p.distance
                push -= stiff * bristle + 0.3 * math.sqrt(stiff * p.mass) * (bristle - old) / h
            free = speed * keep + push * weight
            sign = 1.0 if free > 0.0 else -1.0
            level = p.coulomb + p.dry + p.dry_difference * sign
            if p.excess != 0.0:
                level += p.excess * math.exp(-abs(speed) / p.stribeck_velocity)
            if p.spots_sin != 0.0 or p.spots_cos != 0.0:
                level += math.hypot(p.spots_sin, p.spots_cos) + _wave(p.spots_sin, p.spots_cos, p.spots_period, place)
            grip = max(level, 0.0) * weight
            after = 0.0 if abs(free) <= grip else free - sign * grip
            place += 0.5 * h * (speed + after)
            if two:
                xt, vt = place, after
            else:
                x, v = place, after
        if not abs(x) < 1e3:
            out[:, k:] = np.nan
            break
    return out
