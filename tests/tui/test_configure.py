"""Configure: values edited and checked, parts and effects exchanged, wiring drawn, programs chosen and made, saved and loaded."""

from __future__ import annotations

from pathlib import Path

import pytest
from textual.widgets import DataTable, Input, OptionList, Static, TabbedContent, Tree

from lathesim.cli.main import run_command_line
from lathesim.record import load
from lathesim.tui.app import LathesimApp
from lathesim.tui.screens.configure import ConfigureScreen
from lathesim.tui.widgets.machine_panes import ValuesPane
from lathesim.tui.widgets.program_listing import ProgramListing
from tests.tui.driving import edit, opened, run_to_end, told, until
from tests.tui.screen_words import words_of


@pytest.fixture(autouse=True)
def own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def said(app: LathesimApp) -> str:
    return str(app.screen.query_one("#fault", Static).content)


async def test_a_saved_configuration_gives_the_same_bits_on_the_command_line() -> None:
    async with opened() as (app, pilot):
        await edit(app, pilot, "x_controller.proportional", "0.449 V/mm")
        await edit(app, pilot, "z_controller.proportional", "0.449 V/mm")
        await pilot.press("ctrl+s")
        await pilot.pause()
        app.screen.query_one("#answer", Input).value = "mine.yaml"
        await pilot.press("enter")
        Path("theirs.yaml").write_text("lesson: Theirs\n", encoding="utf-8")
        for name, fault in (("mine.yaml", ""), ("theirs.yaml", "'theirs.yaml' is there already. Choose another name.")):
            await pilot.press("ctrl+s")
            await pilot.pause()
            app.screen.query_one("#answer", Input).value = name
            await pilot.press("enter")
            await pilot.pause()
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
    ("x_controller.proportional", "0,449", "x_controller.proportional: the comma of '0,449'"),
    ("x_controller.proportional", "1,000 V/mm", "Write a decimal point."),
    ("x_axis.time_constant", "-24", "outside"),
    ("duration", "-1", "it must be above zero"),
]
"""Parameter, a text that is no value of it, and what is said below the field."""


TYPED = [
    ("x_controller.proportional", "0.449", "0.449 V/mm"),
    ("x_controller.proportional", "449 V/m", "449 V/m"),
    ("x_controller.proportional", "450", "450 V/m"),
    ("x_dac.bits", "12", "12"),
    ("sample_period", "10", "10 ms"),
]
"""Parameter, a text typed after those above, and the value that is taken: a number alone has the unit that is shown."""


async def test_a_wrong_value_is_told_as_it_is_typed_and_a_right_one_is_taken_in_the_unit_that_is_shown() -> None:
    async with opened() as (app, pilot):
        for name, text, fault in WRONG:
            await app.show_parameter(name)
            await pilot.pause()
            app.screen.query_one("#value", Input).value = text
            await until(pilot, lambda: said(app).startswith("✗") and fault in said(app), fault)  # noqa: B023
        assert app.workbench.setup is not None
        assert not app.workbench.setup.is_changed
        await edit(app, pilot, "x_controller.proportional", "0.449 V/mm")
        screen = app.screen
        assert isinstance(screen, ConfigureScreen)
        assert screen.entry is not None
        assert (screen.entry.text, screen.entry.default) == ("0.449 V/mm", "0.2245 V/mm")
        for name, text, taken in TYPED:
            await app.show_parameter(name)
            await pilot.pause()
            app.screen.query_one("#value", Input).value = text
            await until(pilot, lambda: said(app).startswith(f"Taken as {taken}. ") is (text != taken), taken)  # noqa: B023
            await edit(app, pilot, name, text)
            assert app.workbench.setup is not None
            assert {**app.workbench.setup.values, **app.workbench.setup.simulation}[name] == taken


async def test_a_change_is_marked_taken_back_and_undone() -> None:
    async with opened() as (app, pilot):
        await edit(app, pilot, "x_axis.gain", "20 mm/(s*V)")
        table = app.screen.query_one(DataTable)
        assert str(table.get_row_at(table.cursor_row)[0]) == "*"
        fold = table.row_count - 1
        assert str(table.get_row_at(fold)[1]) == "2 start values and wired inputs"
        table.move_cursor(row=fold)
        await pilot.press("enter")
        await pilot.pause()
        assert table.row_count == fold + 3
        await app.show_parameter("x_axis.gain")
        await pilot.press("x")
        await pilot.pause()
        assert app.workbench.command() == "lathesim run 01_contour_error --variant I"
        await pilot.press("ctrl+z")
        await pilot.pause()
        assert app.workbench.command() == "lathesim run 01_contour_error --variant I --set 'x_axis.gain=20 mm/(s*V)'"


