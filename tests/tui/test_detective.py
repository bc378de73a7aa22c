"""The detective: a concealed case is compared, guessed at, diagnosed, explained and revealed; recordings without a mapping; stopping."""

from __future__ import annotations

import threading
from pathlib import Path

import numpy as np
import pytest
from textual.pilot import Pilot
from textual.widgets import Button, Input, Select, TabbedContent

from lathesim.cli.main import run_command_line
from lathesim.identification.records import CandidateStanding
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.proposed_lesson import COMPARE, IGNORE, TIME, ColumnMeaning, recordings_entry
from lathesim.lessons.simulate import prepare, simulate
from lathesim.plugins import load_registry
from lathesim.tui.app import LathesimApp
from lathesim.tui.model.case_file import CaseFile, Guess, guessed_columns
from lathesim.tui.screens.detective import DetectiveScreen
from lathesim.tui.widgets.case_panes import standing_bars
from tests.tui.driving import content, opened, press, setup_of, told, until

LESSON = "22_what_is_wrong_with_this_machine"


def hide(effect: str, folder: str = "case_1") -> None:
    assert run_command_line(["conceal", LESSON, "--effect", effect, "--validate", "--seed", "5", "--out", folder]) == 0


async def compared(app: LathesimApp, pilot: Pilot[None], place: str) -> tuple[DetectiveScreen, CaseFile]:
    """Open a case on the screen and wait until it is compared."""
    await press(pilot, "f7")
    screen = app.screen
    assert isinstance(screen, DetectiveScreen)
    screen.query_one("#path", Input).value = place
    await pilot.click("#open")
    await until(pilot, lambda: screen.case is not None and screen.case.comparison is not None and not screen.busy, "the comparison")
    assert screen.case is not None
    return screen, screen.case


@pytest.mark.slow
@pytest.mark.timeout(300)
async def test_a_detective_guesses_is_told_inserts_the_effect_and_sees_the_residual_fall() -> None:
    hide("CoulombFriction:level=20 N@x_axis")
    async with opened(LESSON) as (app, pilot):
        screen, case = await compared(app, pilot, "case_1")
        before = max(item.over_floor for item in case.comparison.channels) if case.comparison else 0.0
        assert "[✗ x_axis]" in content(app, "#chain")
        await press(pilot, "s")
        assert app.screen.query_one(TabbedContent).active == "guess"
        screen.query_one("#size", Input).value = "19 N"
        screen.take_guess(Guess("CoulombFriction", "x_axis", "19 N"))
        await pilot.press("s")
        await until_long(pilot, lambda: "CoulombFriction at x_axis" in content(app, "#standing"))
        assert case.diagnosis is None, "it stands there while the search goes on"
        await until_long(pilot, lambda: case.diagnosis is not None and not screen.busy)
        assert "✓ Right: CoulombFriction at x_axis. ✓ level is 20.21 N, you said 19 N." in content(app, "#judged")
        await pilot.press("i")
        await until_long(pilot, lambda: not screen.busy and screen.case is not None and app.workbench.live is None)
        assert setup_of(app).inserted[0]["effect"] == "CoulombFriction"
        await until_long(pilot, lambda: case.comparison is not None and max(i.over_floor for i in case.comparison.channels) < before / 20)
        screen.reveal("case_1", "case_1_answer.json")
        assert "✓ Your guess: CoulombFriction x_axis 19 N" in content(app, "#truth")


async def until_long(pilot: Pilot[None], holds: object) -> None:
    for _ in range(8):
        try:
            await until(pilot, holds, "it")  # type: ignore[arg-type]
        except AssertionError:
            continue
        return
    raise AssertionError("it did not come")


