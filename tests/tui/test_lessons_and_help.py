"""Lessons with their hints and the student's book; help; the palette."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from textual.command import Hit
from textual.widgets import Input, Label, Markdown, OptionList, RichLog, Static, Tree

from lathesim.tui.model.student_book import suggestion
from lathesim.tui.screens.help import KeysView
from lathesim.tui.widgets.controls import ReadOuts
from lathesim.tui.widgets.time_plot import TimePlot
from tests.tui.driving import content, fill, opened, press, run_to_end, setup_of, told, until
from tests.tui.screen_words import words_of


async def test_a_thing_to_try_sets_its_values_a_hint_opens_after_a_try_and_the_book_keeps_the_best() -> None:
    async with opened() as (app, pilot):
        await pilot.press("f6")
        await pilot.pause(0.2)
        await pilot.press("y", "down", "down", "enter")
        await pilot.pause(0.2)
        assert app.current_mode == "bench"
        assert app.workbench.command() == "lathesim run 01_contour_error --variant I --set x_dac.bits=12 --set z_dac.bits=12"
        await press(pilot, "ctrl+z", "f6")
        goals = app.screen.query_one("#goals", Static)
        assert "A hint opens after your first run." in str(goals.content)
        listed = app.screen.query_one("#lessons", OptionList)
        rows = [str(listed.get_option_at_index(place).prompt) for place in range(3)]
        assert rows[0] == "basics  0 of 5"
        assert re.fullmatch(r"→ Servo control and contour er… +40 min ▪ +", rows[1])
        assert "→ next ✓ met • tried ○ new" in words_of(app.export_screenshot())
        assert rows[2].startswith("○ Quantisation and limit cycles")
        await run_to_end(app, pilot)
        await pilot.press("f6")
        await pilot.pause(0.2)
        assert "Hint: Raise the proportional gain" in str(goals.content)
        assert "A hint opens after your next run." in str(goals.content)
        assert str(listed.get_option_at_index(1).prompt).startswith("→ Servo")
        assert "best 0.6851 mm" in str(goals.content)
    book = json.loads(Path("lathesim_progress.json").read_text(encoding="utf-8"))
    entry = book["lessons"]["01_contour_error"]
    assert entry["tries"] == 1
    assert not entry["best"]["max_contour_error at most"]["met"]


async def test_f5_runs_the_lesson_under_the_cursor_with_what_was_changed_of_it_and_the_bench_shows_what_runs() -> None:
    async with opened() as (app, pilot):
        app.workbench.pace = 0.1
        await pilot.press("f6")
        await until(pilot, lambda: app.screen.query_one("#lessons", OptionList).highlighted == 1, "the lessons")
        await pilot.press("down", "f5")
        await until(pilot, lambda: app.current_mode == "bench" and app.workbench.live is not None, "the run")
        assert content(app, "#title") == "Quantisation and limit cycles"
        result = app.screen.query_one("#result", Static)
        assert str(result.content) == "Running 001 8_bits. F5 stops it."
        await pilot.press("f6", "down", "enter")
        await until(pilot, lambda: content(app, "#title") == "Integral windup", "another lesson")
        assert str(result.content) == "Running 001 8_bits of Quantisation and limit cycles. F5 stops it."
        await pilot.press("f5")
        await until(pilot, lambda: str(result.content).startswith("Stopped, kept as 001 of Quantisation"), "the end")
        assert [run.path.parent.name for run in app.workbench.runs] == ["02_quantisation"]
        app.workbench.change(setup_of(app).with_simulation("duration", "0.1 s"))
        await press(pilot, "f6")
        await run_to_end(app, pilot)
        assert app.workbench.runs[-1].title.endswith(", duration=0.1 s")


LONG = " Say it to a tenth of a millimetre" * 4


async def test_questions_are_asked_after_a_run_and_the_answers_stand_beside_it() -> None:
    Path("lesson_configs").mkdir()
    Path("lesson_configs/99_mine.yaml").write_text(
        "lesson: Mine\nmachine: turning_with_chatter\nduration: 2 ms\nplot: [cut.force]\nread_outs: [cut.force]\nquestions:\n"
        "  - {ask: Which?, choices: [first, second], answer: second}\n"
        f"  - {{ask: How wide?{LONG}, within: 0.1 mm, answer: 1 mm}}\n",
        encoding="utf-8",
    )
    other = "lesson: Other\nmachine: turning_with_chatter\nduration: 2 ms\nplot: [cut.thickness]\nread_outs: [cut.force]\n"
    Path("lesson_configs/98_other.yaml").write_text(other, encoding="utf-8")
    async with opened("98_other") as (app, pilot):
        await run_to_end(app, pilot)
        await press(pilot, "f6", "f3")
        assert "cut thickness" in str(app.screen.query_one(TimePlot).border_title)
        app.workbench.open_lesson("99_mine")
        await press(pilot, "f2")
        await pilot.press("f6", "a")
        await until(pilot, lambda: "Run the lesson first" in told(app), "the sentence")
        await run_to_end(app, pilot)
        assert "2 questions about this run: press F6, then a." in told(app)
        assert "cut force" in str(app.screen.query_one("#plot").border_title)
        assert app.screen.query_one(ReadOuts).readings[1].title == "Force"
        await press(pilot, "f3")
        assert "cut force" in str(app.screen.query_one(TimePlot).border_title)
        await pilot.press("f6", "a", "question_mark")
        await until(pilot, lambda: isinstance(app.screen, KeysView), "the keys")
        assert "This dialog" in "\n".join(str(widget.content) for widget in app.screen.query(Static))
        await press(pilot, "escape")
        await pilot.press("enter")
        await until(pilot, lambda: "Not right yet" in told(app), "the verdict")
        await pilot.press("a", "down", "enter")
        await until(pilot, lambda: "Right." in told(app), "the verdict")
        await press(pilot, "a")
        assert app.screen.query_one(Label).size.height > 1  # a long question is read to its end
        await pilot.press(*"1.05", "space", *"mm", "enter")
        await pilot.press("a")
        await until(pilot, lambda: "All questions are answered." in told(app), "the end")
        tries = app.screen.query_one("#tries", OptionList)
        assert [str(tries.get_option_at_index(place).prompt) for place in range(2)] == ["✓ Which? second", f"✓ How wide?{LONG} 1.05 mm"]
    kept = json.loads(Path("lathesim_runs/99_mine/001.answers.json").read_text(encoding="utf-8"))
    assert [(item["answer"], item["tries"]) for item in kept["answers"]] == [("second", 2), ("1.05 mm", 1)]


def test_a_suggestion_is_read_from_the_words_of_a_lesson() -> None:
    found = suggestion("Try --variant II --set x_axis.time_constant='30 ms', then more.", ("I", "II"))
    assert (found.variant, found.values) == ("II", (("x_axis.time_constant", "30 ms"),))
    assert not suggestion("Compare I with II.", ("I", "II")).can_be_set


@pytest.mark.slow
async def test_help_shows_keys_chapters_and_the_page_of_an_effect() -> None:
    async with opened() as (app, pilot):
        await pilot.press("f1")
        await pilot.pause(0.3)
        assert "Run/Stop" in content(app, "#text")
        app.screen.query_one("#wanted", Input).value = "backlash"
        await pilot.pause(0.3)
        tree = app.screen.query_one(Tree)
        labels = [str(leaf.label) for node in tree.root.children for leaf in node.children]
        assert "Backlash" in labels
        await app.show_help("effect", "Backlash")
        await pilot.pause(0.2)
        assert "Fingerprint" in content(app, "#text")
        await app.show_help("chapter", "plugins")
        await pilot.pause(0.3)
        assert app.screen.query_one(Markdown).display


async def test_the_palette_finds_lessons_channels_parameters_components_effects_and_actions() -> None:
    from lathesim.tui.app import WorkbenchProvider

    wanted = {
        "11_constant_surface_speed": "lesson",
        "cutting_force.radial_force": "channel",
        "contour error": "channel",
        "x_controller.proportional": "parameter",
        "PositionController": "component",
        "CoulombFriction": "effect",
        "Run or stop": "F5",
        "Magnify": "Magnify the error",
        "Lobes": "stability lobes",
    }
    async with opened() as (app, pilot):
        await pilot.pause()
        provider = WorkbenchProvider(app.screen)
        for query, about in wanted.items():
            hits = [hit async for hit in provider.search(query)]
            assert any(str(hit.match_display) == query and about in str(hit.help) for hit in hits if isinstance(hit, Hit)), query
        await app.do_on("configure", "cut")
        await until(pilot, lambda: bool(app.screen.query("#length")), "the form")


async def test_commands_are_forms_that_show_what_the_command_prints() -> None:
    async with opened() as (app, pilot):
        await pilot.press("w")
        await until(pilot, lambda: bool(app.screen.query("#field-0")), "the form")
        await fill(app, pilot, "#field-0", "x_dac.bits=8,12")
        line = "$ lathesim sweep 01_contour_error --vary x_dac.bits=8,12 --variant I"
        assert content(app, "#line") == line
        await pilot.press("escape", "f7")
        await until(pilot, lambda: app.current_mode == "detective", "the detective")
        await pilot.press("a")
        await until(pilot, lambda: bool(app.screen.query("#field-3")), "the form")
        await fill(app, pilot, "#field-3", "Backlash")
        assert content(app, "#line") == "$ lathesim isolable 01_contour_error --effect Backlash"
        await pilot.press("escape", "f6")
        await until(pilot, lambda: app.current_mode == "lessons", "the lessons")
        await pilot.press("g")
        await until(pilot, lambda: bool(app.screen.query("#field-0")), "the form")
        app.screen.query_one("#field-0", Input).focus()
        await pilot.press("enter")
        log = app.screen.query_one(RichLog)
        await until(pilot, lambda: any("exit code" in line.text for line in log.lines), "the end of the command")
        assert "class" in log.lines[1].text


@pytest.mark.slow
async def test_the_palette_finds_a_channel_and_plots_it() -> None:
    async with opened() as (app, pilot):
        await pilot.press("ctrl+p")
        await pilot.pause(0.2)
        await pilot.press(*"cutting_force.radial")
        from textual.command import CommandList

        await until(pilot, lambda: app.screen.query_one(CommandList).option_count > 0, "a hit")
        await pilot.press("enter")
        await run_to_end(app, pilot)
        await until(pilot, lambda: "cutting radial force" in str(app.screen.query_one("#plot").border_title), "the curve")
