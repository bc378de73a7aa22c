"""A plug-in writer breaks a law, reads the message, mends it, loads it again and runs it; and adds a command and a screen in one file."""

from __future__ import annotations

from pathlib import Path

import pytest
from textual.widgets import Static

from lathesim.cli.main import run_command_line
from tests.cli.command import done, refused
from tests.tui.driving import choose, content, opened, press, run_to_end, setup_of, until

FORCE = '''
from lathesim.component import Component, Input, Output, Parameter
from lathesim.components.cutting_forces import LinearForce
from lathesim.hookspecs import hookimpl


class MyForce(LinearForce):
    """Cutting forces of my own, a constant times those of the stock part."""


@hookimpl
def register_components():
    return [MyForce]
'''

GUEST = '''
import click

from lathesim.hookspecs import CommandEntry, ScreenEntry, hookimpl


@click.command()
@click.argument("lesson")
def count(lesson):
    """Count the variants of LESSON."""
    from lathesim.lessons.lesson import load_lesson

    click.echo(f"{len(load_lesson(lesson).variants)} variants")


def tally():
    from textual.widgets import Static
    from lathesim.tui.screens.workbench_screen import WorkbenchScreen

    class Tally(WorkbenchScreen):
        def compose_body(self):
            yield Static("", id="tally")

        def show_changes(self, changed):
            self.query_one("#tally", Static).update(f"{len(self.workbench.setup.lesson.variants)} variants")

        def command(self):
            return f"lathesim count {self.workbench.setup.lesson.name}"

    return Tally()


def title(lesson):
    from textual.screen import ModalScreen
    from textual.widgets import Label

    class Title(ModalScreen):
        def compose(self):
            yield Label(lesson.title, id="title")

    return Title()


@hookimpl
def register_commands():
    return [CommandEntry("count", f"{__name__}:count", "Count the variants of a lesson.")]


@hookimpl
def register_screens():
    return [ScreenEntry("tally", f"{__name__}:tally", "f9", "Tally"), ScreenEntry("title", f"{__name__}:title", "v", "Title", "configure")]
'''


@pytest.fixture(autouse=True)
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    assert run_command_line(["init", "work"]) == 0
    monkeypatch.chdir(tmp_path / "work")
    return tmp_path / "work" / "plugins" / "my_force.py"


@pytest.mark.parametrize("runs", [False, pytest.param(True, marks=pytest.mark.slow)])
async def test_a_plug_in_is_broken_told_mended_loaded_again_and_run(workspace: Path, runs: bool) -> None:
    """Its run takes longest: the machine is compiled anew."""
    workspace.write_text(FORCE.replace("return [MyForce]", "return [MyForse]"), encoding="utf-8")
    async with opened() as (app, pilot):
        await press(pilot, "f8")
        said = app.screen.query_one("#said", Static)
        assert "✗ at fault: " in str(said.content)
        assert "my_force.py:" in str(said.content)
        assert "MyForse" in str(said.content)
        workspace.write_text(FORCE, encoding="utf-8")
        await press(pilot, "r")
        assert "✗" not in str(said.content)
        assert "my_force.py: 1 plug-in OK." in str(said.content)
        await app.show_parameter("cutting_force.wear_factor")
        await pilot.pause()
        await press(pilot, "c")
        choose(app, "MyForce (plug-in)")
        await press(pilot, "enter")
        assert app.workbench.fault() == ""
        if runs:
            await run_to_end(app, pilot)
            assert app.workbench.runs[-1].record().status == "complete"


async def test_one_file_adds_a_command_and_screens(workspace: Path, capsys: pytest.CaptureFixture[str]) -> None:
    workspace.write_text(GUEST, encoding="utf-8")
    assert "\nPlug-ins:\n  count  Count the variants of a lesson.\n" in done(capsys, "--help").out
    assert done(capsys, "count", "01_contour_error").out == "6 variants\n"
    async with opened() as (app, pilot):
        await pilot.press("f9")
        await until(pilot, lambda: bool(app.screen.query("#tally")), "the screen of the plug-in")
        await until(pilot, lambda: "6 variants" in content(app, "#tally"), "what it shows")
        assert content(app, "#go-tally") == "F9 Tally"
        await pilot.press("f4")
        await pilot.press("v")
        await until(pilot, lambda: bool(app.screen.query("#title")), "the view over Configure")
        assert content(app, "#title") == setup_of(app).lesson.title


