"""The read-outs of the bench."""

from __future__ import annotations

from collections.abc import Sequence

from rich.segment import Segment
from textual.strip import Strip
from textual.widget import Widget

from lathesim.tui.drawing.readings import Reading

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
        self.readings: tuple[Reading, ...] = ()

    def show(self, readings: Sequence[Reading]) -> None:
        """Show read-outs."""
        if tuple(readings) != self.readings:
            self.readings = tuple(readings)
            self.refresh()

    def render_line(self, y: int) -> Strip:
        """Return a row: title, actual and commanded value."""
        width = self.size.width
        if y > len(self.readings) or not self.readings:
            return Strip.blank(width, self.rich_style)
        reading = Reading("", "actual", "command") if y == 0 else self.readings[y - 1]
        column = max(0, (width - _TITLE) // 2)
        parts = (
            ("title", reading.title[:_TITLE].ljust(_TITLE)),
            ("wanted" if y == 0 else "actual", reading.actual.rjust(column)),
            ("wanted", reading.wanted.rjust(column)),
        )
        strip = Strip([Segment(text, self.get_component_rich_style(f"readings--{name}")) for name, text in parts])
        return strip.crop_extend(0, width, self.rich_style)
