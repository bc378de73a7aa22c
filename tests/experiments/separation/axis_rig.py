"""The axis of the truth: sampled control at 1 kHz around a plant stepped at 20 us by semi-implicit Euler with set-valued friction.

Source of the friction step: Acary, Brogliato, Numerical Methods for Nonsmooth Dynamical Systems (2008), ch. 1 (implicit Coulomb friction);
bristles: Canudas de Wit et al., IEEE Trans. Automatic Control 40 (1995).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit

SAMPLE_PERIOD = 1e-3
FINE_STEPS = 125
VOLTAGE_LIMIT = 10.0


class AxisPhysics(NamedTuple):
    """Everything the axis may carry, in SI numbers; zero (or a huge limit) means absent. Floats only, for the compiled loop."""

    # plant and drive
    mass: float = 95.0
    viscous: float = 200.0
    effort_constant: float = 35.0
    # controller: a cascade
    position_gain: float = 40.0
    velocity_gain: float = 300.0
    # converter and sensors
    converter_bits: float = 12.0
    encoder_resolution: float = 1e-7
    scale_resolution: float = 1e-7
    encoder_noise: float = 5e-8
    scale_noise: float = 5e-8
    current_noise: float = 0.01
    current_resolution: float = 0.005
    # friction: Coulomb and Stribeck by implicit stick, LuGre bristles, a wave over the way, or none
    coulomb: float = 0.0
    coulomb_asymmetry: float = 0.0
    viscous_asymmetry: float = 0.0
    stribeck_excess: float = 0.0
    stribeck_speed: float = 0.005
    stribeck_shape: float = 1.0
    lugre_level: float = 0.0
    lugre_stiffness: float = 0.0
    lugre_damping: float = 0.0
    friction_wave: float = 0.0
    friction_wave_period: float = 0.1
    friction_wave_phase: float = 0.0
    # forces
    force_offset: float = 0.0
    ripple: float = 0.0
    ripple_share: float = 0.0
    ripple_period: float = 0.005
    ripple_phase: float = 0.0
    # geometry seen by the scale
    backlash: float = 0.0
    backlash_start: float = 0.0
    pitch_slope: float = 0.0
    pitch_wave: float = 0.0
    lead: float = 0.005
    pitch_phase: float = 0.0
    growth_strain: float = 0.0
    growth_time: float = 60.0
    growth_origin: float = 0.0
    wind_up: float = 0.0
    # structure
    table_share: float = 0.0
    table_frequency: float = 100.0
    table_damping: float = 0.05
    # drive
    inductance_time: float = 0.0
    current_loop_frequency: float = 0.0
    current_loop_damping: float = 0.7
    dead_zone: float = 0.0
    converter_offset: float = 0.0
    coarse_step: float = 0.0
    delay: float = 0.0
    # encoder
    eccentricity: float = 0.0
    eccentricity_turn: float = 0.005
    eccentricity_phase: float = 0.0


@dataclass(frozen=True)
class AxisSignals:
    """What the axis did: ``command`` [V], ``encoder``, ``scale`` [m], ``current`` [A]; (samples,)."""

    command: np.ndarray
    encoder: np.ndarray
    scale: np.ndarray
    current: np.ndarray


def simulate_axis(physics: AxisPhysics, reference: np.ndarray, noise: np.ndarray, load: np.ndarray) -> AxisSignals:
    """Run the axis along ``reference`` [m] with sensor noise (standard normal, (3, samples)) and a load force [N] at each sample."""
    return AxisSignals(*_simulate(physics, reference, noise, load))


@njit(cache=True)
def _rounded(value: float, quantum: float) -> float:
    return value if quantum <= 0.0 else quantum * math.floor(value / quantum + 0.5)


@njit(cache=True)
def _sliding_level(p: AxisPhysics, speed: float, position: float, sign: float) -> float:
    """Size of the dry friction when sliding with ``sign`` at ``speed``."""
    level = p.coulomb * (1.0 + p.coulomb_asymmetry * sign)
    if p.stribeck_excess > 0.0:
        level += p.stribeck_excess * math.exp(-((abs(speed) / p.stribeck_speed) ** p.stribeck_shape))
    if p.friction_wave > 0.0:
        level += p.friction_wave * (1.0 + math.sin(2.0 * math.pi * position / p.friction_wave_period + p.friction_wave_phase))
    return max(level, 0.0)


@njit(cache=True)
def _smooth_force(p: AxisPhysics, x: float, v: float, applied: float) -> float:
    """Forces against positive motion that do not stick."""
    wave = math.sin(2.0 * math.pi * x / p.ripple_period + p.ripple_phase)
    return p.viscous_asymmetry * abs(v) + p.force_offset + (p.ripple + p.ripple_share * applied) * wave


@njit(cache=True)
def _controller(p: AxisPhysics, reference: float, measured: float, memory: np.ndarray, first: bool) -> float:
    """Cascade; memory: 0 last measured, 1 last mean of two."""
    if first:
        memory[:] = measured
    mean = 0.5 * measured + 0.5 * memory[0]
    command = p.velocity_gain * (p.position_gain * (reference - measured) - (mean - memory[1]) / SAMPLE_PERIOD)
    memory[0], memory[1] = measured, mean
    return min(max(command, -VOLTAGE_LIMIT), VOLTAGE_LIMIT)


@njit(cache=True)
def _encoder_error(p: AxisPhysics, x: float) -> float:
    return p.eccentricity * math.sin(2.0 * math.pi * x / p.eccentricity_turn + p.eccentricity_phase)


@njit(cache=True)
def _scale_error(p: AxisPhysics, x: float, applied: float, time: float) -> float:
    angle = 2.0 * math.pi * x / p.lead + p.pitch_phase
    error = p.pitch_slope * x + p.pitch_wave * math.sin(angle) - p.wind_up * applied
    return error + p.growth_strain * (1.0 - math.exp(-time / p.growth_time)) * (x - p.growth_origin)


@njit(cache=True)
def _followed(table: float, motor: float, half: float) -> float:
    """Table position behind a play of half width ``half``."""
    gap = motor - table
    return motor - half if gap > half else (motor + half if gap < -half else table)


@njit(cache=True)
def _simulate(p: AxisPhysics, reference: np.ndarray, noise: np.ndarray, load: np.ndarray) -> np.ndarray:
    samples = reference.shape[0]
    out = np.zeros((4, samples))
    h = SAMPLE_PERIOD / FINE_STEPS
    memory = np.zeros(2)
    commands = np.zeros(samples)
    quantum = 20.0 / (2.0**p.converter_bits - 1.0)
    motor_mass = p.mass * (1.0 - p.table_share)
    table_mass = p.mass * p.table_share
    stiffness = table_mass * (2.0 * math.pi * p.table_frequency) ** 2
    damping = 2.0 * p.table_damping * table_mass * 2.0 * math.pi * p.table_frequency
    x, v, xt, vt = 0.0, 0.0, 0.0, 0.0
    current, loop_rate, bristle = 0.0, 0.0, 0.0
    behind = p.backlash_start * 0.5 * p.backlash
    wc = 2.0 * math.pi * p.current_loop_frequency
    decay = math.exp(-h / p.inductance_time) if p.inductance_time > 0.0 else 0.0
    for k in range(samples):
        time = k * SAMPLE_PERIOD
        reading = _rounded(x + _encoder_error(p, x) + p.encoder_noise * noise[0, k], p.encoder_resolution)
        command = _controller(p, reference[k], reading, memory, k == 0)
        held = command
        if p.converter_bits < 30.0:
            held = -VOLTAGE_LIMIT + math.floor((command + VOLTAGE_LIMIT) / quantum + 0.5) * quantum
        commands[k] = _rounded(held, p.coarse_step) + p.converter_offset
        for fine in range(FINE_STEPS):
            now = time + fine * h
            back = (now - p.delay) / SAMPLE_PERIOD
            volts = commands[k] if p.delay <= 0.0 else (commands[math.floor(back + 1e-9)] if back >= 0.0 else 0.0)
            if p.dead_zone > 0.0:
                volts = volts - p.dead_zone if volts > p.dead_zone else (volts + p.dead_zone if volts < -p.dead_zone else 0.0)
            read_current = current
            if p.inductance_time > 0.0:
                current = volts + (current - volts) * decay
            elif wc > 0.0:
                bend = wc * wc * (volts - current) - 2.0 * p.current_loop_damping * wc * loop_rate
                ahead, rate_ahead = current + h * loop_rate, loop_rate + h * bend
                bend_ahead = wc * wc * (volts - ahead) - 2.0 * p.current_loop_damping * wc * rate_ahead
                current += 0.5 * h * (loop_rate + rate_ahead)
                loop_rate += 0.5 * h * (bend + bend_ahead)
            else:
                read_current = current = volts
            force = p.effort_constant * current
            if fine == 0:
                place = xt if p.table_share > 0.0 else x
                if p.backlash > 0.0:
                    behind = _followed(behind, place, 0.5 * p.backlash)
                    place = behind
                seen = place + _scale_error(p, place, force, time)
                out[0, k] = command
                out[1, k] = reading
                out[2, k] = _rounded(seen + p.scale_noise * noise[1, k], p.scale_resolution)
                out[3, k] = _rounded(read_current + p.current_noise * noise[2, k], p.current_resolution)
            if p.backlash > 0.0:
                behind = _followed(behind, xt if p.table_share > 0.0 else x, 0.5 * p.backlash)
            share = fine / FINE_STEPS
            pushed = load[k] + share * (load[min(k + 1, samples - 1)] - load[k])
            # the friction side: the table where it stands on a spring, else the whole mass
            if p.table_share > 0.0:
                spring = stiffness * (x - xt) + damping * (v - vt)
                v += h * (force - spring) / motor_mass
                x += h * v
                body, speed, place, push = table_mass, vt, xt, spring
            else:
                body, speed, place, push = p.mass, v, x, force
            speed_before = speed
            push -= _smooth_force(p, place, speed, force) + pushed
            if p.lugre_stiffness > 0.0:
                before = bristle
                bristle = (bristle + h * speed) / (1.0 + h * p.lugre_stiffness * abs(speed) / p.lugre_level)
                push -= p.lugre_stiffness * bristle + p.lugre_damping * (bristle - before) / h
            free = (speed + h * push / body) / (1.0 + h * p.viscous / body)
            sign = 1.0 if free > 0.0 else -1.0
            grip = h * _sliding_level(p, speed, place, sign) / body / (1.0 + h * p.viscous / body)
            speed = 0.0 if abs(free) <= grip else free - sign * grip
            if p.table_share > 0.0:
                # with the speed at the end of the step a spring neither gains nor loses
                place += h * speed
                vt, xt = speed, place
            else:
                place += 0.5 * h * (speed_before + speed)
                v, x = speed, place
        if not abs(x) < 1e3:
            out[:, k:] = np.nan
            break
    return out
