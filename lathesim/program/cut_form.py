"""Part programs made from a form: the same few quantities as text, with their units."""

from __future__ import annotations

from lathesim.errors import UnitError
from lathesim.program.new_program import Process, straight_cut, taper_cut
from lathesim.units import quantity, same_dimension, split_quantity


def straight_from_form(*, diameter: str, length: str, face: str, clearance: str, feed: str, speed: str) -> str:
    """Return the text of a straight cut; raises :class:`UnitError` and :class:`ProgramError` in words for a person."""
    return straight_cut(
        diameter=_length(diameter),
        length=_length(length),
        face=_length(face),
        clearance=_length(clearance),
        process=_process(feed, speed),
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
