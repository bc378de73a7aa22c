"""Small controls: a slider, a list to look through, and a list to tick."""

from __future__ import annotations

from typing import Generic, TypeVar

from rich.segment import Segment
from textual import events
from textual.binding import Binding
from textual.message import Message
from textual.strip import Strip
from textual.widget import Widget
from textual.widgets import OptionList, SelectionList
from textual.widgets.option_list import OptionDoesNotExist


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

    class Moved(Message):
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
        self.post_message(self.Moved(self._value))

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
