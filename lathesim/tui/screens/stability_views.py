"""Views of stability: the lobes of a lesson's cut, and the tool point in frequency."""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass

import numpy as np
from textual import on
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Horizontal, Vertical
from textual.screen import ModalScreen
from textual.widgets import Button, Label, Static

from lathesim.errors import LatheSimError, LessonError
from lathesim.lessons.lesson import Lesson
from lathesim.record import FloatArray
from lathesim.stability.choose_modes import FoundModes, find_modes
from lathesim.stability.frequency_limit import speeds_of
from lathesim.stability.lesson_settings import cut_of, tap_lesson
from lathesim.stability.lobes import stability_map
from lathesim.stability.tool_point import FrequencyResponse
from lathesim.tui.drawing.curves import MICROMETRES, PlotLine
from lathesim.tui.widgets.time_plot import TimePlot
from lathesim.units import from_si, in_unit

_SHOWN = 1.6
"""The response is shown up to so many times the highest mode."""


@dataclass(frozen=True, eq=False)
class ToolPointSeen:
    """Frequencies [Hz], the real part of the response and of the fitted modes [m/N], all (lines,), the command that does the same, and
    what is said of it."""

    frequency: FloatArray
    real: FloatArray
    fitted: FloatArray
    command: str
    words: str


def tool_point_seen(lesson: Lesson) -> ToolPointSeen:
    """Return the tool point of a lesson: modes are tapped with a hammer, a response is read, an assembly is coupled.

    Raises :class:`LessonError` where the lesson has none, and :class:`RecordingError` where nothing stands out of the noise.
    """
    response, command, begun, count = _response(lesson)
    found = find_modes(response, count)
    highest = max(item.frequency.value for item in found.modes)
    shown = response.frequency <= _SHOWN * highest
    frequency = response.frequency[shown]
    return ToolPointSeen(
        frequency,
        response.receptance_values.real[shown],
        found.model.response(frequency).real,
        command,
        f"{begun}\n{_words(found)}",
    )


def _response(lesson: Lesson) -> tuple[FrequencyResponse, str, str, int | None]:
    """Return the response of a tool point, the command that gives it, how it was found, and the number of modes where it is known."""
    entry = lesson.settings.tool_point
    if entry is not None and entry.assembly is not None:
        from lathesim.stability.assembly_file import load_assembly, tip_response

        path = lesson.path.parent / entry.assembly
        loaded = load_assembly(path)
        tip = tip_response(loaded)
        size = np.abs(tip.receptance_values)
        # a computed response has no noise, and its peaks are its modes
        peaks = int(np.count_nonzero((size[1:-1] > size[:-2]) & (size[1:-1] >= size[2:])))
        parts = "1 part" if len(loaded.beams) == 1 else f"{len(loaded.beams)} parts put together"
        return tip, f"lathesim couple {entry.assembly}", f"{loaded.title}: {parts}.", max(1, peaks)
    if entry is not None and entry.response is not None:
        from lathesim.stability.response_files import read_response

        measured = read_response(lesson.path.parent / entry.response.file, entry.response.quantity, entry.response.unit)
        return (
            measured,
            f"lathesim modes {entry.response.file}",
            f"Measured from {measured.frequency[0]:.3g} to {measured.highest:.0f} Hz.",
            None,
        )
    tapped = tap_lesson(lesson, lesson.settings.seed)
    out = [f"hit {hit.number}: {hit.reason}" for hit in tapped.hits if hit.reason]
    kept = sum(not hit.reason for hit in tapped.hits)
    said = f"Tapped {len(tapped.hits)} times, {kept} hits kept." + (f" Left out: {'; '.join(out)}." if out else "")
    return tapped.response, f"lathesim tap {lesson.path.stem} --out tap.csv", said, None


def _words(found: FoundModes) -> str:
    rows = []
    for number, item in enumerate(found.modes, 1):
        f, z, k = item.frequency, item.damping, item.stiffness
        reach = [50.0 * (estimate.high - estimate.low) / abs(estimate.value) for estimate in (f, z, k)]
        rows.append(
            f"mode {number}: {f.value:.2f} Hz (+-{reach[0]:.2g} %), damping {in_unit(z.value, '%', '.3f')} (+-{reach[1]:.2g} %), "
            f"stiffness {k.value:.4g} N/m (+-{reach[2]:.2g} %)"
        )
    lowest = float(np.min(found.model.response(np.linspace(1.0, 1.6 * found.modes[-1].frequency.value, 4000)).real))
    rows.append(f"The lowest real part, {from_si(lowest, 'um'):.3g} µm/N, sets the smallest limit.")
    return "\n".join(rows)


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
        self._widths = np.array([from_si(point.limit.width, "mm") for point in found.points])
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
        bound = _HIGHEST * from_si(self._smallest.width, "mm")
        shown = np.minimum(self._widths, bound) if math.isfinite(bound) else self._widths
        lines = [PlotLine(self._speeds, shown, "limit: above it the cut chatters")]
        if math.isfinite(bound):
            lines.append(PlotLine(self._speeds[[0, -1]], np.full(2, bound / _HIGHEST), "stable at every speed below"))
        self.query_one(TimePlot).show_lines(lines, "spindle speed / rpm", "chip width / mm")

    def _words(self) -> str:
        if not math.isfinite(self._smallest.width):
            return "Every width is stable at every speed."
        best = ", ".join(f"{speed:.0f}" for speed in speeds_of(self._smallest, 6))
        return f"Stable at every speed below {in_unit(self._smallest.width, 'mm')}. The line comes down to it at {best} rpm ..."

    @on(Button.Pressed, "#leave")
    def _leave(self) -> None:
        self.dismiss(None)


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
        lines = [
            PlotLine(found.frequency, MICROMETRES * found.real, "response"),
            PlotLine(found.frequency, MICROMETRES * found.fitted, "fitted modes"),
        ]
        self.query_one(TimePlot).show_lines(lines, "frequency / Hz", "real part / (µm/N)")
        words.update(f"{found.words}\nThe same: {found.command}")

    @on(Button.Pressed, "#leave")
    def _leave(self) -> None:
        self.dismiss(None)
