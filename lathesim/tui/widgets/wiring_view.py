"""The wiring of a part, drawn anew in every width."""

from __future__ import annotations

from typing import TYPE_CHECKING

from textual.widgets import Static

from lathesim.tui.drawing.wiring_box import wiring_box

if TYPE_CHECKING:
    from lathesim.lessons.simulate import Prepared


class WiringView(Static):
    """A part as a box with what feeds it and what it feeds."""

    DEFAULT_CSS = """
    WiringView { width: 1fr; padding: 0 1; }
    """

    def __init__(self, id: str | None = None) -> None:
        super().__init__("Choose a part to see its wiring.", id=id, markup=False)
        self._shown: tuple[Prepared, str] | None = None

    def show(self, case: Prepared, part: str) -> None:
        """Show the wiring of a part of a machine; no part where it is empty."""
        self._shown = (case, part) if part else None
        self._draw()

    def on_resize(self) -> None:
        """Draw anew in another width."""
        self._draw()

    def _draw(self) -> None:
        width = self.size.width or self.app.size.width
        self.update(wiring_box(*self._shown, width) if self._shown is not None else "Choose a part to see its wiring.")