@pytest.mark.slow
async def test_the_interpolator_is_exchanged_and_its_own_parameters_appear() -> None:
    async with opened() as (app, pilot):
        await app.show_parameter("interpolator.rapid_speed")
        await pilot.pause()
        await pilot.press("c")
        await pilot.pause()
        found = app.screen.query_one(OptionList)
        names = [str(found.get_option_at_index(place).prompt).strip("> ") for place in range(found.option_count)]
        assert set(names) >= {"ConstantVelocityInterpolator", "ConstantAccelerationInterpolator"}
        found.highlighted = names.index("ConstantAccelerationInterpolator")
        await pilot.press("enter")
        await pilot.pause()
        assert isinstance(app.screen, ConfigureScreen)
        assert not [entry for entry in app.screen.query_one(ValuesPane)._entries if "e+300" in entry.text]  # a sign of the law's own
        await edit(app, pilot, "interpolator.acceleration", "0.01 m/s^2")
        await run_to_end(app, pilot)
        assert app.workbench.command().startswith("lathesim run lathesim_runs/01_contour_error/001.yaml")
    time = load("lathesim_runs/01_contour_error/001.h5").time[-1]
    assert time == pytest.approx(28.83, abs=0.02)


async def test_an_effect_is_inserted_set_and_removed() -> None:
    async with opened() as (app, pilot):
        await app.show_parameter("x_axis.gain")
        await pilot.pause()
        await pilot.press("i")
        await pilot.pause()
        app.screen.query_one("#wanted", Input).value = "Backlash"
        await pilot.pause()
        listed = app.screen.query_one(OptionList)
        names = [str(listed.get_option_at_index(place).prompt).strip("> ") for place in range(listed.option_count)]
        listed.highlighted = names.index("Backlash")
        listed.focus()
        await pilot.press("enter")
        await pilot.pause()
        setup = app.workbench.setup
        assert setup is not None
        assert [dict(entry) for entry in setup.inserted] == [{"effect": "Backlash", "at": "x_encoder"}]
        width = next(name for name in app.workbench.prepared().plan.parameters if name.startswith("x_encoder_backlash."))
        await edit(app, pilot, width, "20 um")
        assert app.workbench.setup is not None
        assert "20 um" in app.workbench.setup.inserted[0].values()
        await pilot.press("x")
        await pilot.press("x")
        await pilot.pause()
        assert app.workbench.setup.inserted == ()


async def test_the_wiring_shows_what_feeds_a_part_and_what_it_feeds_and_the_arrows_go_on_from_it() -> None:
    async with opened() as (app, pilot):
        await app.show_parameter("x_axis.gain")
        await app.show_parameter("z_dac.bits")
        for _ in range(4):
            await pilot.pause()
        about = app.screen.query_one("#about", Static)
        assert str(about.content).startswith("z_dac: DAConverter")
        app.screen.query_one(Tree).focus()
        await pilot.press("down")
        await pilot.pause()
        assert str(about.content).startswith("tachometer: Tachometer")
        await app.show_parameter("x_dac.bits")
        app.screen.query_one(TabbedContent).active = "wiring"
        await pilot.pause()
        box = str(app.screen.query_one("#box", Static).content)
        assert "x_controller.voltage──>│command [V]" in box
        assert "voltage [V]│──> x_axis.voltage" in box


async def test_a_wiring_that_is_too_wide_stands_one_below_the_other() -> None:
    async with opened(size=(80, 24)) as (app, pilot):
        await app.show_parameter("x_controller.proportional")
        await pilot.pause()
        app.screen.set_focus(None)
        app.screen.query_one(TabbedContent).active = "wiring"
        await until(pilot, lambda: app.screen.query_one("#box").size.width > 0, "the wiring")
        box = str(app.screen.query_one("#box", Static).content).splitlines()
        assert "reference [m]        <── interpolator.x_reference" in box
        assert "voltage [V] ──> x_dac.command" in box
        assert max(map(len, box)) <= 50


@pytest.mark.slow
async def test_the_lobes_of_a_lesson_are_drawn_and_a_lesson_without_them_is_told() -> None:
    async with opened("18_stability_lobes") as (app, pilot):
        await pilot.press("f4")
        await pilot.pause()
        await pilot.press("l")
        await until(pilot, lambda: bool(app.screen.query("#lobes")), "the lobes")
        await pilot.pause(0.2)
        words = words_of(app.export_screenshot())
        assert "Stable at every speed below" in words
        assert "spindle speed / rpm" in words
        await pilot.press("escape")
        app.open_lesson(Path("01_contour_error"))
        await pilot.pause()
        await pilot.press("f4", "l")
        await pilot.pause()
        assert "the lesson has no tool point" in told(app)


