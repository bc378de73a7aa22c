"""A tool that bends along the chip and meets the surface it left a turn before: regenerative chatter, integrated in steps of 50 us.

    m x'' + c x' + k x = share K(t) h,   h = max(0, feed + w(t - T) - x),   w = min(x, w(t - T) + feed),   T = 2 pi r / V

x is how far the edge stands back from its path and w how far the surface does. Where the tool leaves the cut the surface of earlier turns
stays and the next turn finds one feed more (multiple regeneration). K is main force per thickness, and ``share`` of it acts along the chip.

Sources: J. Tlusty, F. Ismail, Annals of the CIRP 30 (1981) 299 (surface over several turns); Y. Altintas, Manufacturing Automation, 2nd ed.
(2012), section 4.2 (equation, border of stability). The numbers of the tool are assumed: a turret whose clamp comes loose.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np

from lathesim.record import FloatArray

STEP = 50e-6
RADIUS = 0.02
SHARE = 0.5
"""Force along the chip over main force: the edge stands square to the feed, so this is the feed force."""
PRESSURE = 1800e6
DEEP = 1e-3
"""Depth [m] of the passes that chatter when the clamp is loose."""
_LINE = 8192
"""Steps of surface that are kept; a turn must be shorter."""


class Tool(NamedTuple):
    """Mass [kg], stiffness [N/m] and damping ratio of a tool along the chip."""

    mass: float
    stiffness: float
    damping: float


CLAMPED = Tool(22.0, 400e6, 0.03)
"""Bends by 0.5 um in the deepest pass, a four-hundredth of the chip."""
_LOOSE_STIFFNESS = 12.5e6


def loose(beyond: float) -> Tool:
    """Return the tool with a loose clamp, 120 Hz, whose lowest border of stability is ``DEEP / beyond``.

    DEEP / beyond = 2 k zeta (1 + zeta) / K, with K the force along the chip per area. A ``beyond`` of 1.3 to 1.6 is zeta of 0.027 to 0.022.
    """
    twice = SHARE * PRESSURE * DEEP / beyond / _LOOSE_STIFFNESS
    return Tool(CLAMPED.mass, _LOOSE_STIFFNESS, 0.5 * (math.sqrt(1.0 + 2.0 * twice) - 1.0))


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def _thickness(
    feed: FloatArray, hold: FloatArray, turn: FloatArray, stiffness: FloatArray, damping: FloatArray, mass: float, fine: int
) -> FloatArray:
    out = np.zeros(len(feed))
    surface = np.zeros(_LINE)
    x = v = 0.0
    at, entered = 0, 0
    for k in range(len(feed)):
        cuts = feed[k] > 0.0 and hold[k] > 0.0
        back = turn[k] / STEP
        whole = int(back)
        part = back - whole
        for j in range(fine):
            at += 1
            h = 0.0
            if cuts:
                before = 0.0  # an even surface in the first turn
                if at - entered > whole + 1:
                    before = (1.0 - part) * surface[(at - whole) % _LINE] + part * surface[(at - whole - 1) % _LINE]
                h = max(0.0, feed[k] + before - x)
                surface[at % _LINE] = min(x, before + feed[k])
            else:
                entered = at
            if j == 0:
                out[k] = h
            v += STEP * (hold[k] * h - damping[k] * v - stiffness[k] * x) / mass
            x += STEP * v
    return out


def thickness(
    feed: FloatArray, force_per_thickness: FloatArray, speed: FloatArray, tools: tuple[Tool, Tool], changed: FloatArray, period: float
) -> FloatArray:
    """Return the thickness of the chip [m] at each sample, (samples,).

    ``force_per_thickness`` [N/m] acts along the chip, ``speed`` [m/s] is that of the cut and must not change within a pass. The second of
    the ``tools`` cuts where ``changed`` is not zero; both have one mass.
    """
    other = changed != 0.0
    stiffness, damping = (np.array([tool.stiffness, 2.0 * tool.damping * math.sqrt(tool.stiffness * tool.mass)]) for tool in tools)
    turn = 2.0 * np.pi * RADIUS / np.maximum(speed, 1e-6)
    if float(turn[feed > 0.0].max(initial=0.0)) > (_LINE - 2) * STEP:
        raise ValueError(f"a turn takes longer than {(_LINE - 2) * STEP:.2g} s")
    held = [np.where(other, b, a) for a, b in zip(stiffness, damping, strict=True)]
    return np.asarray(_thickness(feed, force_per_thickness, turn, held[0], held[1], tools[0].mass, round(period / STEP)))
