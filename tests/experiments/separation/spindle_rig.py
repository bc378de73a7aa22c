"""The spindle of the truth: a speed loop in the drive gives the torque that is logged; Heun at 50 us, implicit friction, load of cuts.

Source: Isermann, Mechatronic Systems (2005), sec. 3.3 (inertia, viscous and Coulomb friction of a drive).
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
    ripple: float = 0.0
    ripple_share: float = 0.0
    ripple_order: float = 1.0
    ripple_phase: float = 0.0
    tacho_ripple: float = 0.0
    tacho_order: float = 2.0
    tacho_phase: float = 0.0


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
    return p.viscous * speed + (p.ripple + p.ripple_share * torque) * wave


@njit(cache=True)
def _simulate(
    p: SpindlePhysics, wanted: np.ndarray, load: np.ndarray, disturbance: np.ndarray, noise: np.ndarray, torque: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    samples = wanted.shape[0]
    given, encoder, volts = np.zeros(samples), np.zeros(samples), np.zeros(samples)
    h = PERIOD / FINE
    angle, speed, integral = 0.0, 0.0, 0.0
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
        read = angle
        if p.encoder_resolution > 0.0:
            read = p.encoder_resolution * math.floor(read / p.encoder_resolution + 0.5)
        encoder[k] = read
        for fine in range(FINE):
            if fine == 0:
                shown = speed * (1.0 + p.tacho_ripple * math.sin(p.tacho_order * angle + p.tacho_phase))
                volts[k] = p.gain * shown + p.tachometer_noise * noise[1, k]
            push = command - load[k] - disturbance[k]
            first = (push - _smooth(p, angle, speed, command)) / p.inertia
            second = (push - _smooth(p, angle + h * speed, speed + h * first, command)) / p.inertia
            free = speed + 0.5 * h * (first + second)
            sign = 1.0 if free > 0.0 else -1.0
            level = p.coulomb * (1.0 + p.coulomb_asymmetry * sign)
            grip = h * level / p.inertia
            after = 0.0 if abs(free) <= grip else free - sign * grip
            angle += 0.5 * h * (speed + after)
            speed = after
    return given, encoder, volts
