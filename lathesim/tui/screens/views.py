"""Views that open over a screen: stability lobes, the tool point in frequency, and commands as forms to fill in."""

from __future__ import annotations

import math
import os
import shlex
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

import numpy as np
from textual import on
from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical
from textual.widgets import Button, Input, Label, RichLog, Static

from lathesim.errors import LessonError
from lathesim.lessons.lesson import Lesson, results_folder
from lathesim.record import FloatArray
from lathesim.stability.choose_modes import FoundModes, find_modes
from lathesim.stability.frequency_limit import speeds_of
from lathesim.stability.lesson_settings import cut_of, tap_lesson
from lathesim.stability.lobes import stability_map
from lathesim.stability.tool_point import FrequencyResponse
from lathesim.tui.drawing.curves import MICROMETRES, PlotLine
from lathesim.tui.model.workbench import fault_words
from lathesim.tui.screens.workbench_screen import Dialog, dialog_buttons
from lathesim.tui.widgets.time_plot import TimePlot
from lathesim.units import from_si, in_unit

if TYPE_CHECKING:
    from lathesim.tui.app import LathesimApp


_SHOWN = 1.6
"""The response is shown up to so many times the highest mode."""


@dataclass(frozen=True, eq=False)
class ToolPointSeen:
    """Frequencies [Hz], real parts of response and fitted modes [m/N], all (lines,), the command for it, and what is said of it."""

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
    shown = response.frequency <= _SHOWN * max(item.frequency.value for item in found.modes)
    frequency = response.frequency[shown]
    return ToolPointSeen(
        frequency, response.receptance_values.real[shown], found.model.response(frequency).real, command, f"{begun}\n{_words(found)}"
    )


def _response(lesson: Lesson) -> tuple[FrequencyResponse, str, str, int | None]:
    """Return the response of a tool point, the command that gives it, how it was found, and the number of modes where it is known."""
    entry = lesson.settings.tool_point
    if entry is not None and entry.assembly is not None:
        from lathesim.stability.assembly_file import load_assembly, tip_response

        loaded = load_assembly(lesson.path.parent / entry.assembly)
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


class LobesView(Dialog[None]):
    """Shows the limit of the chip width over the spindle speed; :class:`LessonError` without a tool point, or of an interrupted cut."""

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
            yield dialog_buttons("", "Close")

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


class ToolPointView(Dialog[None]):
    """Shows the real part of the response with the fitted modes; raises :class:`LessonError` where the lesson has no tool point."""

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
            yield dialog_buttons("", "Close")

    def on_mount(self) -> None:
        """Find the response beside the app, which goes on."""
        threading.Thread(target=self._find, daemon=True).start()

    def _find(self) -> None:
        try:
            found: ToolPointSeen | str = tool_point_seen(self._lesson)
        except Exception as error:
            found = fault_words(error)
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


@dataclass(frozen=True)
class CommandField:
    """A field of a form: its title, an example, and the option that takes its text; without an option the text stands by itself."""

    title: str
    example: str
    option: str = ""
    text: str = ""


