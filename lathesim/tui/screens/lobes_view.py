"""The stability lobes of a lesson: below the line a cut is stable, above it chatters."""

from __future__ import annotations

import math

import numpy as np
from textual import on
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Horizontal, Vertical
from textual.screen import ModalScreen
from textual.widgets import Button, Label, Static

from lathesim.lessons.lesson import Lesson
from lathesim.stability.limits.frequency_limit import speeds_of
from lathesim.stability.limits.lesson_cut import cut_of
from lathesim.stability.limits.lobes import stability_map
from lathesim.tui.drawing.curves import Line
from lathesim.tui.widgets.time_plot import TimePlot

SPEEDS = (500.0, 8000.0, 301)
"""The speeds that are shown [rpm], and how many, as ``lathesim lobes`` has them."""
_HIGHEST = 6.0
"""Limits are drawn up to so many times the smallest."""


class LobesView(ModalScreen[None]):
    """Shows the limit of the chip width over the spindle speed; raises :class:`LessonError` where the lesson has no tool point,
    or an interrupted cut."""

    BINDINGS = [Binding("escape", "dismiss(None)", "Close")]
    DEFAULT_CSS = """
    LobesView .dialog { width: 96%; max-width: 140; height: 90%; }
    LobesView TimePlot { height: 1fr; }
    """

    def __init__(self, lesson: Lesson) -> None:
        super().__init__()
        self._title = lesson.title
        self._speeds = np.linspace(*SPEEDS)
        found = stability_map(cut_of(lesson), self._speeds.tolist(), "frequency")
        self._widths = np.array([1e3 * point.limit.width for point in found.points])
        self._smallest = found.smallest

    def compose(self) -> ComposeResult:
        """Return the plot and what it says."""
        with Vertical(classes="dialog"):
            yield Label(f"Stability lobes: {self._title}", markup=False)
            yield TimePlot(id="lobes")
            yield Static(self._words(), markup=False)
            with Horizontal(classes="buttons"):
                yield Button("Close", id="leave", compact=True, variant="primary")

    def on_mount(self) -> None:
        """Draw the limit; widths far above the smallest are left out."""
        self.call_after_refresh(self._draw)

    def _draw(self) -> None:
        bound = _HIGHEST * 1e3 * self._smallest.width
        shown = np.minimum(self._widths, bound) if math.isfinite(bound) else self._widths
        lines = [Line(self._speeds, shown, "limit: above it the cut chatters")]
        if math.isfinite(bound):
            lines.append(Line(self._speeds[[0, -1]], np.full(2, bound / _HIGHEST), "stable at every speed below"))
        self.query_one(TimePlot).show_lines(lines, "spindle speed / rpm", "chip width / mm")

    def _words(self) -> str:
        if not math.isfinite(self._smallest.width):
            return "Every width is stable at every speed."
        best = ", ".join(f"{speed:.0f}" for speed in speeds_of(self._smallest, 6))
        return f"Stable at every speed below {1e3 * self._smallest.width:.4g} mm. The line comes down to it at {best} rpm ..."

    @on(Button.Pressed, "#leave")
    def _leave(self) -> None:
        self.dismiss(None)
