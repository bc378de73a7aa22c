"""The read-outs of the bench."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from rich.segment import Segment
from textual.strip import Strip
from textual.widget import Widget

from lathesim.analysis.display_unit import shown_with_unit
from lathesim.analysis.metric import CONTOUR_ERROR, SPINDLE_SPEED, find_channel
from lathesim.record import Record

NONE = "-"
"""Shown where a machine has no such channel."""


@dataclass(frozen=True)
class ReadOutLine:
    """One line of the read-outs: what is asked for (``wanted``, empty where nothing is) and what is."""

    title: str
    actual: str
    wanted: str = ""


def readings(record: Record, sample: int, *, as_diameter: bool = False, first: Sequence[str] = ()) -> list[ReadOutLine]:
    """Return the read-outs at a sample; quantities the record does not hold are shown as ``-``.

    With channels that come ``first``, they stand below the time, and of the others those follow that the record holds.
    """
    lines = _standard_readings(record, sample, as_diameter=as_diameter)
    own = [name for name in first if name in record]
    if not own:
        return lines
    values = _At(record, sample)
    shown = [ReadOutLine(name.partition(".")[2].replace("_", " "), values.shown(record.unit(name), name)) for name in own]
    return [lines[0], *shown, *(line for line in lines[1:] if line.actual != NONE)][: len(lines)]


def _standard_readings(record: Record, sample: int, *, as_diameter: bool) -> list[ReadOutLine]:
    values = _At(record, sample)
    factor, sign = (2.0, "Ø") if as_diameter else (1.0, "R")
    speed = values.length("x_axis.velocity", "z_axis.velocity")
    return [
        ReadOutLine("Time", f"{record.time[sample]:.2f} s" if len(record) else NONE),
        ReadOutLine(f"X {sign}", values.shown("m", "x_axis.position", factor=factor), values.shown("m", "x_reference", factor=factor)),
        ReadOutLine("Z", values.shown("m", "z_axis.position"), values.shown("m", "z_reference")),
        ReadOutLine("Error", values.shown("m", *CONTOUR_ERROR) if values.in_cut else "not in cut"),
        ReadOutLine("Spindle", values.shown("rad/s", *SPINDLE_SPEED), values.shown("rad/s", "spindle_reference")),
        ReadOutLine("Feed", _text(speed, "m/s"), values.shown("m/s", "feed_speed")),
        ReadOutLine("Feed/rev", values.shown("m", "cutting.feed"), values.shown("m", ".feed_per_revolution")),
        ReadOutLine("Depth", values.shown("m", "depth_of_cut")),
        ReadOutLine("Force", values.shown("N", "cutting_force")),
        ReadOutLine("Roughness", values.shown("m", "roughness")),
    ]


def blank_readings(*, as_diameter: bool = False) -> list[ReadOutLine]:
    """Return the read-outs before anything ran."""
    x = "X Ø" if as_diameter else "X R"
    titles = ("Time", x, "Z", "Error", "Spindle", "Feed", "Feed/rev", "Depth", "Force", "Roughness")
    return [ReadOutLine(title, NONE) for title in titles]


def program_line(record: Record, sample: int) -> int | None:
    """Return the line of the part program in work at a sample, or None where the record does not tell."""
    name = find_channel(record, "program_line")
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
        return not self.value("engaged", "in_contact") < 0.5

    def shown(self, unit: str, *wanted: str, factor: float = 1.0) -> str:
        return _text(self.value(*wanted) * factor, unit)

    def length(self, *wanted: str) -> float:
        return math.hypot(*(self.value(name) for name in wanted))


def _text(value: float, unit: str) -> str:
    return shown_with_unit(value, unit) if math.isfinite(value) else NONE


_TITLE = 10


class ReadOuts(Widget):
    """A table: what, what is, what is asked for. Rows are drawn without a new layout, ten times a second if need be."""

    COMPONENT_CLASSES = {"readings--title", "readings--actual", "readings--wanted"}
    DEFAULT_CSS = """
    ReadOuts {
        height: 11;
        & > .readings--title { color: $foreground; }
        & > .readings--actual { color: $foreground; text-style: bold; }
        & > .readings--wanted { color: $text-muted; }
    }
    """

    def __init__(self, id: str | None = None) -> None:
        super().__init__(id=id)
        self.readings: tuple[ReadOutLine, ...] = ()

    def show(self, readings: Sequence[ReadOutLine]) -> None:
        """Show read-outs."""
        if tuple(readings) != self.readings:
            self.readings = tuple(readings)
            self.refresh()

    def render_line(self, y: int) -> Strip:
        """Return a row: title, actual and commanded value."""
        width = self.size.width
        if y > len(self.readings) or not self.readings:
            return Strip.blank(width, self.rich_style)
        reading = ReadOutLine("", "actual", "command") if y == 0 else self.readings[y - 1]
        column = max(0, (width - _TITLE) // 2)
        parts = (
            ("title", reading.title[:_TITLE].ljust(_TITLE)),
            ("wanted" if y == 0 else "actual", reading.actual.rjust(column)),
            ("wanted", reading.wanted.rjust(column)),
        )
        strip = Strip([Segment(text, self.get_component_rich_style(f"readings--{name}")) for name, text in parts])
        return strip.crop_extend(0, width, self.rich_style)