class CommandForm(Dialog[None]):
    """Fills in a command of ``lathesim``, runs it beside the app, and shows what it prints. Closing the form ends the command."""

    DEFAULT_CSS = """
    CommandForm .dialog { width: 96%; max-width: 140; height: 92%; }
    CommandForm .field { height: 1; }
    CommandForm .field Label { width: 28; }
    CommandForm .field Input { width: 1fr; }
    CommandForm #line { height: auto; max-height: 3; color: $text-muted; }
    CommandForm RichLog { height: 1fr; }
    """

    def __init__(self, title: str, words: Sequence[str], fields: Sequence[CommandField], *, of_bench: bool = False) -> None:
        """Take ``title``, the first ``words`` of the command and its fields; ``of_bench`` adds case and values of the bench."""
        super().__init__()
        self._title, self._words, self._fields, self._of_bench = title, list(words), list(fields), of_bench
        self._process: subprocess.Popen[str] | None = None

    def compose(self) -> ComposeResult:
        """Return the fields, the command they make, what it prints, and two buttons."""
        if self._of_bench:
            self._fields.append(CommandField("Case and values", "--variant I --set x_dac.bits=12", text=self._options_of_bench()))
        with Vertical(classes="dialog"):
            yield Label(self._title, markup=False)
            for place, field in enumerate(self._fields):
                with Horizontal(classes="field"):
                    yield Label(field.title)
                    yield Input(field.text, placeholder=field.example, id=f"field-{place}", compact=True)
            yield Static("", id="line", markup=False)
            yield RichLog(wrap=True, min_width=20)
            yield dialog_buttons("Run", "Close")

    def _options_of_bench(self) -> str:
        setup = cast("LathesimApp", self.app).workbench.setup
        return shlex.join(shlex.split(setup.command())[3:]) if setup is not None else ""

    def on_mount(self) -> None:
        """Show the command; a machine that was rebuilt on the bench is in no lesson that a command could take."""
        self._show_line()
        setup = cast("LathesimApp", self.app).workbench.setup
        if self._of_bench and setup is not None and setup.needs_file:
            self.query_one(RichLog).write(
                "Other parts and effects of the bench are left out. Save them as a lesson first, with Ctrl+S in Configure."
            )

    @property
    def words(self) -> list[str]:
        """The words of the command as it is filled in; raises :class:`ValueError` where a quotation mark is open."""
        found = list(self._words)
        for place, field in enumerate(self._fields):
            text = self.query_one(f"#field-{place}", Input).value.strip()
            found += [field.option, text] if field.option and text else shlex.split(text)
        return found

    @on(Input.Changed)
    def _show_line(self) -> None:
        try:
            line = f"$ {shlex.join(['lathesim', *self.words])}"
        except ValueError:
            line = "A quotation mark is not closed."
        self.query_one("#line", Static).update(line)

    @on(Input.Submitted)
    @on(Button.Pressed, "#take")
    def _run(self) -> None:
        log = self.query_one(RichLog)
        try:
            words = self.words
        except ValueError:
            return
        if self._process is not None and self._process.poll() is None:
            self.notify("The command is still at work. Close the form to end it.")
            return
        log.clear()
        log.write("Working ...")
        self._process = subprocess.Popen(
            [sys.executable, "-m", "lathesim", *words],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            encoding="utf-8",
            env={**os.environ, "NO_COLOR": "1", "COLUMNS": str(max(40, log.size.width - 2)), "PYTHONUTF8": "1"},
        )
        threading.Thread(target=self._read, args=(self._process,), daemon=True).start()

    def _read(self, process: subprocess.Popen[str]) -> None:
        assert process.stdout is not None
        with process.stdout as lines:
            for line in lines:
                self._write(line.rstrip())
        code = process.wait()
        self._write("Done." if code == 0 else f"Ended with the exit code {code}.")

    def _write(self, line: str) -> None:
        if self.is_attached and self.app.is_running:
            self.call_later(self.query_one(RichLog).write, line)

    def on_unmount(self) -> None:
        """End the command."""
        if self._process is not None:
            self._process.terminate()


def _form(title: str, words: str, *fields: CommandField, of_bench: bool = False) -> Callable[[Lesson], CommandForm]:
    """Return what makes the form of a command that takes the lesson on the bench."""
    return lambda lesson: CommandForm(title, [*words.split(), _word(lesson)], fields, of_bench=of_bench)


sweep_form = _form(
    "Sweep",
    "sweep",
    CommandField("What is varied", "x_controller.proportional+z_controller.proportional=0.2..0.8:4", "--vary"),
    CommandField("Metric", "that of the goal", "--metric"),
    of_bench=True,
)
circle_form = _form("Circular test", "circle", CommandField("Picture", "circle.png", "--save"), of_bench=True)
isolable_form = _form(
    "Ask before you record",
    "isolable",
    CommandField("Sensors", "x_encoder.position,x_controller.voltage; empty: those of the lesson", "--sensors"),
    CommandField("Rows a second", "200 Hz, or empty", "--rate"),
    CommandField("Part program", "another one, or empty", "--program"),
    CommandField("Effect", "CoulombFriction, or empty for all", "--effect"),
    CommandField("Case", "a variant of the lesson, or empty", "--variant"),
)
remedy_form = _form(
    "Remedy",
    "remedy",
    CommandField("Diagnosis", "mine.json, as 'lathesim diagnose --json' writes it"),
    CommandField("As", "lesson, program or table", "--as"),
    CommandField("Folder for the files", "remedy", "--out", "remedy"),
)
class_form = _form(
    "New class",
    "class new",
    CommandField("List of the class", "students.csv", "--students"),
    CommandField("Folder of the class", "class", "--out", "class"),
    CommandField("Effects to hide", "CoulombFriction@x_axis, or empty", "--effect"),
)


def grade_form(lesson: Lesson) -> CommandForm:
    """Return the form that holds records against the goals of a lesson."""
    runs = shlex.join(str(path) for path in sorted(results_folder(lesson).glob("*.h5")))
    return CommandForm("Grade", ["grade", _word(lesson)], [CommandField("Records", "lathesim_runs/01_contour_error/001.h5", text=runs)])


def class_grade_form(lesson: Lesson) -> CommandForm:
    """Return the form that grades what a class handed in."""
    return CommandForm("Grade a class", ["class", "grade"], [CommandField("Folder of the class", "class", text="class")])


def _word(lesson: Lesson) -> str:
    from lathesim.tui.model.machine_tree import Setup

    return Setup(lesson).lesson_word
