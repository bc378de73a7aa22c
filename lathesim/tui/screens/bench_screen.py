"""The bench: the part is turned before one's eyes, with what the machine does beside it."""

from __future__ import annotations

import math
import time as clock
from collections.abc import Iterable
from dataclasses import replace
from typing import TYPE_CHECKING

from textual import on
from textual.binding import Binding
from textual.containers import Horizontal, Vertical, VerticalScroll
from textual.widget import Widget
from textual.widgets import Label, ProgressBar, Select, Static

from lathesim.analysis.display_unit import plain_name, plain_number, pretty_quantities
from lathesim.analysis.metric import CONTOUR_ERROR, find_channel
from lathesim.record import Record
from lathesim.tui.drawing.curves import Curve
from lathesim.tui.drawing.lathe_picture import LatheScene, ToolMotion, scene_of_case, scene_of_record
from lathesim.tui.model.workbench import RUN, RUNS, SETUP
from lathesim.tui.screens.workbench_screen import WorkbenchScreen
from lathesim.tui.widgets.controls import ReadOuts, Slider, blank_readings, program_line, readings
from lathesim.tui.widgets.lathe_view import LatheView
from lathesim.tui.widgets.program_listing import ProgramListing, program_lines
from lathesim.tui.widgets.time_plot import TimePlot

if TYPE_CHECKING:
    from lathesim.lessons.grading import GoalResult


def goal_text(goal: GoalResult) -> str:
    """Return one goal with what was reached: ``✗ largest contour error at most 0.4 mm: 0.685 mm``; the sign says whether it is met."""
    reached = f"{plain_number(goal.value, 4)} {goal.unit}" if math.isfinite(goal.value) else goal.reason or "not measured"
    return pretty_quantities(f"{'✓' if goal.met else '✗'} {plain_name(goal.metric)} {goal.sense} {goal.limit}: {reached}")


GAINS = (1.0, 10.0, 30.0, 100.0, 1000.0)
ZOOMS = (0.0, 10e-3, 2e-3)
PACES = (0.0, 1.0, 4.0, 0.25)
RATES = (10.0, 4.0, 1.0, 0.0)
"""Choices a key goes through: error magnifier, width around the tip [m], simulated seconds a second, pictures a second."""
_REPLAY_TIME = 12.0
"""Seconds in which a run is played again where the pace is as fast as possible."""
_FIRST_KEYS = """\
[b]Five keys to begin with[/b]
[b]F5[/b]  Run this lesson, or stop the run
[b]F6[/b]  Read the lessons: goals and hints
[b]F4[/b]  Change the machine: values and parts
[b]F3[/b]  Compare your runs as curves and numbers
[b] ?[/b]  See all keys of the screen in front"""
"""What stands in the place of the plot until something ran."""
_FIRST_CHANNELS = (*CONTOUR_ERROR, "following_error", "error")


