"""Configure: values edited and checked, parts and effects exchanged, wiring drawn, programs chosen and made, saved and loaded."""

from __future__ import annotations

from pathlib import Path

import pytest
from textual.widgets import DataTable, Input, OptionList, Static, TabbedContent, Tree

from lathesim.cli.main import run_command_line
from lathesim.record import load
from lathesim.tui.screens.configure import ConfigureScreen
from lathesim.tui.widgets.machine_panes import ValuesPane
from lathesim.tui.widgets.program_listing import ProgramListing
from tests.tui.driving import answer, choose, content, edit, fill, opened, press, run_to_end, setup_of, show, told, until
from tests.tui.screen_words import words_of


async def test_a_saved_configuration_gives_the_same_bits_on_the_command_line() -> None:
    async with opened() as (app, pilot):
        await edit(app, pilot, "x_controller.proportional", "0.449 V/mm")
        await edit(app, pilot, "z_controller.proportional", "0.449 V/mm")
        await press(pilot, "ctrl+s")
        await answer(app, pilot, "mine.yaml")
        Path("theirs.yaml").write_text("lesson: Theirs\n", encoding="utf-8")
        for name, fault in (("mine.yaml", ""), ("theirs.yaml", "'theirs.yaml' is there already. Choose another name.")):
            await press(pilot, "ctrl+s")
            await answer(app, pilot, name)
            assert fault in told(app)
        await run_to_end(app, pilot)
    assert Path("theirs.yaml").read_text(encoding="utf-8") == "lesson: Theirs\n"
    assert run_command_line(["run", "mine.yaml", "--out", "again.h5", "--no-plots"]) == 0
    shown, again = load("lathesim_runs/01_contour_error/001.h5"), load("again.h5")
    assert all((shown[name] == again[name]).all() for name in shown)


WRONG = [
    ("x_controller.proportional", "fast", "'fast' is not a number with a unit"),
    ("x_controller.proportional", "3 mm", "is given in mm, but V/m is wanted"),
    ("x_dac.bits", "-3", "outside"),
    ("x_controller.proportional", "1,000 V/mm", "Write a decimal point."),
    ("duration", "-1", "it must be above zero"),
]
"""Parameter, a text that is no value of it, and what is said below the field."""


TYPED = [
    ("x_controller.proportional", "0.449", "0.449 V/mm"),
    ("x_controller.proportional", "449 V/m", "449 V/m"),
    ("x_dac.bits", "12", "12"),
    ("sample_period", "10", "10 ms"),
]
"""Parameter, a text typed after those above, and the value that is taken: a number alone has the unit that is shown."""


async def test_a_wrong_value_is_told_as_it_is_typed_and_a_right_one_is_taken_in_the_unit_that_is_shown() -> None:
    async with opened() as (app, pilot):
        for name, text, fault in WRONG:
            await show(app, pilot, name)
            app.screen.query_one("#value", Input).value = text
            await until(pilot, lambda: content(app, "#fault").startswith("✗") and fault in content(app, "#fault"), fault)  # noqa: B023
        assert not setup_of(app).is_changed
        await edit(app, pilot, "x_controller.proportional", "0.449 V/mm")
        screen = app.screen
        assert isinstance(screen, ConfigureScreen)
        assert screen.entry is not None
        assert (screen.entry.text, screen.entry.default) == ("0.449 V/mm", "0.2245 V/mm")
        for name, text, taken in TYPED:
            await show(app, pilot, name)
            app.screen.query_one("#value", Input).value = text
            await until(pilot, lambda: content(app, "#fault").startswith(f"Taken as {taken}. ") is (text != taken), taken)  # noqa: B023
            await edit(app, pilot, name, text)
            assert {**setup_of(app).values, **setup_of(app).simulation}[name] == taken


