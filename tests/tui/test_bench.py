"""The bench: run, stop, play again, magnify; the same run as the command gives."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest
from textual.geometry import Region
from textual.widgets import Select, Static

from lathesim.cli.main import run_command_line
from lathesim.cli.open_app import make_app
from lathesim.record import load
from lathesim.tui.app import LathesimApp
from lathesim.tui.model.student_book import KeptState
from lathesim.tui.screens.help import KeysView
from lathesim.tui.widgets.controls import Slider
from lathesim.tui.widgets.lathe_view import LatheView
from lathesim.tui.widgets.program_listing import ProgramListing
from lathesim.tui.widgets.time_plot import TimePlot
from tests.tui.driving import content, opened, press, run_to_end, until
from tests.tui.screen_words import words_of


def stock(app: LathesimApp) -> int:
    """Return how much material the lathe view shows."""
    picture = app.screen.query_one(LatheView).picture
    assert picture is not None
    return int(picture.material.sum())


def layouts_asked_for(app: LathesimApp) -> list[str]:
    """Return the widgets of the screen that ask for a layout from now on."""
    asked: list[str] = []
    for widget in app.screen.walk_children():
        refresh = widget.refresh

        def watched(*regions: Region, _refresh: Any = refresh, _name: str = str(widget), layout: bool = False, **further: Any) -> Any:
            if layout:
                asked.append(_name)
            return _refresh(*regions, layout=layout, **further)

        widget.refresh = watched  # type: ignore[method-assign]
    return asked


async def test_a_run_is_drawn_kept_and_judged_played_again_and_its_command_gives_the_same_bits() -> None:
    """Playing it again lays nothing out anew, which costs more than a picture."""
    async with opened() as (app, pilot):
        await run_to_end(app, pilot)
        assert "✗ largest contour error at most 0.2 mm: 0.6851 mm" in content(app, "#result")
        command = app.workbench.command()
        whole = stock(app)
        app.screen.query_one(Slider).focus()
        await press(pilot, "home")
        raw, asked = stock(app), layouts_asked_for(app)
        assert raw > whole
        await press(pilot, *["shift+right"] * 7)
        assert app.screen.query_one(ProgramListing).line == 9
        assert raw > stock(app) > whole
        await press(pilot, "home")
        assert stock(app) == raw
        assert asked == []
    shown = load("lathesim_runs/01_contour_error/001.h5")
    words = command.split()
    assert words[:3] == ["lathesim", "run", "01_contour_error"]
    words[words.index("--out") + 1] = "again.h5"
    assert run_command_line([*words[1:], "--no-plots"]) == 0
    again = load("again.h5")
    assert all(np.array_equal(shown[name], again[name]) for name in again)


async def test_a_run_asked_for_before_the_lesson_is_read_begins_once_it_is_there(monkeypatch: pytest.MonkeyPatch) -> None:
    app = make_app()
    read_lesson = app.open_first
    monkeypatch.setattr(app, "open_first", lambda: None)
    async with app.run_test(size=(120, 36)) as pilot:
        await pilot.pause()
        assert "being read" in content(app, "#result")
        await press(pilot, "f5")
        assert "The run begins as soon as it is there" in content(app, "#result")
        assert "STOP" in words_of(app.export_screenshot())
        read_lesson()
        await until(pilot, lambda: bool(app.workbench.runs) and app.workbench.live is None, "the end of the run")
        await until(pilot, lambda: "largest contour error" in content(app, "#result"), "the result")


async def test_a_run_asked_for_too_early_can_be_taken_back(monkeypatch: pytest.MonkeyPatch) -> None:
    app = make_app()
    read_lesson = app.open_first
    monkeypatch.setattr(app, "open_first", lambda: None)
    async with app.run_test(size=(120, 36)) as pilot:
        await pilot.press("f5", "f5")
        read_lesson()
        await until(pilot, lambda: app.workbench.setup is not None, "the lesson")
        assert not app.workbench.runs


async def test_stop_keeps_the_data() -> None:
    async with opened() as (app, pilot):
        app.workbench.pace = 1.0
        await pilot.press("f5")
        await until(pilot, lambda: app.workbench.live is not None and app.workbench.live.time > 0.3, "a third of a second")
        live = app.workbench.live
        assert live is not None
        live._begun = time.monotonic()
        assert live.remaining is None  # nothing is known of the speed yet
        live._begun -= 2.0
        live.pace = 2.0
        assert live.remaining == pytest.approx(0.5 * ((live.case.expected_time or 0.0) - live.time), abs=0.2)
        await pilot.press("f5")
        await until(pilot, lambda: app.workbench.live is None, "the end of the run")
    record = load("lathesim_runs/01_contour_error/001.h5")
    assert record.status == "stopped"
    assert 0.3 < record.time[-1] < 10.0


async def test_leaving_in_a_run_keeps_the_data_and_the_looks() -> None:
    async with opened() as (app, pilot):
        app.workbench.pace = 1.0
        app.theme = "nord"
        await pilot.press("f5")
        await until(pilot, lambda: app.workbench.live is not None and app.workbench.live.time > 0.2, "some data")
        await pilot.press("ctrl+q")
    assert KeptState.read() == KeptState("nord", "01_contour_error", "I", "bench")
    assert load("lathesim_runs/01_contour_error/001.h5").status == "stopped"


async def test_a_first_start_shows_five_keys_help_those_of_the_screen_in_front_and_a_variant_is_undone() -> None:
    async with opened(size=(80, 24)) as (app, pilot):
        shown = words_of(app.export_screenshot())
        assert all(key in shown for key in ("Five keys", "F5  Run", "F6  Read", "F4  Change", "F3  Compare", "?  See"))
        assert "--:--" not in shown
        await pilot.press("question_mark")
        await until(pilot, lambda: isinstance(app.screen, KeysView), "the keys")
        keys = "\n".join(str(widget.content) for widget in app.screen.query(Static))
        assert "Run a lesson and watch the part being turned" in keys
        assert keys.index("Magnify the error") < keys.index("Everywhere")
        await press(pilot, "escape", "m")
        assert "error x10" in str(app.screen.query_one(LatheView).border_subtitle)
        app.screen.query_one("#variant", Select).value = "II"
        await pilot.pause()
        assert app.workbench.command() == "lathesim run 01_contour_error --variant II"
        await press(pilot, "ctrl+z")
        assert app.workbench.command() == "lathesim run 01_contour_error --variant I"


async def test_keys_of_a_plot_do_nothing_before_it_is_drawn() -> None:
    """A first start shows five keys in the place of the plot, which has the focus: an arrow ended the app."""
    async with opened(size=(80, 24)) as (app, pilot):
        plot = app.screen.query_one("#plot", TimePlot)
        plot.focus()
        before = plot.span
        await press(pilot, "down", "up", "left", "right", "plus", "minus", "ctrl+left", "ctrl+up")
        assert plot.span == before
        await press(pilot, "m")
        assert "error x10" in str(app.screen.query_one(LatheView).border_subtitle)


@pytest.mark.parametrize("size", [(80, 24), pytest.param((200, 60), marks=pytest.mark.slow)])
async def test_the_bench_works_at_both_sizes_and_survives_a_tiny_terminal(size: tuple[int, int]) -> None:
    async with opened(size=size) as (app, pilot):
        await pilot.resize_terminal(20, 5)
        await pilot.pause()
        await pilot.resize_terminal(*size)
        await run_to_end(app, pilot)
        assert stock(app) > 0
