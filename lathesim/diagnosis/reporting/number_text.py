"""Numbers of a diagnosis as a person reads them: machinist's units, as many digits as the interval carries, proper signs."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable

from lathesim.analysis.display_unit import display_unit, pretty_unit, resolved
from lathesim.identification.signal import ROUNDING

_SMALLEST_PLAIN, _LARGEST_PLAIN = -4, 7
"""Powers of ten between which a number is written without an exponent."""
_ALMOST_ALL = 0.999
"""Share above which a number would round to all."""
_NEAR_AN_END = 0.05
"""Distance from nothing or all within which a share has a decimal."""
MINUS = "\N{MINUS SIGN}"
NOTHING = "\N{EN DASH}"
NOT_DETERMINED = "not determined here"
"""The interval of a value that a recording says nothing of."""
NARROW = "narrower than its last digit"
"""The interval of a value that is known to more digits than are shown."""
ARROW = "\N{RIGHTWARDS ARROW}"


def shared_unit(values: Iterable[float], unit: str) -> tuple[float, str]:
    """Return what one display unit is in the SI ``unit``, and its name, such that the largest of ``values`` reads well."""
    largest = max((abs(value) for value in values if math.isfinite(value)), default=0.0)
    factor, name = display_unit(unit, largest * 10.0 if unit == "m" else largest)
    return factor, pretty_unit(name)


def number(value: float, decimals: int | None = None, digits: int = 4) -> str:
    """Return a number with ``decimals``, or with as many digits that count."""
    if not math.isfinite(value):
        return NOTHING
    if value == 0.0:
        return "0"
    size = math.floor(math.log10(abs(value)))
    if not _SMALLEST_PLAIN <= size < _LARGEST_PLAIN and (decimals is None or size < 0):
        mantissa, _, power = f"{value:.{digits - 1 if decimals is None else max(0, decimals + size)}e}".partition("e")
        mantissa = mantissa.rstrip("0").rstrip(".") if decimals is None and "." in mantissa else mantissa
        return f"{mantissa}e{int(power)}".replace("-", MINUS)
    places = max(0, digits - 1 - size) if decimals is None else max(0, decimals)
    text = f"{value:.{places}f}"
    if not text.strip("-0."):
        return "0"
    if decimals is None and "." in text:
        text = text.rstrip("0").rstrip(".")
    return text.replace("-", MINUS)


def quantity_text(value: float, unit: str, digits: int = 4) -> str:
    """Return an SI value with its display unit: ``"27.3 µm"``."""
    value = resolved(value, unit)
    factor, name = shared_unit([value], unit)
    return f"{number(value / factor, digits=digits)} {name}".strip() if math.isfinite(value) else NOTHING


def interval_texts(value: float, low: float, high: float, unit: str, ends: tuple[bool, bool] = (False, False)) -> tuple[str, str]:
    """Return a value and its interval, both to the digit that the interval makes worth telling: ``("20.4 N", "20.2 to 20.6 N")``.

    An interval that ``ends`` at the lowest or the highest value that may be set has one end: ``"at most 20.6 N"``.
    """
    factor, name = shared_unit([value, low, high], unit)
    shown, least, most = value / factor, low / factor, high / factor
    if not (math.isfinite(least) and math.isfinite(most)) or all(ends):
        return quantity_text(value, unit, 2), NOT_DETERMINED
    half = 0.5 * abs(most - least)
    if half <= ROUNDING * max(abs(shown), abs(least), abs(most)):
        return quantity_text(value, unit), NARROW
    decimals = 1 - math.floor(math.log10(half))
    texts = [number(item, decimals) for item in (shown, least, most)]
    between = f"at most {texts[2]}" if ends[0] else f"at least {texts[1]}" if ends[1] else f"{texts[1]} to {texts[2]}"
    return f"{texts[0]} {name}".strip(), f"{between} {name}".strip()


def percent(share: float) -> str:
    """Return a share as ``"98 %"``, with a decimal where it is near nothing or all; less than all is never written as all."""
    if not math.isfinite(share):
        return NOTHING
    if _ALMOST_ALL < share < 1.0:
        return f"> {number(100.0 * _ALMOST_ALL, 1)} %"
    fine = 0.0 < min(abs(share), 1.0 - abs(share)) < _NEAR_AN_END
    return f"{number(100.0 * share, 1 if fine else 0)} %"


def probability_text(probability: float) -> str:
    """Return a probability; never as certainty."""
    return percent(min(probability, 1.0 - 1e-9))


def least_probable_text(probability: float) -> str:
    """Return how probable each of some names is, by the least of them: ``"at least 52 % probable"``."""
    return f"{'' if probability > _ALMOST_ALL else 'at least '}{probability_text(probability)} probable"


_PLAIN = str.maketrans({"µ": "u", "·": "*", "²": "^2", "³": "^3", MINUS: "-", NOTHING: "-"})


def plain(text: str) -> str:
    """Return text in the signs of a terminal: ``"2.0 um"``, ``"5 N*m"``."""
    return text.translate(_PLAIN)


def pretty(text: str) -> str:
    """Return text of a terminal in the signs of a page: ``"2.0 µm"``, ``"5 N·m"``, an arrow."""
    text = re.sub(r"(?<=\d )u(?=[mVs]\b)", "µ", text).replace("->", ARROW)
    return re.sub(r"(?<=[A-Za-z)])\*(?=[A-Za-z(])", "·", text)


def words(name: str) -> str:
    """Return ``x_axis.position`` with places where a line may break."""
    return name.replace("_", "_\N{ZERO WIDTH SPACE}").replace(".", ".\N{ZERO WIDTH SPACE}")
