"""Residuals without a simulation: derivatives of the filtered recording put into the lesson's equations, what is left over is missing.

All signals of a recording pass one filter forward and backward and are thinned, so that none is late against another. Source: M. Gautier,
A. Janot, P.-O. Vandanjon, A new closed-loop output error method, IEEE Trans. Control Systems Technology 21 (2013), section II (the
inverse-dynamics regression it is held against).
"""

from __future__ import annotations

import numpy as np
from numba import njit
from scipy.signal import butter, sosfiltfilt

from tests.diagnosis.suite.comparators.read_case import PERIOD, Case

CORNER = 40.0
"""Corner of the filter [Hz]."""
THINNED = 5


def filtered(values: np.ndarray, corner: float = CORNER, derivatives: int = 0) -> np.ndarray:
    """Return a signal low-passed forward and backward, differentiated, every fifth sample without the ends."""
    kept = sosfiltfilt(butter(4, corner, fs=1.0 / PERIOD, output="sos"), values)
    for _ in range(derivatives):
        kept = np.gradient(kept, PERIOD)
    return np.asarray(kept[200:-200:THINNED])


def held(values: np.ndarray) -> np.ndarray:
    """Return the mean of a signal that is held over each sample, at the sample instants."""
    return 0.5 * (values + np.r_[values[:1], values[:-1]])


def axis_signals(case: Case, columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return motion and residuals of an axis: ``force`` [N], ``drive`` [A] with a current, ``screw`` [m] with a scale."""
    given = case.given
    x, v, a = (filtered(columns["encoder"], derivatives=order) for order in range(3))
    u = filtered(held(columns["command"]))
    planned = given["conductance"] * (u - given.get("back_emf", 0.0) * v)
    current = filtered(held(columns["current"])) if "current" in columns else planned
    applied = given["effort_constant"] * current
    sign = np.tanh(v / 5e-4)
    force = applied - given["mass"] * a - given["viscous"] * v - given.get("coulomb", 0.0) * sign
    found = {"x": x, "v": v, "a": a, "u": u, "applied": applied, "sign": sign, "force": force, "current": current, "planned": planned}
    found["time"] = (200 + THINNED * np.arange(len(x))) * PERIOD
    found["travelled"] = filtered(since_reversal(columns["encoder"]))
    if "current" in columns:
        found["drive"] = current - planned
        found["planned_rate"] = given["conductance"] * filtered(held(columns["command"]), derivatives=1)
    if "scale" in columns:
        found["screw"] = filtered(columns["scale"]) - x
        found["sharp_screw"] = (columns["scale"] - columns["encoder"])[200:-200:THINNED]
    return found


@njit(cache=True)
def since_reversal(position: np.ndarray, band: float = 3e-6) -> np.ndarray:
    """Return the signed distance since the motion last turned round by more than ``band``."""
    out = np.zeros_like(position)
    turned, extreme, direction = position[0], position[0], 0.0
    for k in range(len(position)):
        place = position[k]
        if direction * (place - extreme) >= 0.0 and direction != 0.0:
            extreme = place
        elif abs(place - extreme) > band:
            direction = 1.0 if place > extreme else -1.0
            turned, extreme = extreme, place
        out[k] = place - turned
    return out


def spindle_signals(case: Case, columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return motion and residuals of a spindle: ``force`` [N*m] and ``tacho`` [rad/s], the tachometer's speed less the encoder's."""
    given = case.given
    angle, speed, rate = (filtered(columns["encoder"], derivatives=order) for order in range(3))
    torque, load = filtered(held(columns["torque"])), filtered(held(columns["load"]))
    shown = filtered(columns["tachometer"]) / given["gain"]
    force = torque - load - given["inertia"] * rate - given["viscous"] * speed
    found = {"x": angle, "v": speed, "a": rate, "applied": torque, "load": load, "force": force, "tacho": shown - speed}
    found["sign"] = np.tanh(speed / 0.5)
    found["time"] = (200 + THINNED * np.arange(len(angle))) * PERIOD
    return found


def strongest_periods(
    place: np.ndarray, residual: np.ndarray, low: float, high: float, number: int = 2, beside: np.ndarray | None = None
) -> list[float]:
    """Return the wavelengths over ``place`` at which sine and cosine explain most of a residual, the strongest first.

    ``beside`` (columns) is taken out first: what other terms explain is no wave.
    """
    columns = np.column_stack([np.ones_like(place), place, *([] if beside is None else beside.T)])
    columns = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    rest = residual - columns @ np.linalg.lstsq(columns, residual, rcond=None)[0]
    reach = float(np.ptp(place))
    if reach <= 0.0:
        return [float(np.sqrt(low * high))] * number
    count = int(np.clip(3.0 * reach * (1.0 / low - 1.0 / high), 8, 1500))
    waves = np.linspace(1.0 / high, 1.0 / low, count)
    power = np.empty(count)
    for first in range(0, count, 100):
        turned = np.exp(-2j * np.pi * np.outer(waves[first : first + 100], place))
        power[first : first + 100] = np.abs(turned @ rest) ** 2
    chosen: list[float] = []
    for best in np.argsort(-power):
        if all(abs(waves[best] - 1.0 / other) * reach > 1.0 for other in chosen):
            chosen.append(1.0 / float(waves[best]))
        if len(chosen) == number:
            break
    return chosen
