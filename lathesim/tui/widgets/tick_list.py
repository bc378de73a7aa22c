"""A list whose entries are ticked: ✓ or nothing, so that colour is not the only sign."""

from __future__ import annotations

from typing import Generic, TypeVar

from rich.segment import Segment
from textual.strip import Strip
from textual.widgets import SelectionList
from textual.widgets.option_list import OptionDoesNotExist

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
