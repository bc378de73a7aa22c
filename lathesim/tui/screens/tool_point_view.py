"""The tool point of a lesson: tapped, measured or put together from beams, with the modes that were fitted."""

from __future__ import annotations

import threading

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Horizontal, Vertical
from textual.screen import ModalScreen
from textual.widgets import Button, Label, Static

from lathesim.errors import LatheSimError, LessonError
from lathesim.lessons.lesson import Lesson
from lathesim.tui.drawing.curves import Line
from lathesim.tui.model.tool_point import ToolPointSeen, tool_point_seen
from lathesim.tui.widgets.time_plot import TimePlot


class ToolPointView(ModalScreen[None]):
    """Shows the real part of the response with the fitted modes; raises :class:`LessonError` where the lesson has no tool point."""

    BINDINGS = [Binding("escape", "dismiss(None)", "Close")]
    DEFAULT_CSS = """
    ToolPointView .dialog { width: 96%; max-width: 140; height: 90%; }
    ToolPointView TimePlot { height: 1fr; }
    ToolPointView #modes { height: auto; }
    """

    def __init__(self, lesson: Lesson) -> None:
        super().__init__()
        if lesson.settings.tool_point is None:
            raise LessonError("the lesson has no tool point.", place=str(lesson.path), remedy="Give 'tool_point:' with its modes.")
        self._lesson = lesson

    def compose(self) -> ComposeResult:
        """Return the plot, what it says, and a button."""
        with Vertical(classes="dialog"):
            yield Label(f"Tool point: {self._lesson.title}", markup=False)
            yield TimePlot(id="response")
            yield Static("Tapping the tool and fitting its modes ...", id="modes", markup=False)
            with Horizontal(classes="buttons"):
                yield Button("Close", id="leave", compact=True, variant="primary")

    def on_mount(self) -> None:
        """Find the response beside the app, which goes on."""
        threading.Thread(target=self._find, daemon=True).start()

    def _find(self) -> None:
        try:
            found: ToolPointSeen | str = tool_point_seen(self._lesson)
        except LatheSimError as error:
            found = str(error)
        except Exception as error:
            found = f"This is a fault of the program, not of your input: {type(error).__name__}: {error}"
        if self.is_attached and self.app.is_running:
            self.call_later(self._show, found)

    def _show(self, found: ToolPointSeen | str) -> None:
        if not self.is_attached:
            return
        words = self.query_one("#modes", Static)
        if isinstance(found, str):
            words.update(found)
            return
        lines = [Line(found.frequency, 1e6 * found.real, "response"), Line(found.frequency, 1e6 * found.fitted, "fitted modes")]
        self.query_one(TimePlot).show_lines(lines, "frequency / Hz", "real part / (um/N)")
        words.update(f"{found.words}\nThe same: {found.command}")

    @on(Button.Pressed, "#leave")
    def _leave(self) -> None:
        self.dismiss(None)
