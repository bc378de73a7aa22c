"""The units that lessons and stock parts use most, so that a run need not load pint for them; a test holds each against pint."""

from __future__ import annotations

import re

_BY_DIMENSION: dict[str, dict[str, float]] = {
    "[length] / [current] / [time]": {"V/N": 1.0, "mV/N": 0.001},
    "1 / [current] / [time]": {"V/(N*m)": 1.0},
    "1 / [length]": {"1/m": 1.0},
    "1 / [length] / [time]": {"1/(m*s)": 1.0},
    "1 / [time]": {
        "Hz": 1.0,
        "kHz": 1000.0,
        "krpm": 104.71975511965977,
        "rad/s": 1.0,
        "rev/min": 0.10471975511965977,
        "rev/s": 6.283185307179586,
        "rpm": 0.10471975511965977,
        "1/s": 1.0,
    },
    "[currency]": {"dollar": 1.0},
    "[currency] / [time]": {"dollar/h": 1.0 / 3600.0, "dollar/s": 1.0},
    "[current]": {"A": 1.0, "mA": 0.001},
    "[current] ** 2 * [time] ** 3 / [length] ** 2 / [mass]": {"A/V": 1.0},
    "[length]": {
        "in": 0.0254,
        "m": 1.0,
        "m/rad": 1.0,
        "mm": 0.001,
        "mm/rad": 0.001,
        "mm/rev": 0.00015915494309189535,
        "nm": 1e-09,
        "um": 1e-06,
    },
    "[length] * [time]": {"m*s": 1.0},
    "[length] ** 2": {"m^2": 1.0, "mm^2": 1e-06},
    "[length] ** 2 * [time]": {"m^2*s": 1.0, "mm^2*s": 1e-06},
    "[length] ** 3": {"m^3": 1.0},
    "[length] ** 3 / [time]": {"m^3/s": 1.0, "mm^3/s": 1e-09},
    "[length] / [time]": {"m/min": 0.016666666666666666, "m/s": 1.0, "mm/min": 1.6666666666666667e-05, "mm/s": 0.001, "um/s": 1e-06},
    "[length] / [time] ** 2": {"m/s^2": 1.0, "mm/s^2": 0.001},
    "[mass]": {"N*s**2/m": 1.0, "N*s/(m/s)": 1.0, "g": 0.001, "kg": 1.0},
    "[length] ** 2 * [mass]": {"(N*m)*s**2/rad": 1.0, "(N*m)*s/(rad/s)": 1.0, "kg*m^2": 1.0},
    "[length] ** 2 * [mass] / [time]": {"(N*m)*s/rad": 1.0, "(N*m)/(rad/s)": 1.0, "N*m*s/rad": 1.0},
    "[length] ** 2 * [mass] / [time] ** 2": {"J": 1.0, "N*m": 1.0, "mN*m": 0.001},
    "[length] ** 2 * [mass] / [current] / [time] ** 2": {
        "(N*m)/A": 1.0,
        "N*m/A": 1.0,
        "V*s/rad": 1.0,
        "V/(rad/s)": 1.0,
        "V/krpm": 0.00954929658551372,
    },
    "[length] ** 2 * [mass] / [time] ** 3": {"W": 1.0, "kW": 1000.0},
    "[length] ** 2 * [mass] / [current] / [time] ** 3": {"V": 1.0, "V/rad": 1.0, "mV": 0.001},
    "[length] ** 2 * [mass] / [current] ** 2 / [time] ** 3": {"ohm": 1.0},
    "[length] ** 2 * [mass] / [current] / [time]": {"V*s^2/rad": 1.0},
    "[length] * [mass] / [time] ** 2": {"N": 1.0, "kN": 1000.0, "mN": 0.001},
    "[length] * [mass] / [current] / [time] ** 2": {"N/A": 1.0, "V*s/m": 1.0, "V*s/mm": 1000.0, "V/(m/s)": 1.0},
    "[length] * [mass] / [current] / [time] ** 3": {"V/m": 1.0, "V/mm": 1000.0, "mV/mm": 1.0},
    "[length] * [mass] / [current] / [time] ** 4": {"V/(m*s)": 1.0, "V/(mm*s)": 1000.0},
    "[mass] / [length] / [time] ** 2": {"GPa": 1000000000.0, "MPa": 1000000.0, "N/m^2": 1.0, "N/mm^2": 1000000.0, "Pa": 1.0},
    "[mass] / [time]": {"N/(m/s)": 1.0, "N*s/m": 1.0, "N*s/mm": 1000.0},
    "[mass] / [time] ** 2": {"N/m": 1.0, "N/mm": 1000.0, "N/um": 1000000.0},
    "[temperature]": {"K": 1.0},
    "[time]": {"min": 60.0, "ms": 0.001, "s": 1.0, "us": 1e-06},
    "[current] * [time] ** 2 / [length] / [mass]": {"m/(s*V)": 1.0, "mm/(s*V)": 0.001},
    "[current] * [time] ** 2 / [length] ** 2 / [mass]": {"rad/(s*V)": 1.0},
    "[time] / [mass]": {"(m/s)/N": 1.0, "m/(s*N)": 1.0, "mm/(s*N)": 0.001, "um/(s*N)": 1e-06},
    "[time] / [length] ** 2 / [mass]": {"(rad/s)/(N*m)": 1.0, "rad/(s*N*m)": 1.0},
    "[time] ** 2 / [length] / [mass]": {"1/N": 1.0},
    "[time] ** 2 / [length] ** 2 / [mass]": {"1/(N*m)": 1.0},
    "dimensionless": {"%": 0.01, "count": 1.0, "counts": 1.0, "deg": 0.017453292519943295, "rad": 1.0, "rev": 6.283185307179586},
}

KNOWN_UNITS: dict[str, tuple[float, str]] = {
    unit: (factor, dimension) for dimension, units in _BY_DIMENSION.items() for unit, factor in units.items()
}
"""Unit -> what one of it is in SI base units, and its dimension as pint writes it."""

ANGLE_POWERS: dict[str, int] = {
    **dict.fromkeys(("rad", "deg", "rev", "rpm", "krpm", "rev/min", "rev/s", "rad/s"), 1),
    **dict.fromkeys(("m/rad", "mm/rad", "mm/rev", "V/krpm", "V*s/rad", "V/rad", "V/(rad/s)", "N*m*s/rad"), -1),
}
"""Unit of the table -> the power of the angle in it: 1 for rad/s, -1 for mm/rev; the others of the table hold no angle."""


def known_unit(unit: str) -> tuple[float, str] | None:
    """Return factor and dimension of a unit of the table, also where replaced placeholders left brackets around it: ``V/((N))``."""
    plain = re.sub(r"\(\(([^()]*)\)\)", r"(\1)", unit.strip())
    return KNOWN_UNITS.get(re.sub(r"\((\w+)\)", r"\1", plain))


def known_angle_power(unit: str) -> int | None:
    """Return the power of the angle in a unit of the table; none for other units."""
    plain = unit.strip()
    return ANGLE_POWERS.get(plain, 0) if plain in KNOWN_UNITS and plain not in _OTHER_ANGLES else None


_OTHER_ANGLES = frozenset(unit for unit in KNOWN_UNITS if re.search("rad|deg|rev|rpm", unit)) - frozenset(ANGLE_POWERS)
