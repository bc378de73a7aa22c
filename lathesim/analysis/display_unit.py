"""SI numbers and names as a person reads them: millimetres for travel, micrometres for errors, turns a minute for spindles.

Inside the program everything is SI; this is the edge. Powers of ten only, except rpm and degrees.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

from lathesim.record import Place

_ROUNDED_UP = 0.9995
"""Share of a unit that three digits show as one."""
_WRITTEN_OUT = 1e9
_RESOLUTION = 1e-6
"""Share of the smallest display unit below which a value is shown as 0: it is a remainder of the arithmetic."""

_STEPS: dict[str, tuple[tuple[float, str], ...]] = {
    "m": ((1e-3, "mm"), (1e-6, "um"), (1e-9, "nm")),
    "m/s": ((1.0, "m/s"), (1e-3, "mm/s"), (1e-6, "um/s")),
    "feed": ((1e-3 / 60.0, "mm/min"),),
    "m/s^2": ((1.0, "m/s^2"), (1e-3, "mm/s^2")),
    "m^2": ((1e-6, "mm^2"), (1e-12, "um^2")),
    "m^2*s": ((1e-6, "mm^2*s"),),
    "m^3": ((1e-6, "cm^3"), (1e-9, "mm^3")),
    "m^3/s": ((1e-6, "cm^3/s"), (1e-9, "mm^3/s")),
    "s": ((1.0, "s"), (1e-3, "ms"), (1e-6, "us")),
    "N": ((1e3, "kN"), (1.0, "N"), (1e-3, "mN")),
    "N*m": ((1.0, "N*m"), (1e-3, "mN*m")),
    "V": ((1.0, "V"), (1e-3, "mV"), (1e-6, "uV")),
    "A": ((1.0, "A"), (1e-3, "mA"), (1e-6, "uA")),
    "W": ((1e3, "kW"), (1.0, "W"), (1e-3, "mW")),
    "J": ((1e3, "kJ"), (1.0, "J"), (1e-3, "mJ")),
    "Pa": ((1e6, "MPa"), (1e3, "kPa"), (1.0, "Pa")),
    "rad/s": ((2.0 * math.pi / 60.0, "rpm"),),
    "V/m": ((1e3, "V/mm"), (1.0, "V/m")),
    "N/m": ((1e6, "N/um"), (1e3, "N/mm"), (1.0, "N/m")),
}


def read_as(name: str, unit: str) -> str:
    """Return the SI unit of a channel or metric, and ``"feed"`` for a feed [m/s]: it reads in mm/min, as in a part program."""
    return "feed" if unit == "m/s" and name.endswith("feed_speed") else unit


def display_unit(unit: str, largest: float) -> tuple[float, str]:
    """Return what one display unit is in the SI ``unit``, and its name, such that ``largest`` reads between 1 and 1000.

    ``display_unit("m", 0.0006)`` gives ``(1e-6, "um")``; metres begin at millimetres, as in drawings. A unit without a choice is kept.
    """
    steps = _STEPS.get(unit)
    if steps is None:
        return 1.0, "" if unit == "1" else unit
    if largest == 0.0 or not math.isfinite(largest):
        plain = [step for step in steps if step[0] == 1.0]
        return plain[0] if plain else steps[0]
    for factor, name in steps:
        if abs(largest) >= _ROUNDED_UP * factor:
            return factor, name
    return steps[-1]


def resolved(value: float, unit: str) -> float:
    """Return an SI value, 0 where it lies below what the smallest display unit of its ``unit`` resolves."""
    steps = _STEPS.get(unit)
    return 0.0 if steps is not None and abs(value) < _RESOLUTION * steps[-1][0] else value


def shown_with_unit(value: float, unit: str, digits: int = 4) -> str:
    """Return an SI value with its display unit: ``"0.6845 mm"``, ``"18.48 s"``. Metres under 0.1 mm go to micrometres."""
    if not math.isfinite(value):
        return f"{value} {unit}".strip()
    value = resolved(value, unit)
    factor, name = display_unit(unit, value * 10.0 if unit == "m" else value)
    return f"{plain_number(value / factor, digits)} {name}".strip()


_SIGNS = (("um", "µm"), ("us", "µs"), ("uV", "µV"), ("uA", "µA"), ("^2", "²"), ("^3", "³"), ("*", "·"))


def pretty_unit(unit: str) -> str:
    """Return ``"N·s/m"`` for ``"N*s/m"``, and an empty text for a pure number."""
    unit = unit.replace("**", "^")
    while (bare := re.sub(r"\(([^()*/^ ]+)\)", r"\1", unit)) != unit:
        unit = bare
    for plain, sign in _SIGNS:
        unit = unit.replace(plain, sign)
    return "" if unit == "1" else unit


def pretty_quantities(text: str) -> str:
    """Return a text with the proper signs in the units behind its numbers: ``"5 um"`` becomes ``"5 µm"``."""
    return re.sub(r"(?<=\d )[A-Za-z][\w/*^]*", lambda found: pretty_unit(found[0]), text)


_IN_WORDS = {"max": "largest", "min": "smallest", "dac": "D/A", "adc": "A/D", "x": "X", "y": "Y", "z": "Z"}


def plain_name(name: str) -> str:
    """Return the name of a channel, parameter, part or metric in plain words: ``contour error`` for ``contour.contour_error``.

    Words of the part that the port repeats are left out.
    """
    part, port = Place.of(name) if "." in name else Place("", name)
    own = port.split("_")
    return " ".join(_IN_WORDS.get(word, word) for word in [*(word for word in part.split("_") if word and word not in own), *own])


def plain_number(value: float, digits: int) -> str:
    """Return a number with so many digits, large ones written out: ``130934`` rather than ``1.309e+05``."""
    text = f"{value:.{digits}g}"
    return f"{value:.0f}" if "e+" in text and abs(value) < _WRITTEN_OUT else text


def text_table(rows: Sequence[tuple[str, ...]], *, ruled: bool = True) -> list[str]:
    """Return rows, the first of which is the head, as lines with columns of one width; ``ruled``, a line stands under the head."""
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    return [lines[0], *(["  ".join("-" * width for width in widths)] if ruled else []), *lines[1:]]


BESIDE_NOTHING = 10.0
"""Ratio of missing to acting force from which on almost nothing acts (assumed): the ratio then says nothing about the missing force."""


def known_share(share: float) -> float:
    """Return a share of the acting force, NaN if almost nothing acts."""
    return share if share < BESIDE_NOTHING else math.nan