@pytest.mark.slow
async def test_a_search_is_stopped_and_a_wrong_answer_refused() -> None:
    hide("none")
    async with opened(LESSON) as (app, pilot):
        screen, _ = await compared(app, pilot, "case_1")
        screen.take_guess(Guess())
        await pilot.press("s")
        await until(pilot, lambda: screen.busy.startswith("Searching"), "the search")
        await pilot.press("s")
        await until(pilot, lambda: not screen.busy, "the end of the search")
        screen.reveal("case_1", "case_1/seal.json")
        assert content(app, "#truth").startswith("✗")
        await pilot.press("f2")
        assert app.current_mode == "bench"


async def test_columns_are_mapped_in_a_form_where_the_lesson_says_nothing() -> None:
    record = simulate(load_lesson("32_the_forged_sensor"), load_registry(), "honest", engine="compiled")
    data = np.column_stack([record.time, record["x_axis.position"], record["x_encoder.position"]])[:2000]
    header = "time [s],x axis position [m],x encoder position [m]"
    np.savetxt("mine.csv", data, delimiter=",", header=header, comments="")
    async with opened("32_the_forged_sensor") as (app, pilot):
        await press(pilot, "f7")
        app.screen.query_one("#path", Input).value = "mine.csv"
        await pilot.click("#open")
        await until(pilot, lambda: bool(app.screen.query("#role-2")), "the form")
        assert [app.screen.query_one(f"#role-{place}", Select).value for place in range(3)] == [TIME, COMPARE, COMPARE]
        assert app.screen.query_one("#target-1", Input).value == "x_axis.position"
        app.screen.query_one("#unit-1", Input).value = ""
        take = app.screen.query_one("#take", Button)
        await pilot.click(take)
        await until(pilot, lambda: "needs a channel and a unit" in content(app, "#fault"), "the fault")
        app.screen.query_one("#unit-1", Input).value = "m"
        await until(pilot, lambda: not take.has_class("-active"), "the button")  # which takes no second click before
        await pilot.click(take)
        await until(pilot, lambda: isinstance(app.screen, DetectiveScreen), "the screen")
        screen = app.screen
        assert isinstance(screen, DetectiveScreen)
        await until(pilot, lambda: not screen.busy and screen.case is not None and screen.case.comparison is not None, "the comparison")
        assert screen.query_one(TabbedContent).active == "compare"
    assert "x_axis.position" in Path("32_the_forged_sensor_mine.yaml").read_text(encoding="utf-8")


async def test_what_is_no_recording_is_told_in_a_sentence() -> None:
    Path("empty.csv").write_text("", encoding="utf-8")
    Path("words.csv").write_text("name,colour\nanna,red\nben,blue\n", encoding="utf-8")
    async with opened() as (app, pilot):
        await press(pilot, "f7")
        for typed in ("nowhere.csv", "empty.csv", "words.csv", "lathesim_runs"):
            app.screen.query_one("#path", Input).value = typed
            button = app.screen.query_one("#open", Button)
            # a button takes no second click while it shows the first one
            await until(pilot, lambda: not button.has_class("-active"), "the button")  # noqa: B023
            await pilot.click(button)
            await until(pilot, lambda: typed in told(app), f"a sentence about {typed}")  # noqa: B023
        await pilot.press("s")
        assert isinstance(app.screen, DetectiveScreen)
        await press(pilot, "h")
        await pilot.click("#choose")
        await until(pilot, lambda: "AmplifierDeadZone" in content(app, "#page"), "the page of the first effect")
        await pilot.press("enter")
        await until(pilot, lambda: bool(app.screen.query("#hidden")), "the form")
        assert app.screen.query_one("#hidden", Input).value == "AmplifierDeadZone@x_controller"


