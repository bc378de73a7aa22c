"""Results: runs and older records, alone or laid over each other, as curves, numbers, figures and files."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterable
from pathlib import Path

from rich.text import Text
from textual import on
from textual.binding import Binding
from textual.containers import Horizontal, Vertical
from textual.widget import Widget
from textual.widgets import Input, Label, SelectionList, Static
from textual.widgets.selection_list import Selection

from lathesim.analysis.display_unit import plain_name
from lathesim.analysis.metric import CONTOUR_ERROR, find_channel
from lathesim.errors import LatheSimError
from lathesim.record import Record
from lathesim.tui.drawing.curves import (
    Cursors,
    Curve,
    contact,
    figure_title,
    overlaid,
    path_lines,
    peak_words,
    spectrum_lines,
    surface_lines,
    wave_lines,
)
from lathesim.tui.model.workbench import RUN, RUNS, BenchRun, fault_words, short_name
from lathesim.tui.screens.workbench_screen import WorkbenchScreen
from lathesim.tui.widgets.controls import MetricsTable, TickList
from lathesim.tui.widgets.time_plot import TimePlot

TIME, PATH, ERROR, SURFACE, SPECTRUM = "over time", "path", "contour error", "surface", "spectrum"
_FIGURE_ENDING = {TIME: "channels", PATH: "path", ERROR: "contour_error", SURFACE: "surface", SPECTRUM: "spectrum"}
_FIRST_CHANNELS = (*CONTOUR_ERROR, "following_error", "position")
_SEEN = {
    PATH: "The programmed path, and where the tip went.",
    SURFACE: "Roughness R_a along the part, from feed, nose and tool wear; of a cut in the loop the waves of its last turn.",
    SPECTRUM: "Amplitudes between the two cursors, or of the whole run.",
}
_STEPS = 100
"""Steps in which the cursor goes along the plot."""


class ResultsScreen(WorkbenchScreen):
    """Shows the runs that are ticked, and of them the channels that are ticked."""

    DEFAULT_CSS = """
    ResultsScreen #choices { width: 44; background: $panel; }
    ResultsScreen.-narrow #choices { width: 30; }
    ResultsScreen #choices SelectionList { border: none; padding: 0; }
    ResultsScreen #runs { height: auto; min-height: 2; max-height: 35%; }
    ResultsScreen #channels { height: 1fr; }
    ResultsScreen #wanted { height: 1; border: none; padding: 0 1; }
    ResultsScreen .heading { text-style: bold; color: $primary; }
    ResultsScreen #curves { height: 2fr; }
    ResultsScreen #cursor { height: auto; max-height: 6; padding: 0 1; background: $surface; text-wrap: nowrap; text-overflow: ellipsis; }
    ResultsScreen SelectionList { text-wrap: nowrap; text-overflow: ellipsis; }
    ResultsScreen #metrics { height: 1fr; min-height: 3; }
    """
    BINDINGS = [
        Binding("t", "view('over time')", "Time", tooltip="Show the ticked channels over time"),
        Binding("x", "view('path')", "Path", tooltip="Show the path in the plane of Z and X"),
        Binding("e", "view('contour error')", "Error", tooltip="Show the contour error while tool and part are in contact"),
        Binding("u", "view('surface')", "Surface", tooltip="Show the roughness along the part"),
        Binding("f", "view('spectrum')", "FFT", tooltip="Show the amplitudes of the ticked channels over the frequency"),
        Binding("comma", "cursor(-1)", "Cursor", key_display=", .", tooltip="Move the cursor; < and > move it ten times as far"),
        Binding("full_stop", "cursor(1)", show=False),
        Binding("less_than_sign", "cursor(-10)", show=False),
        Binding("greater_than_sign", "cursor(10)", show=False),
        Binding("m", "mark", "Mark", tooltip="Put the second cursor where the first is, to read differences; or take it away"),
        Binding("y", "range", "Range", tooltip="Set the lowest and highest value of the axis"),
        Binding("n", "note", "Name", tooltip="Give the run under the cursor a name and a note"),
        Binding("o", "open", "Open", tooltip="Open a record from a list, or by its path"),
        Binding("g", "figure", "Figure", tooltip="Save what is shown as a figure"),
        Binding("w", "csv", "Data", tooltip="Write the data as CSV or MAT"),
    ]

    def __init__(self) -> None:
        super().__init__()
        self._view = ERROR
        self._channels: list[str] = []
        self._ticked: list[Path] = []
        self._older: list[BenchRun] = []
        self._cursors = Cursors()
        self._lesson: Path | None = None
        """The lesson of the newest run, which says what is plotted at first."""
        self._peaks: list[str] = []
        self._command = ""

    def compose_body(self) -> Iterable[Widget]:
        """Return the choices at the left, the curves with their values and the metrics at the right."""
        with Horizontal():
            with Vertical(id="choices"):
                yield Label("Runs", classes="heading")
                yield TickList[int](id="runs")
                yield Label("Channels", classes="heading")
                yield Input(placeholder="type to find", id="wanted", compact=True)
                yield TickList[str](id="channels")
            with Vertical():
                yield TimePlot(id="curves")
                yield Static("", id="cursor", markup=False)
                yield MetricsTable(id="metrics", cursor_type="row", zebra_stripes=True)

    def on_mount(self) -> None:
        """Look for older records."""
        super().on_mount()
        own = {run.path.resolve() for run in self.workbench.runs}
        found = sorted(Path("lathesim_runs").rglob("*.h5")) if Path("lathesim_runs").is_dir() else []
        self._older = [
            BenchRun(str(path.relative_to("lathesim_runs").with_suffix("")), path) for path in found if path.resolve() not in own
        ]

    def show_changes(self, changed: set[str]) -> None:
        """Show the runs there are; the newest is ticked."""
        if not changed & {RUN, RUNS}:
            return
        shown = self.workbench.shown
        if shown is not None and shown.path not in self._ticked:
            self._ticked = [shown.path]
            lesson = shown.lesson.path if shown.lesson is not None else None
            if lesson != self._lesson:
                self._lesson, self._view, self._channels = lesson, ERROR, []
        self._fill_runs()
        self._show_all()

    @property
    def _all(self) -> list[BenchRun]:
        own = {run.path for run in self.workbench.runs}
        return [*reversed(self.workbench.runs), *(run for run in self._older if run.path not in own)]

    def _fill_runs(self) -> None:
        listed = self.query_one("#runs", SelectionList)
        with self.prevent(SelectionList.SelectedChanged):
            listed.clear_options()
            for place, run in enumerate(self._all):
                listed.add_option(Selection(Text(run.title, no_wrap=True, overflow="ellipsis"), place, run.path in self._ticked))

    def _records(self) -> list[tuple[str, Record]]:
        """Return the ticked runs with their short names; one that cannot be read is told and left out."""
        found = []
        ticked = [run for run in self._all if run.path in self._ticked]
        for run in ticked:
            try:
                name = run.note.partition(":")[0]
                found.append((f"{short_name(run.path, [other.path for other in ticked])} {name}".rstrip(), run.record()))
            except LatheSimError as error:
                self._ticked.remove(run.path)
                self.tell_fault(fault_words(error))
        return found

    def _show_all(self) -> None:
        runs = self._records()
        self._channels = [name for name in self._channels if any(name in record for _, record in runs)]
        if not self._channels and runs:
            self._channels = self._first_channels(runs[0][1])
        self._fill_channels(runs)
        self._draw(runs)
        run = self.workbench.shown
        goals = [goal.metric for goal in run.lesson.settings.goals] if run is not None and run.lesson is not None else []
        self.query_one(MetricsTable).show(runs, goals, self.workbench.registry.metrics)

    def _first_channels(self, record: Record) -> list[str]:
        """Return the channels that the lesson of the run plots, and show them over time; else one of the usual channels."""
        run = self.workbench.shown
        own = run.lesson.settings.plot if run is not None and run.lesson is not None else []
        found = [name for name in own if name in record]
        if found:
            self._view = TIME
            return found
        first = find_channel(record, *_FIRST_CHANNELS) or next(iter(record), None)
        return [first] if first is not None else []

    def _fill_channels(self, runs: list[tuple[str, Record]]) -> None:
        known = {name: record.channel(name) for _, record in reversed(runs) for name in record}
        rows = [(name, known[name].unit, known[name].description) for name in sorted(known, key=lambda name: name not in self._channels)]
        self.query_one("#channels", TickList).fill_channels(rows, self.query_one("#wanted", Input).value, self._channels)

    def _draw(self, runs: list[tuple[str, Record]]) -> None:
        self._command = ""
        plot = self.query_one(TimePlot)
        several = len(runs) > 1
        if self._view == TIME:
            plot.show(self._curves(runs))
        elif self._view == ERROR:
            found = [(title, record, find_channel(record, *CONTOUR_ERROR)) for title, record in runs]
            shown = [(name, title if several else "", record) for title, record, name in found if name is not None]
            plot.show([Curve(record, name, "contour error in contact", run=run, only=contact(record)) for name, run, record in shown])
        elif self._view == PATH:
            plot.show_lines(path_lines(runs), "Z / mm", "X (radius) / mm")
        elif self._view == SPECTRUM:
            lines = spectrum_lines(self._curves(runs), self._cursors.span)
            self._peaks = [peak_words(line) for line in lines]
            plot.show_lines(lines, "frequency / Hz", "amplitude")
        else:
            surface = surface_lines(runs)
            waves = [] if surface else wave_lines(runs)
            words = ("angle of the part / deg", "height / µm") if waves else ("Z / mm", "R_a / µm")
            plot.show_lines(surface or waves, *words)
        if self._view in (TIME, ERROR):
            plot.show_cursors(self._cursors.place, self._cursors.mark)
        self._show_cursor(runs)
        self.show_command()

    def _curves(self, runs: list[tuple[str, Record]]) -> list[Curve]:
        """Return the ticked channels of runs as curves."""
        return [Curve(record, name, run=title if len(runs) > 1 else "") for name in self._channels for title, record in runs]

    def _show_cursor(self, runs: list[tuple[str, Record]]) -> None:
        words = self.query_one("#cursor", Static)
        if not runs:
            first = "Tick a run with space" if self.workbench.runs else "Run something first"
            words.update(f"{first}, or open a record with o.")
            return
        if self._view not in (TIME, ERROR):
            words.update("\n".join([_SEEN[self._view], *(self._peaks if self._view == SPECTRUM else [])]))
            return
        found: list[str | Text | tuple[str, str]] = []
        found.append(self._cursors.words)
        names = self._channels if self._view == TIME else ["contour.contour_error"]
        curves = [(name, title, record) for name in names for title, record in runs if name in record]
        for (name, title, record), (mark, _, colour) in zip(curves, self.query_one(TimePlot).named, strict=False):
            shown = self._cursors.value_words(record, name)
            found += ["\n", (mark, colour), f" {plain_name(name)}{f' ({title})' if len(runs) > 1 else ''}{shown} ", (name, "dim")]
        words.update(Text.assemble(*found, no_wrap=True, overflow="ellipsis"))

    @on(SelectionList.SelectedChanged, "#runs")
    def _tick_runs(self, event: SelectionList.SelectedChanged[int]) -> None:
        everything = self._all
        self._ticked = [everything[place].path for place in event.selection_list.selected if place < len(everything)]
        self._show_all()

    @on(SelectionList.SelectionToggled, "#channels")
    def _tick_channel(self, event: SelectionList.SelectionToggled[str]) -> None:
        name = str(event.selection.value)
        if name in self._channels:
            self._channels.remove(name)
        else:
            self._channels.append(name)
        self._view = TIME
        self._draw(self._records())

    @on(Input.Changed, "#wanted")
    def _search(self) -> None:
        self._fill_channels(self._records())

    @on(Input.Submitted, "#wanted")
    def _to_channels(self) -> None:
        self.query_one("#channels", SelectionList).focus()

    @on(TimePlot.Picked)
    def _pick(self, event: TimePlot.Picked) -> None:
        if self._view in (TIME, ERROR):
            self._cursors = self._cursors.at(event.x)
            self._draw_keeping_zoom()

    def action_cursor(self, steps: int) -> None:
        """Move the cursor along."""
        low, high = self.query_one(TimePlot).span
        here = self._cursors.place if self._cursors.place is not None else low
        self._cursors = self._cursors.at(min(high, max(low, here + steps * (high - low) / _STEPS)))
        self._draw_keeping_zoom()

    def _draw_keeping_zoom(self) -> None:
        self.query_one(TimePlot).show_cursors(self._cursors.place, self._cursors.mark)
        self._show_cursor(self._records())

    def action_mark(self) -> None:
        """Put the second cursor where the first is, or take it away."""
        if self._cursors.place is None:
            self.notify("Move the first cursor to the place first, with , and . or a click.")
            return
        self._cursors = self._cursors.marked()
        self._draw_keeping_zoom()

    def action_range(self) -> None:
        """Ask for the lowest and highest value of the axis."""
        low, high = self.query_one(TimePlot).picture().y_limits
        self._ask(self._set_range, "Lowest and highest value of the axis; r resets it", f"{low:.4g} {high:.4g}")

    def _set_range(self, text: str | None) -> None:
        if text is None:
            return
        try:
            low, high = (float(word) for word in text.split())
        except ValueError:
            low = high = 0.0
        if not low < high:
            self.tell_fault(f"'{text}' are no two numbers of which the first is smaller. Write them as -200 50.")
            return
        self.query_one(TimePlot).show_values(low, high)

    def action_note(self) -> None:
        """Name the run under the cursor of the list, and keep a note."""
        place = self.query_one("#runs", SelectionList).highlighted or 0
        if place >= len(self._all):
            self.tell_fault("There is no run to name. Run something first.")
            return
        run = self._all[place]

        def keep(text: str | None) -> None:
            with self.lathesim.faults_told():
                run.note = text if text is not None else run.note
            self.show_changes({RUNS})

        self._ask(keep, f"Name of {run.path.stem}, and after a colon a note", run.note, "soft: half the gain")

    def action_view(self, view: str) -> None:
        """Look at the runs in another way."""
        self._view = view
        self._draw(self._records())

    def action_open(self) -> None:
        """Open any record, from a list or by its path."""
        from lathesim.tui.screens.choices import record_choice

        self.app.push_screen(record_choice(), self._open)

    def _open(self, path: Path | None) -> None:
        if path is None:
            return
        with self.lathesim.faults_told():
            self._ticked.append(self.workbench.open_record(path).path)

    def _ask(self, then: Callable[[str | None], None], question: str, text: str, placeholder: str = "") -> None:
        """Ask for a line of text, and do what follows with it."""
        from lathesim.tui.screens.forms import TextQuestion

        self.app.push_screen(TextQuestion(question, text, placeholder), then)

    def action_figure(self) -> None:
        """Save the plot as a figure."""
        if not self._records():
            self.tell_fault("There is no run to draw. Run something first.")
            return
        paths = [run.path for run in self._all if run.path in self._ticked]
        name = paths[0].with_name("_".join([*(path.stem for path in paths[:4]), _FIGURE_ENDING[self._view]]) + ".png")
        self._ask(self._save_figure, "Save the figure as (.png, .svg or .pdf)", str(name))

    def _save_figure(self, name: str | None) -> None:
        if name is None:
            return
        runs = self._records()
        with self.lathesim.faults_told():
            from lathesim.analysis.figure_style import picture_figure
            from lathesim.analysis.plots import save_figure

            save_figure(picture_figure(self.query_one(TimePlot).picture(), figure_title(runs)), name)
            self.notify(f"The figure is in {name}.", markup=False)

    def action_csv(self) -> None:
        """Write the data of the run as a CSV file."""
        ticked = [run for run in self._all if run.path in self._ticked]
        if not ticked:
            self.tell_fault("There is no run to write. Run something first.")
            return
        self._ask(self._save_csv, "Write the data as (.csv or .mat)", str(ticked[0].path.with_suffix(".csv")))

    def _save_csv(self, name: str | None) -> None:
        runs = self._records()
        if name is None or not runs:
            return
        with self.lathesim.faults_told():
            from lathesim.analysis.export import export

            export(runs[0][1] if len(runs) == 1 else overlaid(runs, self._channels), name)
            if len(runs) == 1:
                path = next(run.path for run in self._all if run.path in self._ticked)
                self._command = shlex.join(["lathesim", "export", str(path), name])
                self.show_command()
            self.notify(f"The data are in {name}.", markup=False)

    def command(self) -> str:
        """Return the command that draws or writes the same."""
        if self._command:
            return self._command
        ticked = [run for run in self._all if run.path in self._ticked]
        if not ticked:
            return "lathesim plot RUN.h5"
        return shlex.join(["lathesim", "plot", str(ticked[0].path), *(self._channels if self._view == TIME else [])])
