"""Receptances of free beams at their two ends, after Euler and Bernoulli and after Timoshenko.

A generalised receptance is R = [[h, l], [n, p]]: displacement and rotation over force and moment. Material damping makes E and G complex,
E (1 + j eta).

Source: R. E. D. Bishop, D. C. Johnson, The Mechanics of Vibration (1960), tables of receptances; T. Schmitz, K. S. Smith, Machining
Dynamics (2019), chapter 7; G. R. Cowper, J. Appl. Mech. 33 (1966), shear coefficients.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg

from lathesim.errors import LessonError

Complex = np.ndarray[Any, np.dtype[np.complex128]]


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
    """Return a cylinder [m], hollow with a ``bore``."""
    if not 0.0 <= bore < diameter:
        raise LessonError(f"a bore of {bore:g} m is not inside the diameter {diameter:g} m.", remedy="Give one smaller than the diameter.")
    nu = material.poisson
    return Beam(
        length,
        0.25 * math.pi * (diameter**2 - bore**2),
        math.pi / 64.0 * (diameter**4 - bore**4),
        6.0 * (1.0 + nu) / (7.0 + 6.0 * nu),
        material,
    )


def prism(width: float, height: float, length: float, material: Material) -> Beam:
    """Return a prism [m] that bends along its ``height``."""
    nu = material.poisson
    return Beam(length, width * height, width * height**3 / 12.0, 10.0 * (1.0 + nu) / (12.0 + 11.0 * nu), material)


def euler_bernoulli(beam: Beam, frequency: float) -> tuple[Complex, Complex, Complex, Complex]:
    """Return R11, R12, R21 and R22 of a beam at a frequency [Hz], each (2, 2), SI; end 1 is the outer one, at s = L, and end 2 at s = 0.

    Left out: shear and rotary inertia.
    """
    omega = 2.0 * math.pi * frequency
    stiffness = beam.material.modulus * (1.0 + 1j * beam.material.loss) * beam.inertia
    wave = (omega**2 * beam.material.density * beam.area / stiffness) ** 0.25
    a = wave * beam.length
    s, c, sh, ch = cmath.sin(a), cmath.cos(a), cmath.sinh(a), cmath.cosh(a)
    f1, f3, f5, f6, f7, f8, f10 = s * sh, c * ch - 1.0, c * sh - s * ch, c * sh + s * ch, s + sh, s - sh, c - ch
    h, hx = -f5 / (stiffness * wave**3 * f3), f8 / (stiffness * wave**3 * f3)
    slope, slope_x = f1 / (stiffness * wave**2 * f3), f10 / (stiffness * wave**2 * f3)
    p, px = f6 / (stiffness * wave * f3), f7 / (stiffness * wave * f3)
    near = np.array([[h, -slope], [-slope, p]])
    far = np.array([[h, slope], [slope, p]])
    near_by_far = np.array([[hx, slope_x], [-slope_x, px]])
    return far, near_by_far.T.copy(), near_by_far, near


def timoshenko(beam: Beam, frequency: float) -> tuple[Complex, Complex, Complex, Complex]:
    """Return R11, R12, R21 and R22 of a beam at a frequency [Hz], with shear and rotary inertia, as :func:`euler_bernoulli`.

    The state (y, theta, M, Q) goes along the beam as  y' = theta + Q/(kappa G A),  theta' = M/(E I),  M' = -Q - rho I w^2 theta,
    Q' = -rho A w^2 y,  by the exponential of its matrix.
    """
    omega = 2.0 * math.pi * frequency
    modulus = beam.material.modulus * (1.0 + 1j * beam.material.loss)
    shear = beam.shear * modulus / (2.0 * (1.0 + beam.material.poisson)) * beam.area
    rate = np.zeros((4, 4), dtype=np.complex128)
    rate[0, 1], rate[0, 3] = 1.0, 1.0 / shear
    rate[1, 2] = 1.0 / (modulus * beam.inertia)
    rate[2, 1], rate[2, 3] = -beam.material.density * beam.inertia * omega**2, -1.0
    rate[3, 0] = -beam.material.density * beam.area * omega**2
    way = scipy.linalg.expm(rate * beam.length)
    # what acts from outside on the ends: (M, Q) at s = L, and -(M, Q) at s = 0
    inverse = np.linalg.inv(way[2:, :2])
    here_by_far, here_by_near = inverse, inverse @ way[2:, 2:]
    far_by_far, far_by_near = way[:2, :2] @ inverse, way[:2, :2] @ inverse @ way[2:, 2:] - way[:2, 2:]
    swap = [1, 0]
    return far_by_far[:, swap], far_by_near[:, swap], here_by_far[:, swap], here_by_near[:, swap]