def test_commands_come_from_a_workspace_alone(workspace: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    workspace.write_text(GUEST, encoding="utf-8")
    (workspace.parents[1] / ".lathesim-workspace").unlink()
    assert run_command_line(["count", "01_contour_error"]) == 2
    assert "there is no command 'count'" in capsys.readouterr().err


def test_help_runs_no_plug_in_that_gives_no_command(workspace: Path, capsys: pytest.CaptureFixture[str]) -> None:
    workspace.write_text("raise SystemExit('run')", encoding="utf-8")
    assert done(capsys, "--help").err == ""


@pytest.mark.parametrize(
    ("before", "after", "told"),
    [
        (
            'CommandEntry("count"',
            'CommandEntry("run"',
            "there is already a 'run', from lathesim.cli.lessons.run_command. Give this one",
        ),
        (":count", ":cuont", "register_commands names 'cuont', which is not there."),
        ("CommandEntry(", "tuple((", "which is no CommandEntry."),
        ('"f9"', '"f5"', "the key f5 of the screen 'tally' is that of Run. Choose another."),
        ('"v"', '"k"', "the key k of the screen 'title' is that of Tool point. Choose another."),
    ],
)
def test_a_command_or_screen_at_fault_is_left_out_in_one_line(
    workspace: Path, before: str, after: str, told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    text = GUEST.replace(before, after)
    workspace.write_text(text.replace('lesson.")]', 'lesson."))]') if "tuple" in after else text, encoding="utf-8")
    (line,) = [line for line in refused(capsys, "plugins").err.splitlines() if "my_force" in line]
    assert line.startswith("Left out: plugins/my_force.py:")
    assert told in line


@pytest.mark.slow
async def test_a_plug_in_that_fails_while_it_runs_is_told_and_the_app_goes_on(workspace: Path) -> None:
    law = """
    @staticmethod
    def output(depth_of_cut, feed, cutting_speed, in_contact, wear_factor):
        if 1e-4 < feed < 2e-4 and in_contact > 0.5:
            return 1.0 / (in_contact - in_contact), 0.0, 0.0
        return 0.0, 0.0, 0.0
"""
    text = (
        '''
from lathesim.component import Component, Input, Output
from lathesim.hookspecs import hookimpl


class Dividing(Component):
    """Forces that cannot be computed at some feeds:  F = 1 / 0."""

    depth_of_cut = Input("m", doc="depth of cut")
    feed = Input("m", doc="feed per revolution")
    cutting_speed = Input("m/s", doc="cutting speed")
    in_contact = Input("1", doc="1 in contact")
    wear_factor = Input("1", doc="wear", default=1.0)
    cutting_force = Output("N", doc="cutting force")
    longitudinal_force = Output("N", doc="thrust")
    radial_force = Output("N", doc="radial force")
'''
        + law
        + """

@hookimpl
def register_components():
    return [Dividing]
"""
    )
    workspace.write_text(text, encoding="utf-8")
    async with opened() as (app, pilot):
        setup = app.workbench.setup
        assert setup is not None
        app.workbench.change(setup.with_part("cutting_force", "Dividing"))
        await pilot.pause()
        await pilot.press("f5")
        await pilot.pause(0.5)
        assert not app.workbench.fault()
        await until(pilot, lambda: any(run.live is not None and run.live.is_over for run in app.workbench.runs), "the end of the run")
        await pilot.pause(0.4)
        assert "Dividing" in content(app, "#result")
        await pilot.press("ctrl+z")
        await run_to_end(app, pilot)
        assert app.workbench.runs[-1].record().status == "complete"
