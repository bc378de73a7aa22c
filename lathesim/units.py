"""Text quantities to SI and back; pint is used only here.

Inside the program every number is SI. ``quantity("0.25 V/mm", "V/m")`` gives 250.0; a number without a unit, an unknown unit and a
unit of another kind are refused with what was meant.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from typing import Any

from lathesim.errors import UnitError
from lathesim.unit_table import known_angle_power, known_unit


@functools.cache
def registry() -> Any:
    """Return the one unit registry, made when first asked for (pint takes a third of a second to load).

    The registry is not cached on disk: most runs need only the table of known units, and pint's own cache files can be torn.
    """
    import pint

    units: Any = pint.UnitRegistry(autoconvert_offset_to_baseunit=True)
    units.define("percent = 0.01 = %")
    units.define("encoder_count = 1 = count")
    units.define("dollar = [currency] = $ = USD")
    # a lathe hand writes feeds and leads per revolution, which pint calls a turn
    units.define("@alias turn = rev")
    units.define("inch_per_minute = inch / minute = ipm")
    units.define("inch_per_revolution = inch / turn = ipr")
    units.define("@alias encoder_count = increment = pulse = tick")
    return units


@functools.cache
def si_factor(unit: str) -> tuple[float, str]:
    """Return what one ``unit`` is in SI base units, and its dimension as text."""
    if unit.strip() in ("", "1"):
        return 1.0, "dimensionless"
    known = known_unit(unit)
    if known is not None:
        return known
    units = registry()  # a fault in here is no fault of the text
    try:
        base = units.Quantity(1.0, unit).to_base_units()
    except (MemoryError, OSError):
        raise
    except Exception as error:  # pint lets errors of its own, of Python's tokenizer and of arithmetic through
        raise UnitError(f"'{unit}' is no unit.", remedy="Write units as in 'mm', 'm/s', 'N*s/m', 'V/mm', 'rpm'.") from error
    return float(base.magnitude), dimension_text(base.dimensionality)


@functools.cache
def angle_power(unit: str) -> int:
    """Return the power of the angle in a unit: 1 for rad/s and rpm, -1 for mm/rev, 0 for m/s and Hz."""
    if unit.strip() in ("", "1"):
        return 0
    known = known_angle_power(unit)
    if known is not None:
        return known
    names: dict[str, float] = dict(registry().parse_units(unit)._units)
    return round(sum(power * _ANGLES.get(name, 0) for name, power in names.items()))


_ANGLES = dict.fromkeys(("radian", "milliradian", "microradian", "degree", "arcminute", "arcsecond", "turn", "grade"), 1) | dict.fromkeys(
    ("revolutions_per_minute", "kilorevolutions_per_minute", "revolutions_per_second", "inch_per_revolution"), 1
)
_ANGLES["inch_per_revolution"] = -1
_TURN = 2.0 * math.pi
_STANDARD_GRAVITY = 9.80665


@functools.cache
def conversion(given: str, wanted: str) -> float:
    """Return the factor from ``given`` to SI for a quantity that is wanted in ``wanted``.

    The wanted unit decides what an angle means. For a lead in m/rad, 1 mm/rev is 1e-3/(2 pi). For a feed in m it is 1e-3, the travel of one
    turn. Hz are turns a second and 1/min turns a minute: 1 Hz is 2 pi rad/s. ``g`` is 9.80665 m/s^2 where an acceleration is wanted, and a
    gram elsewhere.
    Raises :class:`UnitError` where the two are of different kinds, or where a lead is given without an angle.
    """
    factor, dimension = si_factor(given)
    wanted_dimension = si_factor(wanted)[1]
    if given.strip() in ("g", "mg") and wanted_dimension == _ACCELERATION:
        return _STANDARD_GRAVITY * (1.0 if given.strip() == "g" else 1e-3)
    if dimension != wanted_dimension:
        remedy = "Give the length of one count as 'resolution'." if is_count(given) else f"Use a unit like {wanted}."
        raise UnitError(f"the unit is {given}, but {wanted} is wanted.", remedy=remedy)
    if given.strip() == wanted.strip():
        return factor
    power, wanted_power = _turning_power(given), _turning_power(wanted)
    if is_count(given) and wanted_power:
        raise UnitError(f"the unit is {given}, but {wanted} is wanted.", remedy="Give the angle of one count as 'resolution'.")
    if power == wanted_power:
        return factor / (_TURN if _is_hertz(wanted) else 1.0) * (_TURN if _is_hertz(given) else 1.0)
    if wanted_power == -1 and power == 0 and wanted_dimension == "[length]":
        raise UnitError(f"the unit is {given}, but {wanted} is wanted.", remedy=f"Say per which angle: {given}/rev or {given}/rad.")
    if power == -1 and wanted_power == 1 and dimension == "dimensionless":
        raise UnitError(f"the unit is {given}, but {wanted} is wanted.", remedy="Give the angle of one count, as in '0.036 deg'.")
    # a feed is the travel of one turn
    return factor * _TURN if power == -1 and wanted_power == 0 and dimension == "[length]" else factor


def convertible(given: str, wanted: str) -> bool:
    """Return whether ``conversion`` has an answer; raises :class:`UnitError` for what is no unit."""
    si_factor(given)
    si_factor(wanted)
    try:
        conversion(given, wanted)
    except UnitError:
        return False
    return True


def is_count(unit: str) -> bool:
    """Return whether a unit counts the steps of an encoder."""
    return unit.strip() in _COUNTS


_COUNTS = ("count", "counts", "encoder_count", "encoder_counts", "increment", "increments", "pulse", "pulses", "tick", "ticks")
_ACCELERATION = "[length] / [time] ** 2"


def _is_hertz(unit: str) -> bool:
    return unit.strip() in ("Hz", "kHz", "mHz", "MHz", "hertz", "1/min", "min^-1")


def _turning_power(unit: str) -> int:
    """Return the power of the angle, where Hz are turns a second and 1/min turns a minute."""
    return 1 if _is_hertz(unit) else angle_power(unit)


def dimension_text(dimensionality: Mapping[str, float]) -> str:
    """Return a dimension as text, alike for all units of one kind: ``[length] * [mass] / [time] ** 2`` for N as for lbf."""
    above, below = (
        [f"{name} ** {abs(power):g}" if abs(power) != 1 else name for name, power in sorted(dimensionality.items()) if power * sign > 0]
        for sign in (1, -1)
    )
    return " / ".join([" * ".join(above) or "1", *below]) if above or below else "dimensionless"


def same_dimension(first: str, second: str) -> bool:
    """Return whether two units measure the same kind of thing; ``rad`` and ``1`` do."""
    return first == second or si_factor(first)[1] == si_factor(second)[1]


def from_si(value: float, unit: str) -> float:
    """Return the SI number ``value`` in ``unit``."""
    return value / si_factor(unit)[0]


def in_unit(value: float, unit: str, form: str = ".4g") -> str:
    """Return an SI value as text in a unit, with its name: ``in_unit(0.0012, "mm", ".3f")`` is ``"1.200 mm"``."""
    return f"{from_si(value, unit):{form}} {unit}"


def split_quantity(text: str) -> tuple[float, str]:
    """Return number and unit of ``"12.5 mm/s"``; the unit is empty where there is none."""
    head, _, tail = text.strip().partition(" ")
    try:
        return float(head), tail.strip()
    except ValueError:
        pass
    for end in range(len(text.strip()), 0, -1):
        try:
            return float(text.strip()[:end]), text.strip()[end:].strip()
        except ValueError:
            continue
    raise UnitError(f"'{text}' is not a number with a unit.", remedy="Write a number and a unit, for example '5 ms'.")


@functools.lru_cache(maxsize=4096)
def quantity(text: str, unit: str) -> float:
    """Return the SI value of ``text``, which must measure the same kind of thing as ``unit``.

    A pure number is right only where ``unit`` is ``"1"``.
    """
    value, given = split_quantity(text)
    if not math.isfinite(value):
        raise UnitError(f"'{text}' is not a finite number.", remedy="Write a number and a unit.")
    if not given:
        if si_factor(unit)[1] == "dimensionless" and unit.strip() in ("", "1"):
            return value
        raise UnitError(f"'{text}' has no unit.", remedy=f"Write it with one, for example '{text.strip()} {unit}'.")
    si_factor(given)
    try:
        factor = conversion(given, unit)
    except UnitError as error:
        raise UnitError(f"'{text}' is given in {given}, but {unit} is wanted.", remedy=error.remedy) from None
    return value * factor


def product_unit(first: str, second: str) -> str:
    """Return the unit of a product: ``"1/s"`` for ``"1/m"`` and ``"m/s"``."""
    unit = registry().Unit(first) * registry().Unit(second)
    return "1" if unit.dimensionless else f"{unit:~C}"
