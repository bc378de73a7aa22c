"""A plug-in writer breaks a law, reads the message, mends it, loads it again and runs it."""

from __future__ import annotations

from pathlib import Path

import pytest
from textual.widgets import OptionList, Static

from lathesim.cli.main import run_command_line
from tests.tui.driving import opened, run_to_end, until

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


@pytest.fixture(autouse=True)
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    assert run_command_line(["init", "work"]) == 0
    monkeypatch.chdir(tmp_path / "work")
    return tmp_path / "work" / "plugins" / "my_force.py"


@pytest.mark.parametrize("runs", [False, pytest.param(True, marks=pytest.mark.slow)])
async def test_a_plug_in_is_broken_told_mended_loaded_again_and_run(workspace: Path, runs: bool) -> None:
    """Its run takes longest: the machine is compiled anew."""
    workspace.write_text(FORCE.replace("return [MyForce]", "return [MyForse]"), encoding="utf-8")
    async with opened() as (app, pilot):
        await pilot.press("f8")
        await pilot.pause()
        said = app.screen.query_one("#said", Static)
        assert "✗ at fault: " in str(said.content)
        assert "my_force.py:" in str(said.content)
        assert "MyForse" in str(said.content)
        workspace.write_text(FORCE, encoding="utf-8")
        await pilot.press("r")
        await pilot.pause()
        assert "✗" not in str(said.content)
        assert "my_force.py: 1 plug-in in order." in str(said.content)
        await app.show_parameter("cutting_force.wear_factor")
        await pilot.pause()
        await pilot.press("c")
        await pilot.pause()
        found = app.screen.query_one(OptionList)
        names = [str(found.get_option_at_index(place).prompt).strip("> ") for place in range(found.option_count)]
        assert "MyForce (plug-in)" in names
        found.highlighted = names.index("MyForce (plug-in)")
        await pilot.press("enter")
        await pilot.pause()
        assert app.workbench.fault() == ""
        if runs:
            await run_to_end(app, pilot)
            assert app.workbench.runs[-1].record().status == "complete"


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
        assert "Dividing" in str(app.screen.query_one("#result", Static).content)
        await pilot.press("ctrl+z")
        await run_to_end(app, pilot)
        assert app.workbench.runs[-1].record().status == "complete"
