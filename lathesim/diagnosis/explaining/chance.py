"""Whether a gain is more than chance gives. Every decision on a gain asks here."""

from __future__ import annotations

import math

from lathesim.diagnosis.explaining.density import BLOCKS
from lathesim.diagnosis.method import Method
from lathesim.diagnosis.records.found import Gain


def due(method: Method, parameters: int = 0) -> float:
    """Return what an explanation with so many further values must gain [nats]."""
    return method.margin + method.per_parameter * parameters


def chance_level(gain: Gain, method: Method, parameters: int = 0) -> float:
    """Return what a gain has to exceed: what chance and its parameters give, and its standard errors [nats]."""
    return max(due(method, parameters), method.errors * gain.error)


def is_clear(gain: Gain, method: Method, parameters: int = 0) -> bool:
    """Return whether a gain is above the level that chance may reach."""
    return gain.nats > chance_level(gain, method, parameters)


def is_clear_as_one_block(gain: Gain, method: Method) -> bool:
    """Return whether a gain is clear even where all blocks of a recording are one: its error is the root of their number larger then."""
    return gain.nats > method.errors * math.sqrt(BLOCKS) * gain.error


def size_error(gain: Gain, method: Method) -> float:
    """Return one standard error of the size with which an effect gains, as a share; infinite where the gain may be chance.

    All blocks of the recording are taken for one. A gain grows with the square of the size: d gain / gain = 2 d size / size.
    """
    return 0.5 * math.sqrt(BLOCKS) * gain.error / gain.nats if is_clear_as_one_block(gain, method) else math.inf


def unresolved(difference: Gain, explained: float, method: Method) -> float:
    """Return the difference of two explanations that cannot be told, where the better one gains so much (``explained``) [nats]."""
    share = method.material * abs(explained)
    return max(method.tie_errors * difference.error, method.per_parameter, share)


def least_apart(method: Method) -> float:
    """Return the difference from which on two explanations are told whatever the better one gains [nats].

    The error of a gain G of white noise is sqrt(2 G), and G has to exceed so many of its errors.
    """
    return max(2.0 * method.tie_errors**2, method.per_parameter)
