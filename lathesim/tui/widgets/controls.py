"""Small controls: a slider, a list to look through, a list to tick; the read-outs of the bench, and the table of the metrics."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np
from rich.segment import Segment
from rich.text import Text
from textual import events
from textual.binding import Binding
from textual.message import Message
from textual.strip import Strip
from textual.widget import Widget
from textual.widgets import DataTable, OptionList, SelectionList
from textual.widgets.option_list import Option, OptionDoesNotExist
from textual.widgets.selection_list import Selection

from lathesim.analysis.display_unit import plain_name, pretty_quantities, pretty_unit, read_as, shown_with_unit
from lathesim.analysis.metric import CONTOUR_ERROR, SPINDLE_SPEED, Measurements, Metric, find_channel, measure
from lathesim.component import ON
from lathesim.record import Place, Record


class Slider(Widget, can_focus=True):
    """One row; left and right move it, home and end go to the ends, the mouse takes it along."""

    COMPONENT_CLASSES = {"slider--done", "slider--rest", "slider--knob"}
    DEFAULT_CSS = """
    Slider {
        height: 1;
        & > .slider--done { color: $success; }
        & > .slider--rest { color: $text-muted; }
        & > .slider--knob { color: $foreground; text-style: bold; }
        &:focus > .slider--knob { color: $accent; }
    }
    """
    BINDINGS = [
        Binding("left", "step(-0.01)", "Back", show=False),
        Binding("right", "step(0.01)", "On", show=False),
        Binding("shift+left", "step(-0.1)", "Far back", show=False),
        Binding("shift+right", "step(0.1)", "Far on", show=False),
        Binding("home", "step(-1.0)", "Begin", show=False),
        Binding("end", "step(1.0)", "End", show=False),
    ]

    class Slid(Message):
        """A person moved the slider to ``value``."""

        def __init__(self, value: float) -> None:
            super().__init__()
            self.value = value

    def __init__(self, id: str | None = None) -> None:
        super().__init__(id=id)
        self._value = 1.0
        self._held = False

    @property
    def value(self) -> float:
        """Where the slider stands, 0 to 1; setting it tells nobody."""
        return self._value

    @value.setter
    def value(self, value: float) -> None:
        value = min(1.0, max(0.0, value))
        if value != self._value:
            self._value = value
            self.refresh()

    def action_step(self, by: float) -> None:
        """Move by a share of the whole."""
        self._move(self._value + by)

    def on_mouse_down(self, event: events.MouseDown) -> None:
        """Take hold of the knob."""
        self._held = True
        self.capture_mouse()
        self._move(event.x / max(1, self.size.width - 1))

    def on_mouse_move(self, event: events.MouseMove) -> None:
        """Take the knob along."""
        if self._held:
            self._move(event.x / max(1, self.size.width - 1))

    def on_mouse_up(self) -> None:
        """Let go of the knob."""
        self._held = False
        self.release_mouse()

    def _move(self, value: float) -> None:
        self.value = value
        self.post_message(self.Slid(self._value))

    def render_line(self, y: int) -> Strip:
        """Return the row."""
        width = self.size.width
        knob = round(self._value * max(0, width - 1))
        parts = (("slider--done", "━" * knob), ("slider--knob", "●"), ("slider--rest", "─" * max(0, width - knob - 1)))
        return Strip([Segment(text, self.get_component_rich_style(name)) for name, text in parts], width)


class BrowseList(OptionList):
    """An option list in which a single click only highlights; entries take one row each."""

    DEFAULT_CSS = """
    BrowseList { text-wrap: nowrap; text-overflow: ellipsis; border: none; padding: 0; }
    BrowseList:focus { border: none; }
    """

    def fill(self, rows: Iterable[str]) -> None:
        """Show other rows, and begin at the first."""
        self.clear_options()
        self.add_options([Option(Text(row)) for row in rows])
        self.highlighted = 0 if self.option_count else None

    def on_click(self, event: events.Click) -> None:
        """Highlight what was clicked; take it on a double click."""
        event.prevent_default()
        clicked = event.style.meta.get("option")
        if clicked is None:
            return
        self.highlighted = clicked
        if event.chain > 1:
            self.action_select()


Value = TypeVar("Value")
_TICK = "X"
"""What the base class shows, in another colour where an entry is not ticked."""


class TickList(SelectionList[Value], Generic[Value]):
    """A selection list that shows ✓ at what is ticked and a space elsewhere."""

    def fill_channels(self: TickList[str], known: Iterable[tuple[str, str, str]], wanted: str, chosen: Sequence[str]) -> None:
        """Show the channels, each a name with its unit and what it is, that hold the ``wanted`` text; the ``chosen`` are ticked."""
        with self.prevent(SelectionList.SelectedChanged):
            self.clear_options()
            for name, unit, doc in known:
                if any(wanted.lower() in text.lower() for text in (name, plain_name(name), doc)):
                    self.add_option(Selection(channel_words(name, unit, doc), name, name in chosen))

    def action_cursor_down(self) -> None:
        """Move down from the first entry where none has the cursor yet."""
        if self.highlighted is None:
            self.highlighted = 0
        super().action_cursor_down()

    def render_line(self, y: int) -> Strip:
        """Return one row."""
        strip = super().render_line(y)
        try:
            option = self.get_option_at_index(self._lines[self.scroll_offset.y + y][0])
        except (IndexError, OptionDoesNotExist):
            return strip
        sign = "✓" if option.value in self._selected else " "
        segments = list(strip)
        for place, segment in enumerate(segments):
            if segment.text == _TICK:
                segments[place] = Segment(sign, segment.style, segment.control)
                break
        return Strip(segments, strip.cell_length)


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
    ports = [Place.of(name).port for name in own]
    titles = [
        port.replace("_", " ").capitalize() if ports.count(port) == 1 else plain_name(Place.of(name).part)
        for name, port in zip(own, ports, strict=True)
    ]
    shown = [ReadOutLine(title, values.shown(read_as(name, record.unit(name)), name)) for title, name in zip(titles, own, strict=True)]
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
        ReadOutLine("Feed", _text(speed, "feed"), values.shown("feed", "feed_speed")),
        ReadOutLine("Feed/rev", values.shown("m", "cutting.feed"), values.shown("m", ".feed_per_revolution")),
        ReadOutLine("Depth", values.shown("m", "depth_of_cut")),
        ReadOutLine("Force", values.shown("N", "cutting_force")),
        ReadOutLine("Roughness", values.shown("m", "roughness")),
    ]


def blank_readings(*, as_diameter: bool = False) -> list[ReadOutLine]:
    """Return the read-outs before anything ran."""
    return [ReadOutLine(line.title, NONE) for line in _standard_readings(Record(np.zeros(0), {}, {}), 0, as_diameter=as_diameter)]


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
        return not self.value("engaged", "in_contact") < ON

    def shown(self, unit: str, *wanted: str, factor: float = 1.0) -> str:
        return _text(self.value(*wanted) * factor, unit)

    def length(self, *wanted: str) -> float:
        return math.hypot(*(self.value(name) for name in wanted))


def _text(value: float, unit: str) -> str:
    return pretty_quantities(shown_with_unit(value, unit)) if math.isfinite(value) else NONE


def channel_words(name: str, unit: str, doc: str) -> Text:
    """Return the row of a channel in a list: its name in plain words, its unit, and dim its exact name and what it is."""
    words = ((plain_name(name), "bold"), f" [{pretty_unit(unit) or '1'}] ", (f"{name}  {doc}", "dim"))
    return Text.assemble(*words, no_wrap=True, overflow="ellipsis")


_TITLE = 12


class ReadOuts(Widget):
    """A table: what, what is, what is asked for. Rows are drawn without a new layout, ten times a second if need be."""

    COMPONENT_CLASSES = {"readings--title", "readings--actual", "readings--wanted"}
    DEFAULT_CSS = """
    ReadOuts {
        height: 11;
        & > .readings--title { color: auto 90%; }
        & > .readings--actual { color: auto 90%; text-style: bold; }
        & > .readings--wanted { color: auto 75%; }
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


_NARROW, _NARROW_NAME = 60, 22
"""Columns of a narrow table, and those of its names: the values of two runs are to find room beside them."""


class MetricsTable(DataTable[Any]):
    """Shows what was measured on each run: the metric in plain words, the values, and dim its exact name."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self._measured: dict[Record, Measurements] = {}

    def show(self, runs: Sequence[tuple[str, Record]], first: Sequence[str], metrics: Mapping[str, Metric]) -> None:
        """Show the metrics that any of the runs has, those that come ``first`` above the others."""
        self.clear(columns=True)
        if not runs:
            return
        measured = [self._measurements(record, metrics) for _, record in runs]
        rows = [("metric", *(title[:24] for title, _ in runs), "exact name")]
        for name in dict.fromkeys([*first, *metrics]):
            if any(name in found.values for found in measured):
                cells = [str(found.values[name]) if name in found.values else NONE for found in measured]
                rows.append((plain_name(name), *map(pretty_quantities, cells), name))
        most = [_NARROW_NAME if self.size.width < _NARROW else math.inf] + [math.inf] * (len(rows[0]) - 1)
        # a width that is measured when the table is idle comes too late for the first picture
        for column, limit in zip(zip(*rows, strict=True), most, strict=True):
            self.add_column(Text(column[0]), width=int(min(limit, max(map(len, column)))))
        for *cells, name in rows[1:]:
            self.add_row(*map(Text, cells), Text(name, style="dim"))

    def _measurements(self, record: Record, metrics: Mapping[str, Metric]) -> Measurements:
        if record.status == "running":
            return measure(record, metrics)
        if record not in self._measured:
            self._measured[record] = measure(record, metrics)
        return self._measured[record]
