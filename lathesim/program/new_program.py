"""Part programs made from a few numbers: the taper cut and the straight cut of Liu and Landers' simulator, in the dialect ``paper``.

The tool cuts toward +z, as in the paper: the face of the stock lies at ``face``, the tool starts and ends at X0 Z0 in front of it.
Source: Liu, Landers, A Modular Machine Tool Simulator (2004), section Part program (TAPER CUT, STRAIGHT CUT) and example 2. The paper
does not print the fields of its dialogues beyond naming geometry and process variables; those here are what the cuts need.
Left out: several passes, and what the stock's own size asks for; the depth of cut follows from the stock of the lesson.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from lathesim.errors import ProgramError, UnitError
from lathesim.units import quantity, same_dimension, split_quantity


@dataclass(frozen=True)
class Process:
    """How to cut: feed [m/s], with ``per_revolution`` [m] per revolution; spindle speed [rad/s], with ``surface`` [m/s]."""

    feed: float
    speed: float
    per_revolution: bool = False
    surface: bool = False


def straight_cut(*, diameter: float, length: float, face: float, clearance: float, process: Process) -> str:
    """Return the text of a straight cut: one pass at ``diameter`` over ``length`` behind the face; lengths [m]."""
    return taper_cut(small_diameter=diameter, large_diameter=diameter, length=length, face=face, clearance=clearance, process=process)


def taper_cut(*, small_diameter: float, large_diameter: float, length: float, face: float, clearance: float, process: Process) -> str:
    """Return the text of a taper cut: one pass from ``small_diameter`` at the face to ``large_diameter`` at ``length`` behind it.

    The tool comes to ``clearance`` in front of the face in rapid traverse, feeds to the face, along the taper, out of the part by
    ``clearance`` and returns to X0 Z0. Lengths [m]. Raises :class:`ProgramError` where the numbers make no such cut.
    """
    _check(small_diameter, large_diameter, length, face, clearance, process)
    small, large = 0.5 * small_diameter, 0.5 * large_diameter
    straight = small_diameter == large_diameter
    kind = "Straight cut" if straight else "Taper cut"
    sizes = f"diameter {_mm(large_diameter)} mm" if straight else f"diameters {_mm(small_diameter)} to {_mm(large_diameter)} mm"
    feed = _number(process.feed * (1e3 if process.per_revolution else 6e4))
    speed = _number(process.speed * 60.0 / (1.0 if process.surface else 2.0 * math.pi))
    blocks = [
        f"G90 {'G95' if process.per_revolution else 'G94'} G71",
        f"{'G96' if process.surface else 'G97'} S{speed} M03",
        f"G00 X{_mm(small)} Z{_mm(face - clearance)}",
        f"G01 Z{_mm(face)} F{feed}",
        f"{'' if straight else f'X{_mm(large)} '}Z{_mm(face + length)}",
        f"X{_mm(large + clearance)}",
        "G00 Z0.0",
        "X0.0 M05",
        "M30",
    ]
    title = f"({kind}: {sizes}, length {_mm(length)} mm, face at Z{_mm(face)}; X is a radius)"
    return "\n".join([title, *(f"N{10 * number} {block}" for number, block in enumerate(blocks, start=1))]) + "\n"


def _check(small_diameter: float, large_diameter: float, length: float, face: float, clearance: float, process: Process) -> None:
    for name, value in (
        ("diameter", small_diameter),
        ("length", length),
        ("clearance", clearance),
        ("feed", process.feed),
        ("speed", process.speed),
    ):
        if not (math.isfinite(value) and value > 0.0):
            raise ProgramError(f"The {name} of the cut is {value:g}, and it has to be above 0.", remedy=f"Give a {name} above 0.")
    if large_diameter < small_diameter:
        raise ProgramError(
            f"The large diameter {_mm(large_diameter)} mm is below the small one, {_mm(small_diameter)} mm.",
            remedy="The taper widens away from the face; exchange the two.",
        )
    if not math.isfinite(large_diameter) or not math.isfinite(face):
        raise ProgramError("A number of the cut is not finite.", remedy="Give lengths in mm.")
    if face - clearance < 0.0:
        raise ProgramError(
            f"The tool would wait at Z{_mm(face - clearance)}, and it starts from Z0 in front of the part.",
            remedy="Put the face further away or the clearance smaller.",
        )


def _number(value: float) -> str:
    text = f"{value:.6f}".rstrip("0")
    return f"{text}0" if text.endswith(".") else text


def _mm(value: float) -> str:
    return _number(1e3 * value)


def straight_from_form(*, diameter: str, length: str, face: str, clearance: str, feed: str, speed: str) -> str:
    """Return the text of a straight cut; raises :class:`UnitError` and :class:`ProgramError` in words for a person."""
    return straight_cut(
        diameter=_length(diameter), length=_length(length), face=_length(face), clearance=_length(clearance), process=_process(feed, speed)
    )


def taper_from_form(*, large_diameter: str, small_diameter: str, length: str, face: str, clearance: str, feed: str, speed: str) -> str:
    """Return the text of a taper cut; raises as :func:`straight_from_form`."""
    return taper_cut(
        small_diameter=_length(small_diameter),
        large_diameter=_length(large_diameter),
        length=_length(length),
        face=_length(face),
        clearance=_length(clearance),
        process=_process(feed, speed),
    )


def _length(text: str) -> float:
    return quantity(_with_unit(text, "mm"), "m")


def _with_unit(text: str, usual: str) -> str:
    """Return a text that has a unit; where it has none, the remedy names the one that a shop writes."""
    if not split_quantity(text)[1]:
        raise UnitError(f"'{text}' has no unit.", remedy=f"Write it with one, for example '{text.strip()} {usual}'.")
    return text


def _process(feed: str, speed: str) -> Process:
    """Return feed and speed by their units: mm/min or mm (mm/rev), rpm or m/min."""
    per_revolution = same_dimension(split_quantity(_with_unit(feed, "mm/min"))[1], "m")
    surface = same_dimension(split_quantity(_with_unit(speed, "rpm"))[1], "m/s")
    return Process(
        feed=quantity(feed, "m" if per_revolution else "m/s"),
        speed=quantity(speed, "m/s" if surface else "rad/s"),
        per_revolution=per_revolution,
        surface=surface,
    )