async def test_the_tool_point_is_tapped_and_its_modes_are_shown(tmp_path: Path) -> None:
    modes = "modes: [{frequency: 150 Hz, damping: 4 %, stiffness: 8e6 N/m}]"
    tap = "tap: {hits: 3, rate: 6400 Hz, contact: 1 ms, length: 0.4 s}"
    tool = f"tool_point:\n  cutting_stiffness: 700 N/mm^2\n  {modes}\n  {tap}\n"
    text = f"lesson: L\nmachine: turning_with_chatter\nduration: 1 s\n{tool}"
    (tmp_path / "l.yaml").write_text(text, encoding="utf-8")
    async with opened(str(tmp_path / "l.yaml")) as (app, pilot):
        await pilot.press("f4")
        await pilot.pause()
        await pilot.press("k")
        await until(pilot, lambda: "mode 1: 150.0" in words_of(app.export_screenshot()), "the modes")
        words = words_of(app.export_screenshot())
        assert "3 hits kept" in words
        assert "frequency / Hz" in words
        assert "lathesim tap l --out tap.csv" in words
        await pilot.press("escape")
        app.open_lesson(Path("01_contour_error"))
        await pilot.pause()
        await pilot.press("f4", "k")
        await pilot.pause()
        assert "the lesson has no tool point" in told(app)


async def test_the_tool_point_of_an_assembly_is_put_together(tmp_path: Path) -> None:
    (tmp_path / "bar.yaml").write_text("assembly: A bar\nbase: wall\nparts:\n  - {diameter: 20 mm, length: 100 mm}\n", encoding="utf-8")
    tool = "tool_point: {cutting_stiffness: 700 N/mm^2, assembly: bar.yaml}"
    text = f"lesson: L\nmachine: turning_with_chatter\nduration: 1 s\n{tool}\n"
    (tmp_path / "l.yaml").write_text(text, encoding="utf-8")
    async with opened(str(tmp_path / "l.yaml")) as (app, pilot):
        await pilot.press("f4")
        await until(pilot, lambda: isinstance(app.screen, ConfigureScreen), "the screen")
        await pilot.press("k")
        await until(pilot, lambda: "lathesim couple bar.yaml" in words_of(app.export_screenshot()), "the bar")
        assert "A bar: 1 part." in words_of(app.export_screenshot())


@pytest.mark.slow
async def test_a_program_is_explained_line_by_line_chosen_and_made_from_a_form() -> None:
    async with opened() as (app, pilot):
        await pilot.press("f4")
        await pilot.pause()
        app.screen.query_one(TabbedContent).active = "program"
        await pilot.pause()
        listing = app.screen.query_one(ProgramListing)
        listing.focus()
        for _ in range(9):
            await pilot.press("down")
        await pilot.pause()
        explained = str(app.screen.query_one("#explained", Static).content)
        assert explained == "Line 9: Straight line to X 17 mm (radius), Z 40 mm at 180 mm/min."
        assert 13 in listing.odd
        for _ in range(4):
            await pilot.press("down")
        await pilot.pause()
        assert "! " in str(app.screen.query_one("#explained", Static).content)
        app.screen.query_one(Tree).focus()
        await pilot.press("n")
        await pilot.pause()
        app.screen.query_one("#length", Input).value = "20 s"
        await pilot.pause()
        assert "is given in s, but m is wanted" in said(app)
        app.screen.query_one("#length", Input).value = "21"
        app.screen.query_one("#feed", Input).value = "90"
        await pilot.pause()
        assert said(app) == "Taken as Length behind the face 21 mm, Feed (mm/min or mm/rev) 90 mm/min."
        await pilot.click("#take")
        await until(pilot, lambda: Path("part_programs/cut.nc").exists(), "the program")
        await run_to_end(app, pilot)
        assert "--program part_programs/cut.nc" in app.workbench.command()
        assert "Z36" in Path("part_programs/cut.nc").read_text(encoding="utf-8")


@pytest.mark.slow
async def test_the_simulation_is_set_and_loaded_again() -> None:
    async with opened() as (app, pilot):
        await pilot.press("f4")
        await pilot.pause()
        await app.show_parameter("simulation")
        await pilot.pause()
        await pilot.press("down", "down", "enter")
        app.screen.query_one("#value", Input).value = "11"
        await pilot.press("enter")
        await pilot.pause()
        assert app.workbench.command() == "lathesim run 01_contour_error --variant I --seed 11"
        await pilot.press("ctrl+o")
        await pilot.pause()
        app.screen.query_one("#path", Input).value = "13_process_control"
        await pilot.press("enter")
        await pilot.pause()
        assert app.workbench.command().startswith("lathesim run 13_process_control")
