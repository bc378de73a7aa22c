"""Part programs made from a form: the same few quantities as text, with their units."""

from __future__ import annotations

from lathesim.program.new_program import Process, straight_cut, taper_cut
from lathesim.units import quantity, same_dimension, split_quantity


def straight_from_form(*, diameter: str, length: str, face: str, clearance: str, feed: str, speed: str) -> str:
    """Return the text of a straight cut; raises :class:`UnitError` and :class:`ProgramError` in words for a person."""
    return straight_cut(
        diameter=quantity(diameter, "m"),
        length=quantity(length, "m"),
        face=quantity(face, "m"),
        clearance=quantity(clearance, "m"),
        process=_process(feed, speed),
    )


def taper_from_form(*, large_diameter: str, small_diameter: str, length: str, face: str, clearance: str, feed: str, speed: str) -> str:
    """Return the text of a taper cut; raises as :func:`straight_from_form`."""
    return taper_cut(
        small_diameter=quantity(small_diameter, "m"),
        large_diameter=quantity(large_diameter, "m"),
        length=quantity(length, "m"),
        face=quantity(face, "m"),
        clearance=quantity(clearance, "m"),
        process=_process(feed, speed),
    )


def _process(feed: str, speed: str) -> Process:
    """Return feed and speed by their units: mm/min or mm (mm/rev), rpm or m/min."""
    per_revolution = same_dimension(split_quantity(feed)[1] or "m/s", "m")
    surface = same_dimension(split_quantity(speed)[1] or "rpm", "m/s")
    return Process(
        feed=quantity(feed, "m" if per_revolution else "m/s"),
        speed=quantity(speed, "m/s" if surface else "rad/s"),
        per_revolution=per_revolution,
        surface=surface,
    )