async def test_a_change_is_marked_taken_back_and_undone_and_an_effect_inserted_set_and_removed() -> None:
    async with opened() as (app, pilot):
        await edit(app, pilot, "x_axis.gain", "20 mm/(s*V)")
        table = app.screen.query_one(DataTable)
        assert str(table.get_row_at(table.cursor_row)[0]) == "*"
        fold = table.row_count - 1
        assert str(table.get_row_at(fold)[1]) == "2 start values and wired inputs"
        table.move_cursor(row=fold)
        await press(pilot, "enter")
        assert table.row_count == fold + 3
        await app.show_parameter("x_axis.gain")
        await press(pilot, "x")
        assert app.workbench.command() == "lathesim run 01_contour_error --variant I"
        await press(pilot, "ctrl+z")
        assert app.workbench.command() == "lathesim run 01_contour_error --variant I --set 'x_axis.gain=20 mm/(s*V)'"
        await pilot.press("i")
        await until(pilot, lambda: bool(app.screen.query("#wanted")), "the effects")
        await fill(app, pilot, "#wanted", "Backlash")
        choose(app, "Backlash")
        app.screen.query_one(OptionList).focus()
        await press(pilot, "enter")
        assert [dict(entry) for entry in setup_of(app).inserted] == [{"effect": "Backlash", "at": "x_encoder"}]
        width = next(name for name in app.workbench.prepared().plan.parameters if name.startswith("x_encoder_backlash."))
        await edit(app, pilot, width, "20 um")
        assert "20 um" in setup_of(app).inserted[0].values()
        await press(pilot, "x", "x")
        assert setup_of(app).inserted == ()


@pytest.mark.slow
async def test_the_interpolator_is_exchanged_and_its_own_parameters_appear() -> None:
    async with opened() as (app, pilot):
        await show(app, pilot, "interpolator.rapid_speed")
        await press(pilot, "c")
        assert "ConstantVelocityInterpolator" in choose(app, "ConstantAccelerationInterpolator")
        await press(pilot, "enter")
        assert isinstance(app.screen, ConfigureScreen)
        assert not [entry for entry in app.screen.query_one(ValuesPane)._entries if "e+300" in entry.text]  # a sign of the law's own
        await edit(app, pilot, "interpolator.acceleration", "0.01 m/s^2")
        await run_to_end(app, pilot)
        assert app.workbench.command().startswith("lathesim run lathesim_runs/01_contour_error/001.yaml")
    time = load("lathesim_runs/01_contour_error/001.h5").time[-1]
    assert time == pytest.approx(28.83, abs=0.02)


async def test_the_wiring_shows_what_feeds_a_part_and_what_it_feeds_one_below_the_other_where_it_is_too_wide() -> None:
    async with opened() as (app, pilot):
        await app.show_parameter("x_axis.gain")
        await app.show_parameter("z_dac.bits")
        for _ in range(4):
            await pilot.pause()
        about = app.screen.query_one("#about", Static)
        assert str(about.content).startswith("z_dac: DAConverter")
        app.screen.query_one(Tree).focus()
        await press(pilot, "down")
        assert str(about.content).startswith("tachometer: Tachometer")
        await app.show_parameter("x_dac.bits")
        app.screen.query_one(TabbedContent).active = "wiring"
        await pilot.pause()
        box = content(app, "#box")
        assert "x_controller.voltage──>│command [V]" in box
        assert "voltage [V]│──> x_axis.voltage" in box
        await pilot.resize_terminal(80, 24)
        await show(app, pilot, "x_controller.proportional")
        app.screen.query_one(TabbedContent).active = "wiring"
        await pilot.pause()
        rows = content(app, "#box").splitlines()
        assert "reference [m]        <── interpolator.x_reference" in rows
        assert "voltage [V] ──> x_dac.command" in rows
        assert max(map(len, rows)) <= 50


@pytest.mark.slow
async def test_the_lobes_of_a_lesson_are_drawn_and_a_lesson_without_them_is_told() -> None:
    async with opened("18_stability_lobes") as (app, pilot):
        await press(pilot, "f4")
        await pilot.press("l")
        await until(pilot, lambda: bool(app.screen.query("#lobes")), "the lobes")
        await pilot.pause(0.2)
        words = words_of(app.export_screenshot())
        assert "Stable at every speed below" in words
        assert "spindle speed / rpm" in words
        await pilot.press("escape")
        app.open_lesson(Path("01_contour_error"))
        await pilot.pause()
        await press(pilot, "f4", "l")
        assert "the lesson has no tool point" in told(app)


