"""The spindle of the truth: a speed loop in the drive gives the torque that is logged; Heun at 50 us, implicit friction, load of cuts.

Source: Isermann, Mechatronic Systems (2005), sec. 3.3 (inertia, viscous and Coulomb friction of a drive); belt: creep with the load.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

PERIOD = 1e-3
FINE = 50


class SpindlePhysics(NamedTuple):
    """Numbers of the spindle [SI]; zero means absent."""

    inertia: float = 0.02
    viscous: float = 0.01
    gain: float = 0.0153
    encoder_resolution: float = 2.0 * math.pi / 10000.0
    tachometer_noise: float = 2e-3
    loop_gain: float = 0.5
    loop_rate: float = 5.0
    torque_limit: float = 20.0
    coulomb: float = 0.0
    coulomb_asymmetry: float = 0.0
    stribeck_excess: float = 0.0
    stribeck_speed: float = 5.0
    offset: float = 0.0
    saturation: float = 1e9
    ripple: float = 0.0
    ripple_share: float = 0.0
    ripple_order: float = 1.0
    ripple_phase: float = 0.0
    eccentricity: float = 0.0
    eccentricity_phase: float = 0.0
    tacho_ripple: float = 0.0
    tacho_order: float = 2.0
    tacho_phase: float = 0.0
    tacho_gain: float = 0.0
    slip: float = 0.0
    creep: float = 0.0
    droop: float = 0.0
    droop_time: float = 0.2
    filter_time: float = 0.0
    windage: float = 0.0
    preload_turns: float = 0.0
    preload: float = 0.0


def simulate_spindle(
    physics: SpindlePhysics, wanted: np.ndarray, load: np.ndarray, disturbance: np.ndarray, noise: np.ndarray, torque: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return torque command [N*m], encoder angle [rad] and tachometer voltage [V].

    With ``torque`` empty the speed loop follows ``wanted`` [rad/s]; else that torque is played. ``load`` is the known load torque against
    positive rotation, ``disturbance`` what nobody measured [N*m], ``noise`` standard normal (2, samples).
    """
    result: tuple[np.ndarray, np.ndarray, np.ndarray] = _simulate(physics, wanted, load, disturbance, noise, torque)
    return result


@njit(cache=True)
def _smooth(p: SpindlePhysics, angle: float, speed: float, torque: float) -> float:
    wave = math.sin(p.ripple_order * angle + p.ripple_phase)
    against = p.viscous * speed + p.offset + (p.ripple + p.ripple_share * torque) * wave + p.windage * speed * abs(speed)
    return against + p.preload * math.tanh(speed / 2.0) * math.exp(-abs(angle) / (2.0 * math.pi * p.preload_turns + 1e-9))


@njit(cache=True)
def _simulate(
    p: SpindlePhysics, wanted: np.ndarray, load: np.ndarray, disturbance: np.ndarray, noise: np.ndarray, torque: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    samples = wanted.shape[0]
    given, encoder, volts = np.zeros(samples), np.zeros(samples), np.zeros(samples)
    h = PERIOD / FINE
    angle, speed, integral, lag, filtered, shown_before = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(samples):
        if torque.shape[0] > 0:
            command = torque[k]
        else:
            error = wanted[k] - speed
            command = p.loop_gain * (error + integral)
            if abs(command) > p.torque_limit:
                command = p.torque_limit if command > 0.0 else -p.torque_limit
            else:
                integral += p.loop_rate * PERIOD * error
        given[k] = command
        acting = min(max(command, -p.saturation), p.saturation)
        read = angle + p.eccentricity * math.sin(angle + p.eccentricity_phase)
        if p.encoder_resolution > 0.0:
            read = p.encoder_resolution * math.floor(read / p.encoder_resolution + 0.5)
        encoder[k] = read
        for fine in range(FINE):
            ratio = 1.0 - p.slip - p.creep * abs(load[k])
            behind = speed * ratio - p.droop * lag
            shown = behind * (1.0 + p.tacho_gain + p.tacho_ripple * math.sin(p.tacho_order * angle + p.tacho_phase))
            if p.filter_time > 0.0 and (k > 0 or fine > 0):
                filtered += (0.5 * (shown_before + shown) - filtered) * (1.0 - math.exp(-h / p.filter_time))
            shown_before = shown
            if fine == 0:
                signal = filtered if p.filter_time > 0.0 else shown
                volts[k] = p.gain * signal + p.tachometer_noise * noise[1, k]
            lag += (load[k] - lag) * (1.0 - math.exp(-h / p.droop_time))
            push = acting - load[k] - disturbance[k]
            first = (push - _smooth(p, angle, speed, acting)) / p.inertia
            second = (push - _smooth(p, angle + h * speed, speed + h * first, acting)) / p.inertia
            free = speed + 0.5 * h * (first + second)
            sign = 1.0 if free > 0.0 else -1.0
            level = p.coulomb * (1.0 + p.coulomb_asymmetry * sign) + p.stribeck_excess * math.exp(-abs(speed) / p.stribeck_speed)
            grip = h * level / p.inertia
            after = 0.0 if abs(free) <= grip else free - sign * grip
            angle += 0.5 * h * (speed + after)
            speed = after
    return given, encoder, volts
