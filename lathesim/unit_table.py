"""The units that lessons and stock parts use most, so that a run need not load pint for them; a test holds each against pint."""

from __future__ import annotations

import re

_BY_DIMENSION: dict[str, dict[str, float]] = {
    "[length] / [current] / [time]": {"V/N": 1.0, "mV/N": 0.001},
    "1 / [length]": {"1/m": 1.0},
    "1 / [time]": {"Hz": 1.0, "kHz": 1000.0, "krpm": 104.71975511965977, "rad/s": 1.0, "rpm": 0.10471975511965977, "1/s": 1.0},
    "[currency]": {"dollar": 1.0},
    "[currency] / [time]": {"dollar/h": 1.0 / 3600.0, "dollar/s": 1.0},
    "[current]": {"A": 1.0, "mA": 0.001},
    "[current] ** 2 * [time] ** 3 / [length] ** 2 / [mass]": {"A/V": 1.0},
    "[length]": {"m": 1.0, "m/rad": 1.0, "mm": 0.001, "nm": 1e-09, "um": 1e-06},
    "[length] * [time]": {"m*s": 1.0},
    "[length] ** 2": {"m^2": 1.0, "mm^2": 1e-06},
    "[length] ** 2 * [time]": {"m^2*s": 1.0, "mm^2*s": 1e-06},
    "[length] ** 3": {"m^3": 1.0},
    "[length] ** 3 / [time]": {"m^3/s": 1.0},
    "[length] / [time]": {"m/min": 0.016666666666666666, "m/s": 1.0, "mm/min": 1.6666666666666667e-05, "mm/s": 0.001, "um/s": 1e-06},
    "[length] / [time] ** 2": {"m/s^2": 1.0, "mm/s^2": 0.001},
    "[mass]": {"g": 0.001, "kg": 1.0},
    "[length] ** 2 * [mass]": {"kg*m^2": 1.0},
    "[length] ** 2 * [mass] / [time]": {"N*m*s/rad": 1.0},
    "[length] ** 2 * [mass] / [time] ** 2": {"J": 1.0, "N*m": 1.0, "mN*m": 0.001},
    "[length] ** 2 * [mass] / [current] / [time] ** 2": {"N*m/A": 1.0, "V*s/rad": 1.0, "V/(rad/s)": 1.0, "V/krpm": 0.00954929658551372},
    "[length] ** 2 * [mass] / [time] ** 3": {"W": 1.0, "kW": 1000.0},
    "[length] ** 2 * [mass] / [current] / [time] ** 3": {"V": 1.0, "V/rad": 1.0, "mV": 0.001},
    "[length] ** 2 * [mass] / [current] ** 2 / [time] ** 3": {"ohm": 1.0},
    "[length] ** 2 * [mass] / [current] / [time]": {"V*s^2/rad": 1.0},
    "[length] * [mass] / [time] ** 2": {"N": 1.0, "kN": 1000.0, "mN": 0.001},
    "[length] * [mass] / [current] / [time] ** 2": {"V*s/m": 1.0, "V*s/mm": 1000.0},
    "[length] * [mass] / [current] / [time] ** 3": {"V/m": 1.0, "V/mm": 1000.0},
    "[length] * [mass] / [current] / [time] ** 4": {"V/(m*s)": 1.0, "V/(mm*s)": 1000.0},
    "[mass] / [length] / [time] ** 2": {"GPa": 1000000000.0, "MPa": 1000000.0, "N/m^2": 1.0, "N/mm^2": 1000000.0, "Pa": 1.0},
    "[mass] / [time]": {"N*s/m": 1.0, "N*s/mm": 1000.0},
    "[mass] / [time] ** 2": {"N/m": 1.0, "N/mm": 1000.0, "N/um": 1000000.0},
    "[temperature]": {"K": 1.0},
    "[time]": {"min": 60.0, "ms": 0.001, "s": 1.0, "us": 1e-06},
    "[current] * [time] ** 2 / [length] / [mass]": {"m/(s*V)": 1.0, "mm/(s*V)": 0.001},
    "[current] * [time] ** 2 / [length] ** 2 / [mass]": {"rad/(s*V)": 1.0},
    "[time] / [mass]": {"m/(s*N)": 1.0},
    "[time] / [length] ** 2 / [mass]": {"rad/(s*N*m)": 1.0},
    "dimensionless": {"%": 0.01, "deg": 0.017453292519943295, "rad": 1.0},
}

KNOWN_UNITS: dict[str, tuple[float, str]] = {
    unit: (factor, dimension) for dimension, units in _BY_DIMENSION.items() for unit, factor in units.items()
}
"""Unit -> what one of it is in SI base units, and its dimension as pint writes it."""


def known_unit(unit: str) -> tuple[float, str] | None:
    """Give factor and dimension of a unit of the table, also where replaced placeholders left brackets around it: ``V/((N))``."""
    plain = re.sub(r"\(\(([^()]*)\)\)", r"(\1)", unit.strip())
    return KNOWN_UNITS.get(re.sub(r"\((\w+)\)", r"\1", plain))
