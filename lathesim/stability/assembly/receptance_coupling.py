"""Receptance coupling: the tip of an assembly from the receptances of its parts, and the share of a part from that of the assembly.

Source: T. Schmitz, K. S. Smith, Machining Dynamics (2019), chapter 7; S. S. Park, Y. Altintas, M. Movahhedy, Int. J. Mach. Tools Manuf. 43
(2003), inverse receptance coupling.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from lathesim.errors import LessonError
from lathesim.stability.assembly.beams import Beam, Complex, euler_bernoulli, timoshenko

MODELS = {"euler_bernoulli": euler_bernoulli, "timoshenko": timoshenko}


def coupled_tip(parts: tuple[Complex, Complex, Complex, Complex], base: Complex, joint: Complex | None = None) -> Complex:
    """Return the receptance (..., 2, 2) of the tip: G11 = R11 - R12 (R22 + base + K^-1)^-1 R21.

    ``parts`` are R11, R12, R21 and R22 of the outer part, ``base`` is the receptance (2, 2) of what it is fixed to, and ``joint`` the
    stiffness K (2, 2) of an elastic joint [N/m, N/rad; N, N*m/rad]; without one the joint is rigid.
    """
    outer, across, back, inner = parts
    give = np.zeros((2, 2)) if joint is None else np.linalg.inv(joint)
    return np.asarray(outer - across @ np.linalg.solve(inner + base + give, back))


def base_from_tip(parts: tuple[Complex, Complex, Complex, Complex], tip: Complex) -> Complex:
    """Return the receptance of the base from that of the tip, all four terms known: R21 (R11 - G11)^-1 R12 - R22."""
    outer, across, back, inner = parts
    return np.asarray(back @ np.linalg.solve(outer - tip, across) - inner)


def assembly_tip(
    beams: Sequence[Beam], frequency: Any, *, model: str = "timoshenko", base: Complex | None = None, joints: Sequence[Any] = ()
) -> Complex:
    """Return the receptance of the free tip of beams in a row, the first at the tip, at frequencies [Hz] of any shape.

    The last beam is free at its far end, or fixed to a ``base``; ``joints`` are the stiffnesses between them, None for rigid.
    """
    if not beams:
        raise LessonError("an assembly has no parts.", remedy="Give at least one beam.")
    receptances = MODELS[model]
    links = [*joints, *[None] * (len(beams) - len(joints))]
    last = receptances(beams[-1], frequency)
    tip = last[0] if base is None else coupled_tip(last, base, links[-1])
    for beam, link in zip(reversed(beams[:-1]), reversed(links[: len(beams) - 1]), strict=True):
        tip = coupled_tip(receptances(beam, frequency), tip, link)
    return tip
