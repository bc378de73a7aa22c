"""What an equation-error start needs of an effect: columns that are linear in what is looked for.

Every form explains the same thing: what the effect adds on its wire, ``outgoing - incoming``, from recorded signals. Coefficients of the
columns come from a linear regression; :attr:`LinearForm.parameters` turns them into parameters of the effect.

Signals are arrays of one length, in SI: ``time``, ``position``, ``velocity``, ``acceleration``, ``force`` (driving force), ``inertia``
(an array too), ``incoming`` (what the wire carries without the effect), ``angle``, ``spindle_speed``, ``load``, ``speed`` (of cutting),
``feed``, ``depth``, ``other_position``, ``other_force``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

Signal = np.ndarray[Any, np.dtype[np.float64]]
Signals = Mapping[str, Signal]
Shape = Mapping[str, float]
Columns = dict[str, Signal]
Coefficients = Mapping[str, float]


def _as_they_are(coefficients: Coefficients, shape: Shape) -> dict[str, float]:
    return dict(coefficients)


@dataclass(frozen=True)
class LinearForm:
    """Columns of an effect.

    ``needs`` names the signals, ``shape`` the parameters the columns depend on other than linearly (scan them over their typical range).
    ``columns(signals, shape)`` gives name -> column; ``parameters(coefficients, shape)`` gives parameters of the effect.
    """

    needs: tuple[str, ...]
    columns: Callable[[Signals, Shape], Columns]
    shape: tuple[str, ...] = ()
    parameters: Callable[[Coefficients, Shape], dict[str, float]] = _as_they_are


def sine_columns(angle: Signal, name: str = "amplitude", weight: Signal | float = 1.0) -> Columns:
    """Give the columns of ``name sin(angle + phase)``."""
    return {f"{name}*cos(phase)": weight * np.sin(angle), f"{name}*sin(phase)": weight * np.cos(angle)}


def size_and_phase(coefficients: Coefficients, name: str = "amplitude") -> tuple[float, float]:
    """Give size and phase of ``name sin(angle + phase)`` from the coefficients of its columns."""
    along, across = coefficients[f"{name}*cos(phase)"], coefficients[f"{name}*sin(phase)"]
    return math.hypot(along, across), math.atan2(across, along)


def sine_parameters(name: str = "amplitude", phase: str = "phase", turn: float = 0.0) -> Callable[[Coefficients, Shape], dict[str, float]]:
    """Give the parameters of one sine; ``turn`` is subtracted from the phase (pi/2 where the effect is written with a cosine)."""

    def parameters(coefficients: Coefficients, shape: Shape) -> dict[str, float]:
        size, angle = size_and_phase(coefficients, name)
        return {name: size, phase: math.remainder(angle - turn, 2.0 * math.pi)}

    return parameters


def rate(signal: Signal, time: Signal) -> Signal:
    """Give the central difference of a signal."""
    found: Signal = np.gradient(signal, time)
    return found


def first_order(signal: Signal, time: Signal, time_constant: float) -> Signal:
    """Give y of ``T dy/dt + y = signal`` from rest, for a signal held over each sample."""
    from scipy.signal import lfilter

    period = float(np.median(np.diff(time)))
    share = math.exp(-period / time_constant)
    found: Signal = lfilter([0.0, 1.0 - share], [1.0, -share], signal)
    return found


def second_order(signal: Signal, time: Signal, frequency: float, damping: float) -> tuple[Signal, Signal]:
    """Give y and y'' of ``y'' + 2 damping w y' + w^2 y = signal`` from rest (bilinear, with the frequency kept)."""
    from scipy.signal import lfilter

    period = float(np.median(np.diff(time)))
    angular = 2.0 * math.pi * min(frequency, 0.45 / period)
    scale = angular / math.tan(0.5 * angular * period)
    denominator = np.array(
        [
            scale * scale + 2.0 * damping * angular * scale + angular * angular,
            2.0 * (angular * angular - scale * scale),
            scale * scale - 2.0 * damping * angular * scale + angular * angular,
        ]
    )
    followed: Signal = lfilter([1.0, 2.0, 1.0], denominator, signal)
    curved: Signal = lfilter(scale * scale * np.array([1.0, -2.0, 1.0]), denominator, signal)
    return followed, curved


def last_direction(velocity: Signal) -> Signal:
    """Give the sign of the last motion: +1, -1, and 0 before the first."""
    sign = np.sign(velocity)
    place = np.maximum.accumulate(np.where(sign != 0.0, np.arange(len(sign)), 0))
    found: Signal = sign[place]
    return found


def dahl(position: Signal, distance: float) -> Signal:
    """Give the bristle force of unit level over a path (the exact solution of Dahl's equation from sample to sample)."""
    force = 0.0
    before = float(position[0])
    found = np.empty(len(position))
    for place, here in enumerate(position.tolist()):
        travelled = here - before
        if travelled > 0.0:
            force = 1.0 + (force - 1.0) * math.exp(-travelled / distance)
        elif travelled < 0.0:
            force = -1.0 + (force + 1.0) * math.exp(travelled / distance)
        found[place] = force
        before = here
    return found


def spent(mask: Signal, time: Signal) -> Signal:
    """Give the time for which ``mask`` has been above zero."""
    found: Signal = np.concatenate([[0.0], np.cumsum(np.diff(time) * (mask[:-1] > 0.0))])
    return found
