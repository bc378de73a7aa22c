"""The read-outs of the bench: what is asked for and what is, at one instant of a record."""

from __future__ import annotations

import math
from dataclasses import dataclass

from lathesim.analysis.display_unit import shown_with_unit
from lathesim.analysis.metrics.metric import find_channel
from lathesim.record import Record

NONE = "-"
"""Shown where a machine has no such channel."""


@dataclass(frozen=True)
class Reading:
    """One line of the read-outs: what is asked for (``wanted``, empty where nothing is) and what is."""

    title: str
    actual: str
    wanted: str = ""


def readings(record: Record, sample: int, *, as_diameter: bool = False) -> list[Reading]:
    """Return the read-outs at a sample; quantities the record does not hold are shown as ``-``."""
    values = _At(record, sample)
    factor, sign = (2.0, "Ø") if as_diameter else (1.0, "R")
    speed = values.length("x_axis.velocity", "z_axis.velocity")
    return [
        Reading("Time", f"{record.time[sample]:.2f} s" if len(record) else NONE),
        Reading(f"X {sign}", values.shown("m", "x_axis.position", factor=factor), values.shown("m", ".x_reference", factor=factor)),
        Reading("Z", values.shown("m", "z_axis.position"), values.shown("m", ".z_reference")),
        Reading("Error", values.shown("m", "contour.contour_error", ".contour_error") if values.in_cut else "not in cut"),
        Reading("Spindle", values.shown("rad/s", "spindle.speed"), values.shown("rad/s", ".spindle_reference")),
        Reading("Feed", _text(speed, "m/s"), values.shown("m/s", ".feed_speed")),
        Reading("Feed/rev", values.shown("m", "cutting.feed"), values.shown("m", ".feed_per_revolution")),
        Reading("Depth", values.shown("m", ".depth_of_cut")),
        Reading("Force", values.shown("N", ".cutting_force")),
        Reading("Roughness", values.shown("m", ".roughness")),
    ]


def blank_readings(*, as_diameter: bool = False) -> list[Reading]:
    """Return the read-outs before anything ran."""
    x = "X Ø" if as_diameter else "X R"
    titles = ("Time", x, "Z", "Error", "Spindle", "Feed", "Feed/rev", "Depth", "Force", "Roughness")
    return [Reading(title, NONE) for title in titles]


def program_line(record: Record, sample: int) -> int | None:
    """Return the line of the part program in work at a sample, or None where the record does not tell."""
    name = find_channel(record, ".program_line")
    if name is None or not 0 <= sample < len(record):
        return None
    value = record[name][sample]
    return int(value) if math.isfinite(value) and value > 0 else None


@dataclass(frozen=True)
class _At:
    record: Record
    sample: int

    def value(self, *wanted: str) -> float:
        name = find_channel(self.record, *wanted)
        return float(self.record[name][self.sample]) if name is not None and 0 <= self.sample < len(self.record) else math.nan

    @property
    def in_cut(self) -> bool:
        """Whether the tool cuts; a contour error of a rapid move says nothing of the part."""
        return not self.value(".engaged", ".in_contact") < 0.5

    def shown(self, unit: str, *wanted: str, factor: float = 1.0) -> str:
        return _text(self.value(*wanted) * factor, unit)

    def length(self, *wanted: str) -> float:
        return math.hypot(*(self.value(name) for name in wanted))


def _text(value: float, unit: str) -> str:
    return shown_with_unit(value, unit) if math.isfinite(value) else NONE
