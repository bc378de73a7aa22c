"""Text quantities to SI and back; pint is used only here.

Inside the program every number is SI. ``quantity("0.25 V/mm", "V/m")`` gives 250.0; a number without a unit, an unknown unit and a
unit of another kind are refused with what was meant.
"""

from __future__ import annotations

import functools
import hashlib
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from lathesim.cache_folder import cache_folder
from lathesim.errors import UnitError
from lathesim.unit_table import known_unit


def _kept_definitions(pint: Any) -> Path:
    """Give the folder where this installation's unit definitions are kept ready.

    Each installation has its own: what is kept names the files it was read from, and fails once another environment is deleted.
    """
    installed = hashlib.sha256(f"{pint.__version__} {pint.__file__}".encode()).hexdigest()[:16]
    return cache_folder() / f"units-{installed}"


@functools.cache
def registry() -> Any:
    """Give the one unit registry, made when first asked for (pint takes a third of a second to load)."""
    import pint

    units: Any = pint.UnitRegistry(cache_folder=_kept_definitions(pint), autoconvert_offset_to_baseunit=True)
    units.define("percent = 0.01 = %")
    units.define("encoder_count = 1 = count")
    units.define("dollar = [currency] = $ = USD")
    return units


@functools.cache
def si_factor(unit: str) -> tuple[float, str]:
    """Give what one ``unit`` is in SI base units, and its dimension as text."""
    if unit.strip() in ("", "1"):
        return 1.0, "dimensionless"
    known = known_unit(unit)
    if known is not None:
        return known
    try:
        base = registry().Quantity(1.0, unit).to_base_units()
    except Exception as error:
        raise UnitError(f"'{unit}' is no unit.", remedy="Write units as in 'mm', 'm/s', 'N*s/m', 'V/mm', 'rpm'.") from error
    return float(base.magnitude), dimension_text(base.dimensionality)


def dimension_text(dimensionality: Mapping[str, float]) -> str:
    """Give a dimension as text, alike for all units of one kind: ``[length] * [mass] / [time] ** 2`` for N as for lbf."""
    above, below = (
        [f"{name} ** {abs(power):g}" if abs(power) != 1 else name for name, power in sorted(dimensionality.items()) if power * sign > 0]
        for sign in (1, -1)
    )
    if not (above or below):
        return "dimensionless"
    return " / ".join([" * ".join(above) or "1", *below])


def same_dimension(first: str, second: str) -> bool:
    """Say whether two units measure the same kind of thing; ``rad`` and ``1`` do."""
    return first == second or si_factor(first)[1] == si_factor(second)[1]


def to_si(value: float, unit: str) -> float:
    """Give ``value`` [``unit``] in SI."""
    return value * si_factor(unit)[0]


def from_si(value: float, unit: str) -> float:
    """Give the SI number ``value`` in ``unit``."""
    return value / si_factor(unit)[0]


def split_quantity(text: str) -> tuple[float, str]:
    """Give number and unit of ``"12.5 mm/s"``; the unit is empty where there is none."""
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
    raise UnitError(f"'{text}' is no quantity.", remedy="Write a number and a unit, for example '5 ms'.")


@functools.lru_cache(maxsize=4096)
def quantity(text: str, unit: str) -> float:
    """Give the SI value of ``text``, which must measure the same kind of thing as ``unit``.

    A pure number is right only where ``unit`` is ``"1"``.
    """
    value, given = split_quantity(text)
    if not math.isfinite(value):
        raise UnitError(f"'{text}' is not a finite number.", remedy="Write a number and a unit.")
    if not given:
        if si_factor(unit)[1] == "dimensionless" and unit.strip() in ("", "1"):
            return value
        raise UnitError(f"'{text}' has no unit.", remedy=f"Write it with one, for example '{text.strip()} {unit}'.")
    factor, dimension = si_factor(given)
    if dimension != si_factor(unit)[1]:
        raise UnitError(f"'{text}' is given in {given}, but {unit} is wanted.", remedy=f"Use a unit like {unit}.")
    return value * factor


def shown(value: float, unit: str, digits: int = 4) -> str:
    """Give an SI value as a person reads it, for example ``"0.684 mm"``: with the prefix that keeps the number between 1 and 1000."""
    if not math.isfinite(value):
        return f"{value} {unit}"
    if unit in _PREFIXED and value != 0.0:
        for factor, name in _PREFIXED[unit]:
            if abs(value) >= 0.9995 * factor:
                return f"{value / factor:.{digits}g} {name}"
        factor, name = _PREFIXED[unit][-1]
        return f"{value / factor:.{digits}g} {name}"
    return f"{value:.{digits}g}" if unit == "1" else f"{value:.{digits}g} {unit}"


_PREFIXED = {
    "m": [(1.0, "m"), (1e-3, "mm"), (1e-6, "um"), (1e-9, "nm")],
    "s": [(1.0, "s"), (1e-3, "ms"), (1e-6, "us")],
    "N": [(1e3, "kN"), (1.0, "N"), (1e-3, "mN")],
    "V": [(1.0, "V"), (1e-3, "mV")],
    "m/s": [(1.0, "m/s"), (1e-3, "mm/s"), (1e-6, "um/s")],
    "W": [(1e3, "kW"), (1.0, "W")],
}
