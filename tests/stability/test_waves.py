"""The waves on the part: in the record, as roughness, as a figure and in the lathe view."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from lathesim.analysis.metric import MissingChannelError, NoValueError
from lathesim.analysis.turned_part import wave_roughness, waves_figure, waves_on_part
from lathesim.engine.run import run
from lathesim.record import Record
from lathesim.stability.lobes import rig
from lathesim.stability.tool_point import Mode, ToolPoint
from lathesim.tui.drawing.canvas import draw_waves
from lathesim.tui.drawing.lathe_picture import scene_of_record
from tests.tui.driving import opened, run_to_end, until
from tests.tui.screen_words import words_of

TOOL = ToolPoint((Mode(75.0, 0.02, 8e6),), (1.0,))


@pytest.fixture(scope="module")
def cut() -> Record:
    made = rig(TOOL, 6e8, 2500.0, values={"always_in_contact": 0.0, "feed": 1e-4}, record=("cut.wave", "spindle.angle"))
    changed = {"mode_1.swing": 1e-4, "cut.width": 1.1 * 0.6015e-3}
    return run(made.plan, duration=60 * 60.0 / 2500.0, engine="compiled", overrides=changed)


def test_the_wave_of_a_turn_is_what_the_tool_left_a_turn_before(cut: Record) -> None:
    waves = waves_on_part(cut)
    assert waves.height.shape[0] == 3
    turned, tool = cut["spindle.angle"], cut["mode_1.displacement"]
    latest = turned[-1] - np.mod(turned[-1] - waves.angle, 2.0 * math.pi)
    left = np.interp(latest - 2.0 * math.pi, turned, tool)
    # where the tool was in the cut a turn before, it left its own place behind
    assert np.mean(np.abs(waves.height[-1] - left) < 1e-6) > 0.5
    assert 5e-6 < waves.roughness == wave_roughness(cut)


def test_earlier_waves_are_smaller_and_a_part_that_has_not_turned_has_none(cut: Record) -> None:
    sample = int(np.searchsorted(cut["spindle.angle"], 4.0 * math.pi))
    assert waves_on_part(cut, sample).roughness < 0.9 * wave_roughness(cut)
    with pytest.raises(NoValueError, match="has not turned once"):
        waves_on_part(cut, 10)


def test_the_waves_are_drawn(cut: Record, tmp_path: Path) -> None:
    waves_figure(cut).savefig(tmp_path / "w.png")
    scene = scene_of_record(cut)
    assert scene.is_empty
    assert scene.record is cut
    picture = draw_waves(waves_on_part(cut), 60, 20)
    assert f"R_a {1e6 * wave_roughness(cut):.3g} µm" in picture.as_text()


def test_a_record_without_a_cut_in_the_loop_has_no_waves() -> None:
    made = rig(TOOL, 6e8, 2500.0)
    other = run(made.plan, duration=0.1, engine="compiled")
    with pytest.raises(MissingChannelError):
        waves_on_part(other)


async def test_the_app_shows_the_waves_in_the_lathe_view_and_as_the_surface() -> None:
    async with opened("17_waves_on_the_part") as (app, pilot):
        await run_to_end(app, pilot)
        await until(pilot, lambda: "End of the part" in words_of(app.export_screenshot()), "the end of the part")
        assert "R_a" in words_of(app.export_screenshot())
        await pilot.press("f3")
        await pilot.pause()
        await pilot.press("u")
        await until(pilot, lambda: "angle of the part" in words_of(app.export_screenshot()), "the waves")
