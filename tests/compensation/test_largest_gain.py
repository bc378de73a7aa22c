"""The largest gain of a position loop, from its frequency response, against the exact one of the z-plane."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from lathesim.cli.main import run_command_line
from lathesim.compensation.lap_response import largest_gains
from lathesim.compensation.laps import Course, course_of
from lathesim.lessons.lesson import lesson_from_text, load_lesson
from lathesim.lessons.simulate import prepare
from lathesim.plugins import load_registry

EXACT = {0: 414.2, 1: 140.5, 2: 86.40, 4: 50.15, 10: 23.52}
"""Largest velocity gain [1/s] by samples of extra delay, of an axis with a lag of 24.3 ms that is sampled every 5 ms."""


def course(tmp_path: Path, further: str = "") -> Course:
    source = load_lesson("09_learning")
    program = "part_programs/liu_landers_2004_feed_path.nc"
    (tmp_path / "part.nc").write_bytes((source.path.parent.parent / program).read_bytes())
    text = source.text.partition("variants:")[0].replace(f"program: ../{program}", "program: part.nc") + further
    return course_of(prepare(lesson_from_text(text, tmp_path / "lesson.yaml"), load_registry()), "voltage")


@pytest.mark.parametrize("late", EXACT)
def test_the_largest_gain_is_that_of_the_z_plane(late: int, tmp_path: Path) -> None:
    lap = course(tmp_path, f"insert:\n  - {{effect: TransportDelay, at: x_axis, delay: {5 * late} ms}}\n")
    x, z = largest_gains(lap)
    assert x is not None and z is not None
    assert x.gain == pytest.approx(18.78 * 0.2245, rel=1e-4)
    assert x.largest == pytest.approx(EXACT[late], rel=1e-3)
    assert z.largest == pytest.approx(EXACT[0], rel=1e-3)
    assert [loop.largest for loop in largest_gains(lap, late=False) if loop] == pytest.approx([EXACT[0]] * 2, rel=1e-3)


@pytest.mark.parametrize(("share", "grows"), [(0.99, False), (1.01, True)])
def test_the_loop_swings_up_just_above_it(share: float, grows: bool, tmp_path: Path) -> None:
    gain = share * EXACT[4] / 18.78
    further = "insert:\n  - {effect: TransportDelay, at: x_axis, delay: 20 ms}\n"
    lap = course(tmp_path, further)
    pulse = np.zeros((2, lap.samples))
    pulse[0, 8] = 1e-3
    values = {**{name: value for name, value in lap.exact().items() if not name.endswith("delay")}, "x_controller.proportional": 1e3 * gain}
    after = lap.lap(pulse, values).errors[0] - lap.lap(0.0 * pulse, values).errors[0]
    early, end = (float(np.max(np.abs(part))) for part in (after[100:200], after[-100:]))
    assert (end > early) is grows


def test_friction_does_not_act_in_the_measurement(tmp_path: Path) -> None:
    x, _ = largest_gains(course(tmp_path, "insert:\n  - {effect: CoulombFriction, at: x_axis, level: 100 N, inertia: 9720 kg}\n"))
    assert x is not None
    assert x.largest == pytest.approx(EXACT[0], rel=1e-3)


def test_an_answer_that_does_not_die_out_gives_no_gain(tmp_path: Path) -> None:
    slow = course(tmp_path).samples
    lap = course(tmp_path, "duration: 0.5 s\n")
    assert lap.samples < slow
    assert largest_gains(lap) == (None, None)


@pytest.mark.slow
def test_remedy_tells_the_largest_gain_of_a_late_loop(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    delay = {"value": 1e-3, "unit": "s", "low": 0.98e-3, "high": 1.02e-3}
    named: dict[str, object] = {
        "effect": "TransportDelay",
        "at": "x_dac",
        "family": "lag",
        "probability": 0.99,
        "parameters": {"delay": delay},
        "tied_with": [],
    }
    insert = [{"effect": "TransportDelay", "at": "x_dac", "delay": "1 ms"}]
    found = {"schema": "lathesim-diagnosis/1", "verdict": "named", "effects": [named], "insert": insert, "baseline": {}, "adequate": True}
    (tmp_path / "diagnosis.json").write_text(json.dumps(found), encoding="utf-8")
    lesson = "22_what_is_wrong_with_this_machine"
    assert run_command_line(["remedy", lesson, str(tmp_path / "diagnosis.json"), "--out", str(tmp_path / "out")]) == 0
    assert "x_controller: the loop gain is" in capsys.readouterr().out
    (told,) = json.loads((tmp_path / "out" / "remedy.json").read_text())["loop_gains_per_s"]
    assert told["gain"] < told["largest"] < told["largest_without_effect"]
