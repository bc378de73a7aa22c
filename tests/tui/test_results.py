"""Results: runs alone and laid over each other, values under the cursor, figures and files; an older record, and one that is gone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from textual.pilot import Pilot
from textual.widgets import DataTable, Input, SelectionList

from lathesim.cli.main import run_command_line
from lathesim.lessons.lesson import load_lesson
from lathesim.record import load
from lathesim.tui.app import LathesimApp
from lathesim.tui.drawing.curves import PlotLine, Scaled
from lathesim.tui.widgets.time_plot import TimePlot
from tests.tui.driving import answer, content, edit, opened, press, run_to_end, told
from tests.tui.screen_words import words_of


async def show_all(app: LathesimApp, pilot: Pilot[None]) -> None:
    """Show all runs on Results."""
    await press(pilot, "f3")
    app.screen.query_one("#runs", SelectionList).select_all()
    await pilot.pause()


@pytest.mark.slow
async def test_a_student_doubles_the_gain_sees_the_error_fall_and_saves_what_runs_the_same() -> None:
    async with opened() as (app, pilot):
        await run_to_end(app, pilot)
        for axis in ("x", "z"):
            await edit(app, pilot, f"{axis}_controller.proportional", "0.449 V/mm")
        await press(pilot, "ctrl+s")
        await answer(app, pilot, "mine.yaml")
        await run_to_end(app, pilot)
        await show_all(app, pilot)
        table = app.screen.query_one(DataTable)
        errors = next(table.get_row_at(row) for row in range(table.row_count) if str(table.get_row_at(row)[0]) == "largest contour error")
        assert [str(cell) for cell in errors[1:]] == ["0.3379 mm", "0.6851 mm", "max_contour_error"]
        assert [name for _, name, _ in app.screen.query_one(TimePlot).named] == ["002", "001"]
        await press(pilot, "g")
        await answer(app, pilot, "both.png")
        assert Path("both.png").stat().st_size > 10_000
    assert run_command_line(["run", "mine.yaml", "--out", "again.h5", "--no-plots"]) == 0
    shown, again = load("lathesim_runs/01_contour_error/002.h5"), load("again.h5")
    assert all((shown[name] == again[name]).all() for name in shown)
    assert load_lesson("mine.yaml").variants == ()


async def test_the_records_of_two_students_are_laid_over_each_other_and_written_as_csv() -> None:
    for student, variant in (("anna", "I"), ("ben", "II")):
        Path(student).mkdir()
        assert run_command_line(["run", "01_contour_error", "--variant", variant, "--out", f"{student}/001.h5", "--no-plots"]) == 0
    async with opened("anna/001.h5") as (app, pilot):
        assert app.current_mode == "results"
        app.screen.query_one(TimePlot).focus()
        await press(pilot, "w")
        await press(pilot, "enter")
        assert app.screen.query_one("#command").command == "lathesim export anna/001.h5 anna/001.csv"  # type: ignore[attr-defined]
        assert Path("anna/001.csv").read_text(encoding="utf-8").startswith("time [s],interpolator.x_reference [m]")
        app.screen.query_one(TimePlot).focus()
        await press(pilot, "o")
        await answer(app, pilot, "ben/001.h5")
        assert {name for _, name, _ in app.screen.query_one(TimePlot).named} == {"anna/001", "ben/001"}
        assert "contour error in contact" in str(app.screen.query_one(TimePlot).border_title)
        columns = [str(column.label) for column in app.screen.query_one(DataTable).columns.values()]
        assert sorted(columns) == ["anna/001", "ben/001", "exact name", "metric"]
        app.screen.query_one(TimePlot).focus()
        await press(pilot, "g")
        await answer(app, pilot, "both.png")
        assert Path("both.png").stat().st_size > 10_000


@pytest.mark.slow
async def test_a_file_that_cannot_be_written_is_told_and_the_rest_goes_on() -> None:
    assert run_command_line(["run", "01_contour_error", "--variant", "I", "--out", "old.h5", "--no-plots"]) == 0
    async with opened("old.h5") as (app, pilot):
        app.screen.query_one(TimePlot).focus()
        for key, name in (("w", "nowhere/old.csv"), ("g", "nowhere/old.png"), ("o", "nowhere/old.h5"), ("o", "old.csv")):
            before = told(app)
            await press(pilot, key)
            await answer(app, pilot, name)
            assert name in told(app).removeprefix(before), key
        assert app.screen.query_one(TimePlot).named


async def test_the_saved_figure_is_what_stands_on_the_screen(monkeypatch: pytest.MonkeyPatch) -> None:
    figures: list[Any] = []
    monkeypatch.setattr("lathesim.analysis.plots.save_figure", lambda figure, name: figures.append(figure))
    async with opened() as (app, pilot):
        for variant in ("I", "II"):
            app.workbench.open_lesson("01_contour_error", variant)
            await run_to_end(app, pilot)
        await show_all(app, pilot)
        plot = app.screen.query_one(TimePlot)
        plot.focus()
        await pilot.press("plus", "right", "full_stop")
        await press(pilot, "g")
        assert app.screen.query_one("#answer", Input).value == "lathesim_runs/01_contour_error/002_001_contour_error.png"
        await press(pilot, "enter")
        (figure,), shown = figures, plot.picture()
        panel = figure.axes[0]
        curves = [line for line in panel.lines if line.get_label() in ("002", "001")]
        assert [line.get_label() for line in curves] == ["002", "001"]
        assert [line.get_linestyle() for line in curves] == ["-", "--"]
        assert (panel.get_xlim(), panel.get_ylim()) == (shown.x_limits, shown.y_limits)
        seen = app.workbench.runs[1].record().between(*shown.x_limits)
        assert len(curves[0].get_xdata()) == pytest.approx(len(seen), abs=2)
        assert 0.0 < shown.x_limits[0] < shown.x_limits[1] < app.workbench.runs[0].record().time[-1]
        assert (panel.get_xlabel(), panel.get_ylabel()) == ("t / s", "contour error in contact [µm]")
        assert panel.lines[-1].get_xdata()[0] == shown.cursor
        assert figure.get_suptitle() == "Servo control and contour error: 002 case II, 001 case I"
        assert max(abs(curves[0].get_ydata())) == pytest.approx(1e6 * max(abs(seen["contour.contour_error"])), rel=0.05)


def test_a_part_that_is_zoomed_to_keeps_each_sample() -> None:
    time = np.arange(100_000) * 1e-3
    curve = Scaled(time, np.sin(time), 1.0, "m", -1.0, 1.0)
    path = PlotLine(np.cos(0.01 * time), np.sin(0.01 * time), "path")
    assert list(curve.within(2.0, 2.05).points(100)[0]) == list(time[1999:2052])
    assert list(path.within(0.9999, 1.0).points(100)[0]) == list(path.x[:1416])
    assert len(curve.points(100)[0]) <= 202


async def test_cursors_range_spectrum_and_note_of_a_run() -> None:
    async with opened() as (app, pilot):
        await run_to_end(app, pilot)
        await press(pilot, "f3")
        app.screen.query_one(TimePlot).focus()
        await press(pilot, "t", "greater_than_sign", "greater_than_sign")
        words = content(app, "#cursor")
        assert words.startswith("t = 3.")
        assert "contour error: " in words
        assert words.rstrip().endswith("m contour.contour_error")
        await press(pilot, "m", "greater_than_sign")
        words = content(app, "#cursor")
        assert "Δt = 1.8" in words
        assert ", Δ " in words
        plot = app.screen.query_one(TimePlot)
        for key, text in (("n", "soft: half the gain"), ("y", "-200 100")):
            await press(pilot, key)
            await answer(app, pilot, text)
        assert plot.picture().y_limits == (-200.0, 100.0)
        assert "soft: half the gain" in app.workbench.runs[0].title
        await press(pilot, "f")
        assert "contour error [µm]: largest " in content(app, "#cursor")
        assert plot.picture().x_label == "frequency / Hz"
        await press(pilot, "t", "plus")
        zoomed = plot.picture()
        for again in ("x", "t", "f5", "f3"):  # another view, another run, another screen
            await (run_to_end(app, pilot) if again == "f5" else pilot.press(again))
            await pilot.pause()
        assert app.screen.query_one("#runs", SelectionList).selected == [0]
        assert (plot.picture().x_limits, plot.picture().y_limits) == (zoomed.x_limits, zoomed.y_limits) != ((0.0, 18.48), (-200.0, 100.0))
        await press(pilot, "r", "e", "t")
        assert plot.picture().x_limits == (0.0, pytest.approx(18.48))
    assert Path("lathesim_runs/01_contour_error/001.note.txt").read_text(encoding="utf-8") == "soft: half the gain\n"


@pytest.mark.slow
async def test_every_view_is_drawn_and_its_figure_saved() -> None:
    async with opened() as (app, pilot):
        await run_to_end(app, pilot)
        await press(pilot, "f3")
        app.screen.query_one(TimePlot).focus()
        for key in ("t", "x", "e", "u"):
            await press(pilot, key)
            assert app.screen.query_one(TimePlot).named
            await press(pilot, "g")
            await answer(app, pilot, f"{key}.svg")
            assert Path(f"{key}.svg").read_text(encoding="utf-8").startswith("<?xml")


async def test_a_record_that_is_gone_is_told_in_a_sentence() -> None:
    assert run_command_line(["run", "01_contour_error", "--variant", "I", "--no-plots"]) == 0
    async with opened() as (app, pilot):
        await press(pilot, "f3")
        Path("lathesim_runs/01_contour_error/01_contour_error_I.h5").rename("lathesim_runs/other.h5")
        await show_all(app, pilot)
        assert "there is no" in told(app)
        await press(pilot, "o")
        assert "lathesim_runs/other.h5" in words_of(app.export_screenshot())
        await pilot.press("escape")
        await pilot.press("f2")
        assert app.current_mode == "bench"