class BenchScreen(WorkbenchScreen):
    """Runs the setup and plays runs again."""

    BINDINGS = [
        Binding("space", "play(1)", "Play", tooltip="Play the run again, or hold"),
        Binding("b", "play(-1)", "Back", tooltip="Play the run backwards, or hold"),
        Binding("m", "next_gain", "Magnify", tooltip="Magnify the error 10, 30, 100, 1000 times, or not"),
        Binding("z", "next_zoom", "Zoom", tooltip="Zoom to the tip of the tool: 10 mm, 2 mm, or all"),
        Binding("d", "diameter", "R/Ø", tooltip="Show X as a radius or as a diameter"),
        Binding("p", "next_pace", "Pace", tooltip="Simulate as fast as possible, at real time, 4 times or a quarter as fast"),
        Binding("f", "next_rate", "Frames", tooltip="Draw 10, 4, or 1 times a second, or only at the end"),
        Binding("c", "channels", "Channels", tooltip="Choose what the plot shows"),
    ]

    def __init__(self) -> None:
        super().__init__()
        self._scene: LatheScene | None = None
        self._record: Record | None = None
        self._motion: ToolMotion | None = None
        self._sample = 0
        self._channels: tuple[str, ...] = ()
        self._about = ""
        """The lesson of the run, which says what is plotted at first."""
        self._playing = 0
        self._played_at = 0.0
        self._rate = RATES[0]
        self._drawn_at = 0.0
        self._words = ""
        self._lesson_text: str | None = None

    def compose_body(self) -> Iterable[Widget]:
        """Return the lathe view and the plot at the left, the lesson, read-outs and listing at the right."""
        with Horizontal(id="bench"):
            with Vertical(id="pictures"):
                yield LatheView(id="lathe")
                yield TimePlot(id="plot")
                yield Static(_FIRST_KEYS, id="first")
                with Horizontal(id="transport"):
                    yield Label("", id="playing")
                    yield Slider(id="slider")
            with Vertical(id="beside"):
                yield Static("", id="title", markup=False)
                yield Select[str]([], prompt="Variant", id="variant", compact=True)
                yield VerticalScroll(id="lesson")
                yield ReadOuts(id="readings")
                yield ProgramListing(id="listing")
                yield Static("", id="result", markup=False)
                yield ProgressBar(id="progress", show_eta=False, total=100.0)

    def on_mount(self) -> None:
        """Begin to look at the run under way."""
        super().on_mount()
        self.set_interval(0.05, self._tick)

    def show_changes(self, changed: set[str]) -> None:
        """Show the setup and the run."""
        if SETUP in changed:
            self._show_setup()
        if changed & {SETUP, RUN, RUNS}:
            self._take_run()
            self.query_one("#result", Static).update(self._status())
        self._draw()

    def _show_setup(self) -> None:
        setup = self.workbench.setup
        if setup is None:
            return
        self.query_one("#title", Static).update(setup.lesson.title)
        self._show_text(setup.lesson.settings.text)
        select = self.query_one("#variant", Select)
        select.display = bool(setup.lesson.variants)
        variants = setup.lesson.settings.variants
        with self.prevent(Select.Changed):
            select.set_options([(f"{name}: {variants[name].text}" if variants[name].text else name, name) for name in variants])
            if setup.variant is not None:
                select.value = setup.variant
        if not self.workbench.fault():
            self.query_one(ProgramListing).show(program_lines(self.workbench.prepared().case.program))

    def _show_text(self, text: str) -> None:
        """Show what the lesson says; at a low terminal its place is taken by the read-outs once something ran."""
        from textual.widgets import Markdown

        if text == self._lesson_text:
            return
        self._lesson_text = text
        lesson = self.query_one("#lesson", VerticalScroll)
        lesson.remove_children()
        lesson.mount(Markdown(text, open_links=False))

    def _take_run(self) -> None:
        """Take over the run that is shown, or the machine before its first run."""
        shown = self.workbench.shown
        self._record = self._motion = self._scene = None
        self._playing = 0
        if shown is None:
            if not self.workbench.fault():
                self._scene = scene_of_case(self.workbench.prepared())
            self._sample = 0
            return
        if shown.live is not None:
            self._scene = scene_of_case(shown.live.case)
        with self.lathesim.faults_told():
            self._follow(shown.record())
            if self._record is not None and (self._scene is None or self._scene.is_empty):
                self._scene = scene_of_record(self._record)

    def _follow(self, record: Record) -> None:
        """Take what was simulated by now and stand at its end."""
        self._record = record if record.status != "running" or self.workbench.live is not None else record.with_meta(status="not kept")
        self._motion = ToolMotion.of(record)
        self._sample = len(record)
        about, self._about = self._about, str(record.meta.get("lesson_name", ""))
        if about != self._about or not any(name in record for name in self._channels):
            first = find_channel(record, *_FIRST_CHANNELS) or next(iter(record), None)
            own = tuple(name for name in self._lesson_keys("plot") if name in record)
            self._channels = own or ((first,) if first else ())

    def _lesson_keys(self, key: str) -> list[str]:
        """Return the channels that the lesson of the run names under ``plot`` or ``read_outs``."""
        run = self.workbench.shown
        found: list[str] = getattr(run.lesson.settings, key) if run is not None and run.lesson is not None else []
        return found

    def _tick(self) -> None:
        """Draw the run under way, or the run that is played again."""
        if not self.is_current:
            return
        now = clock.monotonic()
        shown = self.workbench.shown
        live = shown.live if shown is not None else None
        if live is not None and self._record is not None and self._record.status == "running":
            if live.is_over:
                return
            if self._rate > 0.0 and now - self._drawn_at >= 1.0 / self._rate - 0.01:
                self._follow(live.record())
                self._draw()
            elif self._rate == 0.0:
                self._show_progress()
        elif self._playing and self._record is not None:
            self._play_on(now)

    def _status(self) -> str:
        """Return how the last run ended, what the setup lacks, or what is waited for."""
        if self.workbench.is_opening:
            return "The lesson is being read. " + ("The run begins as soon as it is there." if self.workbench.run_is_wanted else "")
        return self._result() or self.workbench.fault()

    def _result(self) -> str:
        shown = self.workbench.shown
        if shown is None or shown.live is None:
            return ""
        live, setup = shown.live, self.workbench.setup
        lesson = live.case.case.lesson
        other = f" of {lesson.title}" if setup is not None and lesson.path != setup.lesson.path else ""
        if not live.is_over:
            return f"Running {shown.title}{other}. F5 stops it."
        if live.kept is None:
            return live.fault
        kept = live.kept
        end = "Stopped" if kept.stopped else "Done"
        words = [kept.failure or kept.nothing_cut or f"{end}, kept as {kept.path.stem}{other}. F3 shows it."]
        words.extend(kept.warned)
        if kept.goals and not kept.is_finished:
            words.append("The goals are judged when a run comes to its end.")
        elif kept.goals:
            words.extend(goal_text(goal) for goal in kept.goals)
            if all(goal.met for goal in kept.goals):
                words.append("All goals are met. F6 shows the next lesson.")
        return "\n".join(words)

    def _play_on(self, now: float) -> None:
        record = self._record
        assert record is not None
        pace = self.workbench.pace or float(record.time[-1] - record.time[0]) / _REPLAY_TIME
        if self._rate > 0.0 and now - self._played_at < 1.0 / self._rate - 0.01:
            return
        time = record.time[min(self._sample, len(record)) - 1] + self._playing * pace * (now - self._played_at)
        self._played_at = now
        self._sample = min(max(int(record.time.searchsorted(time, side="right")), 1), len(record))
        if self._sample in (1, len(record)):
            self._playing = 0
        self._draw()

    def _draw(self) -> None:
        """Draw all views at the sample that is looked at."""
        self._drawn_at = clock.monotonic()
        lathe = self.query_one(LatheView)
        if self._scene is not None:
            lathe.show(self._scene, self._motion, self._sample)
        self._show_progress()
        record = self._record
        plot = self.query_one(TimePlot)
        self.set_class(record is not None, "-has-run")
        if record is None or not len(record):
            plot.show([])
            self.query_one(ReadOuts).show(blank_readings(as_diameter=lathe.view.as_diameter))
            self.query_one(ProgramListing).mark(None)
            return
        sample = max(0, min(self._sample, len(record)) - 1)
        end = self._expected_end() if record.status == "running" else float(record.time[-1])
        cursor = None if sample >= len(record) - 1 else float(record.time[sample])
        curves = [Curve(record, name) for name in self._channels]
        plot.show(curves, span=(0.0, max(end, 1e-3)), cursor=cursor, fit_to_feed=True, about=self._about)
        self.query_one(ReadOuts).show(readings(record, sample, as_diameter=lathe.view.as_diameter, first=self._lesson_keys("read_outs")))
        self.query_one(ProgramListing).mark(program_line(record, sample))
        with self.prevent(Slider.Slid):
            self.query_one(Slider).value = sample / max(1, len(record) - 1)

    def _expected_end(self) -> float:
        shown = self.workbench.shown
        live = shown.live if shown is not None else None
        return 0.0 if live is None else max(live.case.expected_time or 0.0, live.time)

    def _show_progress(self) -> None:
        shown = self.workbench.shown
        live = shown.live if shown is not None else None
        bar = self.query_one(ProgressBar)
        share = 0.0 if live is None else 1.0 if live.is_over else live.share
        bar.update(total=100.0 if share is not None else None, progress=100.0 * (share or 0.0))
        pace = f"pace x{self.workbench.pace:g}" if self.workbench.pace else "pace max"
        sign = {1: "▶", -1: "◀", 0: "■"}[self._playing]
        under_way = live is not None and not live.is_over
        rate = f"{self._rate:g} fps" if self._rate else "not drawn"
        remaining = live.remaining if live is not None else None
        left = f", {remaining:.0f} s left" if remaining is not None else ""
        words = f"{'●' if under_way else sign} {pace} {rate}{left} "
        if words != self._words:
            self._words = words
            self.query_one("#playing", Label).update(words)

    @on(Select.Changed, "#variant")
    def _choose_variant(self, event: Select.Changed) -> None:
        setup = self.workbench.setup
        if setup is not None and isinstance(event.value, str):
            self.workbench.shown = None if self.workbench.live is None else self.workbench.shown
            self.workbench.change(replace(setup, variant=event.value))

    @on(Slider.Slid)
    def _go_to(self, event: Slider.Slid) -> None:
        if self._record is not None and len(self._record):
            self._playing = 0
            self._sample = 1 + round(event.value * (len(self._record) - 1))
            self._draw()

    def action_play(self, direction: int) -> None:
        """Play the run again, or hold."""
        record = self._record
        if record is None or len(record) < 2 or record.status == "running":
            self.notify("Run first: there is nothing to play again.", severity="warning")
            return
        self._playing = 0 if self._playing == direction else direction
        if self._playing > 0 and self._sample >= len(record):
            self._sample = 1
        self._played_at = clock.monotonic()
        self._draw()

    def action_next_gain(self) -> None:
        """Magnify the error more, or not at all."""
        lathe = self.query_one(LatheView)
        lathe.view = replace(lathe.view, gain=_next(GAINS, lathe.view.gain))

    def action_next_zoom(self) -> None:
        """Go nearer to the tip, or show all."""
        lathe = self.query_one(LatheView)
        lathe.view = replace(lathe.view, zoom=_next(ZOOMS, lathe.view.zoom))

    def action_diameter(self) -> None:
        """Label X as a diameter, or as a radius again."""
        lathe = self.query_one(LatheView)
        lathe.view = replace(lathe.view, as_diameter=not lathe.view.as_diameter)
        self._draw()

    def action_next_pace(self) -> None:
        """Simulate as fast as possible, at real time, four times as fast, or slower."""
        self.workbench.pace = _next(PACES, self.workbench.pace)
        if self.workbench.live is not None:
            self.workbench.live.pace = self.workbench.pace
        self._show_progress()

    def action_next_rate(self) -> None:
        """Draw the run ten, four, or one time a second, or not before its end."""
        self._rate = _next(RATES, self._rate)
        self._show_progress()

    def action_channels(self) -> None:
        """Choose what the plot shows."""
        from lathesim.tui.screens.choices import ChannelChoice

        record = self._record
        if record is None:
            if self.workbench.fault():
                self.tell_fault(self.workbench.fault())
                return
            plan = self.workbench.prepared().plan
            known = {name: (plan.unit(name), plan.doc(name)) for name in plan.channels}
        else:
            known = {name: (channel.unit, channel.description) for name, channel in record.channels.items()}
        self.app.push_screen(ChannelChoice(known, self._channels), self.show_channels)

    def show_channels(self, chosen: tuple[str, ...] | None) -> None:
        """Plot other channels."""
        if chosen:
            self._channels = chosen
            self._draw()


def _next(choices: tuple[float, ...], present: float) -> float:
    place = choices.index(present) if present in choices else -1
    return choices[(place + 1) % len(choices)]