@pytest.mark.slow
async def test_a_class_gets_a_folder_each_and_the_answer_is_revealed_from_its_own() -> None:
    async with opened(LESSON) as (app, pilot):
        await press(pilot, "f7")
        await press(pilot, "h")
        app.screen.query_one("#hidden", Input).value = "CoulombFriction:level=20 N@x_axis"
        app.screen.query_one("#folder", Input).value = "class"
        count = app.screen.query_one("#count", Input)
        count.focus()
        count.value = "0"
        await press(pilot, "enter")
        assert "a number of cases from 1 to 200" in content(app, "#fault")
        count.value = "2"
        await pilot.press("enter")
        await until(pilot, lambda: isinstance(app.screen, DetectiveScreen), "the screen")
        screen = app.screen
        assert isinstance(screen, DetectiveScreen)
        await until(pilot, lambda: Path("class_2_answer.json").exists() and not screen.busy, "the cases")
        for number in (1, 2):
            assert {path.name for path in Path(f"class_{number}").iterdir()} >= {"recording.csv", "lesson.yaml", "seal.json"}
            assert Path(f"class_{number}_answer.json").exists()
        assert Path("class_1/recording.csv").read_bytes() != Path("class_2/recording.csv").read_bytes()
        screen.query_one("#seal", Input).value = "class_2"
        screen.query_one("#sealed", Input).value = "class_2_answer.json"
        await press(pilot, "v")
        assert "CoulombFriction at x_axis" in content(app, "#truth")
        screen.query_one("#sealed", Input).value = "class_1_answer.json"
        await press(pilot, "v")
        assert content(app, "#truth").startswith("✗")


async def test_leaving_does_not_wait_for_a_search() -> None:
    hold = threading.Event()
    async with opened() as (app, pilot):
        await press(pilot, "f7")
        screen = app.screen
        assert isinstance(screen, DetectiveScreen)
        screen.in_thread("Searching ...", lambda: hold.wait(60.0), lambda: None, writes=False)
        await pilot.press("ctrl+q")
    assert app.droppable == 1, "the search still goes on"
    hold.set()


def test_candidates_stand_in_the_order_of_what_they_gain() -> None:
    standings = [
        CandidateStanding("Backlash at x_encoder", 26.0, np.nan, 0.01),
        CandidateStanding("TorqueRipple at x_axis", 166.0, -13.0, 0.04),
        CandidateStanding("CoulombFriction at x_axis", 4951.0, 4979.0, 0.996),
    ]
    rows = str(standing_bars(standings, 76)).splitlines()
    assert rows[1:] == [
        "CoulombFriction at x_axis  ██████████ 100%   4979",
        "TorqueRipple at x_axis                  4%    -13",
        "Backlash at x_encoder                   1%   (26)",
    ]


def test_columns_are_guessed_by_the_words_and_units_that_look_knows(tmp_path: Path) -> None:
    rows = np.column_stack([np.arange(200.0), np.arange(200.0), np.sin(np.arange(200.0)), np.arange(200.0)])
    file = tmp_path / "log.csv"
    np.savetxt(file, rows, delimiter=",", header="zeit_ms,x_encoder_position_um,x_drive_current,x_axis_velocity [mm]", comments="")
    registry = load_registry(installed=False)
    guessed = guessed_columns(file, prepare(load_lesson("01_contour_error"), registry), registry)
    assert [(item.role, item.unit) for item in guessed[:3]] == [(TIME, "ms"), (COMPARE, "um"), (IGNORE, "")]
    assert guessed[1].target == "x_encoder.position"
    assert (guessed[3].unit, "velocity" in guessed[3].target) == ("mm", False), "no speed is in mm"


def test_a_mapping_needs_a_time_and_something_to_compare() -> None:
    entry = recordings_entry([ColumnMeaning("t", TIME, "", "ms"), ColumnMeaning("x", COMPARE, "x_axis.position", "mm", 2.0)])
    assert entry == {
        "time": {"column": "t", "unit": "ms"},
        "compare": {"x_axis.position": {"column": "x", "unit": "mm", "scale": 2.0}},
    }
    with pytest.raises(Exception, match="no column is the time"):
        recordings_entry([ColumnMeaning("x", COMPARE, "x_axis.position", "mm")])
