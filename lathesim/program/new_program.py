"""Part programs made from a few numbers: the taper cut and the straight cut of Liu and Landers' simulator, in the dialect ``paper``.

The tool cuts toward +z, as in the paper: the face of the stock lies at ``face``, the tool starts and ends at X0 Z0 in front of it.
Source: Liu, Landers, A Modular Machine Tool Simulator (2004), section Part program (TAPER CUT, STRAIGHT CUT) and example 2. The paper
does not print the fields of its dialogues beyond naming geometry and process variables; those here are what the cuts need.
Left out: several passes, and what the stock's own size asks for; the depth of cut follows from the stock of the lesson.
"""

from __future__ import annotations

import math

from lathesim.errors import ProgramError, UnitError
from lathesim.units import quantity, same_dimension, split_quantity


def straight_from_form(*, diameter: str, length: str, face: str, clearance: str, feed: str, speed: str) -> str:
    """Return the text of a straight cut: one pass at ``diameter`` over ``length`` behind the face; raises as :func:`taper_from_form`."""
    return taper_from_form(
        large_diameter=diameter, small_diameter=diameter, length=length, face=face, clearance=clearance, feed=feed, speed=speed
    )


def taper_from_form(*, large_diameter: str, small_diameter: str, length: str, face: str, clearance: str, feed: str, speed: str) -> str:
    """Return the text of a taper cut: one pass from ``small_diameter`` at the face to ``large_diameter`` at ``length`` behind it.

    The tool comes to ``clearance`` in front of the face in rapid traverse, feeds to the face, along the taper, out of the part by
    ``clearance`` and returns to X0 Z0. The unit of the feed, mm/min or mm (mm/rev), and of the speed, rpm or m/min, says which is meant.
    Raises :class:`UnitError`, and :class:`ProgramError` where the numbers make no such cut.
    """
    small, large, long = _length(small_diameter), _length(large_diameter), _length(length)
    begin, gap = _length(face), _length(clearance)
    per_revolution = same_dimension(split_quantity(_with_unit(feed, "mm/min"))[1], "m")
    surface = same_dimension(split_quantity(_with_unit(speed, "rpm"))[1], "m/s")
    fed, turned = quantity(feed, "m" if per_revolution else "m/s"), quantity(speed, "m/s" if surface else "rad/s")
    for name, value in (("diameter", small), ("length", long), ("clearance", gap), ("feed", fed), ("speed", turned)):
        if not (math.isfinite(value) and value > 0.0):
            raise ProgramError(f"The {name} of the cut is {value:g}, and it has to be above 0.", remedy=f"Give a {name} above 0.")
    if large < small:
        fact = f"The large diameter {_mm(large)} mm is below the small one, {_mm(small)} mm."
        raise ProgramError(fact, remedy="The taper widens away from the face; exchange the two.")
    if not math.isfinite(large) or not math.isfinite(begin):
        raise ProgramError("A number of the cut is not finite.", remedy="Give lengths in mm.")
    if begin - gap < 0.0:
        fact = f"The tool would wait at Z{_mm(begin - gap)}, and it starts from Z0 in front of the part."
        raise ProgramError(fact, remedy="Put the face further away or the clearance smaller.")
    straight = small == large
    cut = f"Straight cut: diameter {_mm(large)} mm" if straight else f"Taper cut: diameters {_mm(small)} to {_mm(large)} mm"
    blocks = (
        f"G90 {'G95' if per_revolution else 'G94'} G71",
        f"{'G96' if surface else 'G97'} S{_number(turned * 60.0 / (1.0 if surface else 2.0 * math.pi))} M03",
        f"G00 X{_mm(0.5 * small)} Z{_mm(begin - gap)}",
        f"G01 Z{_mm(begin)} F{_number(fed * (1e3 if per_revolution else 6e4))}",
        f"{'' if straight else f'X{_mm(0.5 * large)} '}Z{_mm(begin + long)}",
        f"X{_mm(0.5 * large + gap)}",
        "G00 Z0.0",
        "X0.0 M05",
        "M30",
    )
    title = f"({cut}, length {_mm(long)} mm, face at Z{_mm(begin)}; X is a radius)"
    return "\n".join([title, *(f"N{10 * number} {block}" for number, block in enumerate(blocks, start=1))]) + "\n"


def _number(value: float) -> str:
    text = f"{value:.6f}".rstrip("0")
    return f"{text}0" if text.endswith(".") else text


def _mm(value: float) -> str:
    return _number(1e3 * value)


def _length(text: str) -> float:
    return quantity(_with_unit(text, "mm"), "m")


def _with_unit(text: str, usual: str) -> str:
    """Return a text that has a unit; where it has none, the remedy names the one that a shop writes."""
    if not split_quantity(text)[1]:
        raise UnitError(f"'{text}' has no unit.", remedy=f"Write it with one, for example '{text.strip()} {usual}'.")
    return text