def write_lesson(name: str, tool_point: str) -> None:
    Path(name).write_text(f"lesson: L\nmachine: turning_with_chatter\nduration: 1 s\ntool_point: {tool_point}\n", encoding="utf-8")


async def test_the_tool_point_is_tapped_and_that_of_an_assembly_put_together() -> None:
    modes = "modes: [{frequency: 150 Hz, damping: 4 %, stiffness: 8e6 N/m}]"
    tap = "tap: {hits: 3, rate: 6400 Hz, contact: 1 ms, length: 0.4 s}"
    write_lesson("l.yaml", f"{{cutting_stiffness: 700 N/mm^2, {modes}, {tap}}}")
    write_lesson("m.yaml", "{cutting_stiffness: 700 N/mm^2, assembly: bar.yaml}")
    Path("bar.yaml").write_text("assembly: A bar\nbase: wall\nparts:\n  - {diameter: 20 mm, length: 100 mm}\n", encoding="utf-8")
    async with opened("l.yaml") as (app, pilot):
        await press(pilot, "f4")
        await pilot.press("k")
        await until(pilot, lambda: "mode 1: 150.0" in words_of(app.export_screenshot()), "the modes")
        words = words_of(app.export_screenshot())
        assert "3 hits kept" in words
        assert "frequency / Hz" in words
        assert "lathesim tap l --out tap.csv" in words
        await pilot.press("escape")
        app.open_lesson(Path("01_contour_error"))
        await pilot.pause()
        await press(pilot, "f4", "k")
        assert "the lesson has no tool point" in told(app)
        app.open_lesson(Path("m.yaml"))
        await press(pilot, "f2")
        await press(pilot, "f4", "k")
        await until(pilot, lambda: "lathesim couple bar.yaml" in words_of(app.export_screenshot()), "the bar")
        assert "A bar: 1 part." in words_of(app.export_screenshot())


@pytest.mark.slow
async def test_a_program_is_explained_line_by_line_chosen_and_made_from_a_form() -> None:
    async with opened() as (app, pilot):
        await press(pilot, "f4")
        app.screen.query_one(TabbedContent).active = "program"
        await pilot.pause()
        listing = app.screen.query_one(ProgramListing)
        listing.focus()
        await press(pilot, *["down"] * 9)
        assert content(app, "#explained") == "Line 9: Straight line to X 17 mm (radius), Z 40 mm at 180 mm/min."
        assert 13 in listing.odd
        await press(pilot, *["down"] * 4)
        assert "! " in content(app, "#explained")
        app.screen.query_one(Tree).focus()
        await press(pilot, "n")
        await fill(app, pilot, "#length", "20 s")
        assert "is given in s, but m is wanted" in content(app, "#fault")
        app.screen.query_one("#length", Input).value = "21"
        await fill(app, pilot, "#feed", "90")
        assert content(app, "#fault") == "Taken as Length behind the face 21 mm, Feed (mm/min or mm/rev) 90 mm/min."
        await pilot.click("#take")
        await until(pilot, lambda: Path("part_programs/cut.nc").exists(), "the program")
        await run_to_end(app, pilot)
        assert "--program part_programs/cut.nc" in app.workbench.command()
        assert "Z36" in Path("part_programs/cut.nc").read_text(encoding="utf-8")


@pytest.mark.slow
async def test_the_simulation_is_set_and_loaded_again() -> None:
    async with opened() as (app, pilot):
        await press(pilot, "f4")
        await show(app, pilot, "simulation")
        await pilot.press("down", "down", "enter")
        await answer(app, pilot, "11")
        assert app.workbench.command() == "lathesim run 01_contour_error --variant I --seed 11"
        await press(pilot, "ctrl+o")
        await answer(app, pilot, "13_process_control")
        assert app.workbench.command().startswith("lathesim run 13_process_control")
