"""Beams, and their coupling to an assembly, by receptances.

Receptances of free beams at their two ends, after Euler and Bernoulli and after Timoshenko.

A generalised receptance is R = [[h, l], [n, p]]: displacement and rotation over force and moment. Material damping makes E and G complex,
E (1 + j eta).

Source: R. E. D. Bishop, D. C. Johnson, The Mechanics of Vibration (1960), tables of receptances; T. Schmitz, K. S. Smith, Machining
Dynamics (2019), chapter 7; G. R. Cowper, J. Appl. Mech. 33 (1966), shear coefficients.

Receptance coupling: the tip of an assembly from the receptances of its parts, and the share of a part from that of the assembly.

Source: T. Schmitz, K. S. Smith, Machining Dynamics (2019), chapter 7; S. S. Park, Y. Altintas, M. Movahhedy, Int. J. Mach. Tools Manuf. 43
(2003), inverse receptance coupling.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg

from lathesim.errors import LessonError
from lathesim.record import FloatArray
from lathesim.stability.tool_point import Complex


@dataclass(frozen=True)
class Material:
    """Young's modulus [Pa], density [kg/m^3], loss factor [1], Poisson's ratio [1]."""

    modulus: float
    density: float
    loss: float = 0.0
    poisson: float = 0.3


@dataclass(frozen=True)
class Beam:
    """A free beam: length [m], cross-section [m^2], second moment of area [m^4], shear coefficient [1]."""

    length: float
    area: float
    inertia: float
    shear: float
    material: Material

    def __post_init__(self) -> None:
        for word, value in (("length", self.length), ("cross-section", self.area), ("second moment of area", self.inertia)):
            if not value > 0.0:
                raise LessonError(f"a beam has the {word} {value:g}.", remedy="Give a value above 0.")


def cylinder(diameter: float, length: float, material: Material, bore: float = 0.0) -> Beam:
    """Return a cylinder [m], hollow with a ``bore``.

    The shear coefficient is that of Cowper's hollow circle of the ratio m = bore/diameter, kappa = 6 (1 + nu) (1 + m^2)^2/((7 + 6 nu)
    (1 + m^2)^2 + (20 + 12 nu) m^2). With m = 0 it is that of the solid one, and with m near 1 that of a thin tube.
    """
    if not 0.0 <= bore < diameter:
        raise LessonError(f"a bore of {bore:g} m is not inside the diameter {diameter:g} m.", remedy="Give one smaller than the diameter.")
    nu, square = material.poisson, (bore / diameter) ** 2
    around = (1.0 + square) ** 2
    return Beam(
        length,
        0.25 * math.pi * (diameter**2 - bore**2),
        math.pi / 64.0 * (diameter**4 - bore**4),
        6.0 * (1.0 + nu) * around / ((7.0 + 6.0 * nu) * around + (20.0 + 12.0 * nu) * square),
        material,
    )


def prism(width: float, height: float, length: float, material: Material) -> Beam:
    """Return a prism [m] that bends along its ``height``."""
    nu = material.poisson
    return Beam(length, width * height, width * height**3 / 12.0, 10.0 * (1.0 + nu) / (12.0 + 11.0 * nu), material)


Ports = tuple[Complex, Complex, Complex, Complex]
"""R11, R12, R21 and R22, each (..., 2, 2); end 1 is the outer one, at s = L, and end 2 at s = 0."""
_LONGEST = 3.0
"""Wave number times length up to which the exponential of a beam is computed at once; longer ones are put together from pieces."""

_SHORT, _TERMS = 1.5, 20
"""Wave number times length below which series are used, and their terms: the last is below 1e-30 of the first."""


def euler_bernoulli(beam: Beam, frequency: Any) -> Ports:
    """Return the receptances of a beam at frequencies [Hz] of any shape, SI.

    Left out: shear and rotary inertia.
    """
    omega = 2.0 * math.pi * _above_zero(frequency)
    stiffness = beam.material.modulus * (1.0 + 1j * beam.material.loss) * beam.inertia
    wave = (omega**2 * beam.material.density * beam.area / stiffness) ** 0.25
    a = wave * beam.length
    # sinh and cosh over exp(a), which would overflow for long beams
    shrink = np.exp(-a)
    s, c, sh, ch = np.sin(a), np.cos(a), 0.5 * (1.0 - shrink**2), 0.5 * (1.0 + shrink**2)
    f1, f6, f7 = s * sh, c * sh + s * ch, s * shrink + sh
    f3, f5, f8, f10 = c * ch - shrink, c * sh - s * ch, s * shrink - sh, c * shrink - ch
    short = np.abs(a) < _SHORT
    if short.any():
        # of a short beam little is left of these differences: their series are exact to rounding
        f3, f5, f8, f10 = (np.where(short, shrink * series, whole) for series, whole in zip(_of_short(a), (f3, f5, f8, f10), strict=True))
    h, hx = -f5 / (stiffness * wave**3 * f3), f8 / (stiffness * wave**3 * f3)
    slope, slope_x = f1 / (stiffness * wave**2 * f3), f10 / (stiffness * wave**2 * f3)
    p, px = f6 / (stiffness * wave * f3), f7 / (stiffness * wave * f3)
    near = _matrix(h, -slope, -slope, p)
    far = _matrix(h, slope, slope, p)
    near_by_far = _matrix(hx, slope_x, -slope_x, px)
    return far, np.swapaxes(near_by_far, -1, -2).copy(), near_by_far, near


def _of_short(a: Any) -> tuple[Complex, Complex, Complex, Complex]:
    """Return cos cosh - 1, cos sinh - sin cosh, sin - sinh and cos - cosh of a by their Taylor series.

    cos a cosh a and sin a sinh a are the parts of cosh((1 + i) a), cos a sinh a and sin a cosh a those of sinh((1 + i) a).
    """
    total = [np.zeros_like(a) for _ in range(4)]
    for k in range(1, _TERMS):
        even, odd = a ** (2 * k) / math.factorial(2 * k), a ** (2 * k + 1) / math.factorial(2 * k + 1)
        turned = (2j) ** k
        total[0] += turned.real * even
        total[1] += ((turned * (1 + 1j)).real - (turned * (1 + 1j)).imag) * odd
        total[2] += ((-1) ** k - 1) * odd
        total[3] += ((-1) ** k - 1) * even
    return total[0], total[1], total[2], total[3]


def timoshenko(beam: Beam, frequency: Any) -> Ports:
    """Return the receptances of a beam at frequencies [Hz] of any shape, with shear and rotary inertia, as :func:`euler_bernoulli`.

    The state (y, theta, M, Q) goes along the beam as  y' = theta + Q/(kappa G A),  theta' = M/(E I),  M' = -Q - rho I w^2 theta,
    Q' = -rho A w^2 y,  by the exponential of its matrix. A beam of many waves is put together from halves.
    """
    omega = 2.0 * math.pi * _above_zero(frequency)
    modulus = beam.material.modulus * (1.0 + 1j * beam.material.loss)
    wave = np.abs((omega**2 * beam.material.density * beam.area / (modulus * beam.inertia)) ** 0.25)
    halvings = max(0, math.ceil(math.log2(max(float(wave.max()) * beam.length / _LONGEST, 1e-9))))
    shear = beam.shear * modulus / (2.0 * (1.0 + beam.material.poisson)) * beam.area
    rate = np.zeros((*omega.shape, 4, 4), dtype=np.complex128)
    rate[..., 0, 1], rate[..., 0, 3] = 1.0, 1.0 / shear
    rate[..., 1, 2] = 1.0 / (modulus * beam.inertia)
    rate[..., 2, 1], rate[..., 2, 3] = -beam.material.density * beam.inertia * omega**2, -1.0
    rate[..., 3, 0] = -beam.material.density * beam.area * omega**2
    way = scipy.linalg.expm(rate * (beam.length / 2**halvings))
    # what acts from outside on the ends: (M, Q) at s = L, and -(M, Q) at s = 0
    inverse = np.linalg.inv(way[..., 2:, :2])
    here_by_far, here_by_near = inverse, inverse @ way[..., 2:, 2:]
    far_by_far, far_by_near = way[..., :2, :2] @ inverse, way[..., :2, :2] @ inverse @ way[..., 2:, 2:] - way[..., :2, 2:]
    swap = [1, 0]
    ports: Ports = (far_by_far[..., swap], far_by_near[..., swap], here_by_far[..., swap], here_by_near[..., swap])
    for _ in range(halvings):
        ports = joined(ports, ports)
    return ports


def joined(outer: Ports, inner: Ports) -> Ports:
    """Return the receptances of two parts joined rigidly, end 2 of the outer to end 1 of the inner."""
    a11, a12, a21, a22 = outer
    b11, b12, b21, b22 = inner
    between = np.linalg.inv(a22 + b11)
    return a11 - a12 @ between @ a21, a12 @ between @ b12, b21 @ between @ a21, b22 - b21 @ between @ b12


def _above_zero(frequency: Any) -> FloatArray:
    found = np.asarray(frequency, dtype=np.float64)
    if not (found > 0.0).all():
        raise LessonError(f"a receptance at {float(found.min()):g} Hz is that of a free body.", remedy="Give frequencies above 0.")
    return found


def _matrix(a: Any, b: Any, c: Any, d: Any) -> Complex:
    return np.stack([np.stack([a, b], axis=-1), np.stack([c, d], axis=-1)], axis=-2)


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
