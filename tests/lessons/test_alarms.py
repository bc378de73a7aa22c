"""Alarms: a run-away axis stops the run with a sentence of its own, and no hint advises more of what makes the loop unstable."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lathesim.analysis.metrics.unstable_loop import unstable_loop
from lathesim.errors import LatheSimError, SimulationError
from lathesim.lessons.grading import UNFINISHED, grade, yardstick
from lathesim.lessons.kept_run import run_and_keep
from lathesim.lessons.lesson import Lesson, lesson_from_text, load_lesson
from lathesim.lessons.simulate import prepare, simulate
from lathesim.lessons.sweeping.members import Members
from lathesim.plugins import Registry, load_registry
from lathesim.record import Channel, Record

HINT = "Raise the gain."
HEAD = "lesson: L\nmachine: two_axis_lathe\nprogram: one_pass.nc\nengine: plain\n"


@pytest.fixture(scope="module")
def registry() -> Registry:
    return load_registry(installed=False)


def lesson(text: str) -> Lesson:
    return lesson_from_text(f"{HEAD}{text}\n", Path("mine.yaml"))


@pytest.mark.parametrize(
    ("text", "alarm"),
    [
        (
            "set: {x_controller.proportional: -3 V/mm}",
            "X following error 100.1 mm exceeds the limit of 100 mm at 0.49 s; the loop is unstable: "
            "the proportional gain -3 V/mm of x_controller has the wrong sign.",
        ),
        ("set: {z_controller.integral: -4 V/(mm*s)}", "the integral gain -4000 V/(m*s) of z_controller has the wrong sign."),
        (
            "set: {x_controller.proportional: 30 V/mm, x_dac.bits: 32, x_dac.smallest_voltage: -1 MV, x_dac.largest_voltage: 1 MV}",
            "the loop is unstable: the axis swings further and further; lower the proportional gain 30 V/mm of x_controller.",
        ),
        (
            "alarms: {z_controller.error: 5 mm}",
            "Z following error 5.053 mm exceeds the limit of 5 mm at 0.09 s; slow the axis down, or widen the alarm z_controller.error.",
        ),
        ("alarms: {x_axis.position: 0..10 mm}", "X position 10.14 mm is outside 0 mm to 10 mm at 0.325 s; slow the axis down, "),
    ],
)
def test_an_axis_outside_its_limits_stops_the_run_with_an_alarm(text: str, alarm: str, registry: Registry) -> None:
    with pytest.raises(SimulationError) as caught:
        simulate(lesson(text), registry)
    assert alarm in caught.value.fact
    assert "program" not in caught.value.message
    assert isinstance(caught.value.record, Record)
    assert caught.value.record.status == f"failed: {caught.value.fact}"


def test_an_axis_that_does_not_stand_where_the_program_starts_comes_there_without_an_alarm(registry: Registry) -> None:
    record = simulate(lesson("start_point: {x: 0.15 m, z: 0.15 m}\nduration: 3 s"), registry)
    assert record["x_controller.error"][0] > 0.1
    assert record["x_controller.error"][-1] < 0.1


def test_no_hint_advises_a_higher_gain_where_the_loop_is_unstable(registry: Registry, tmp_path: Path) -> None:
    goals = f"goals: [{{metric: max_x_following_error, at_most: 1 mm, hint: {HINT}}}]"
    runaway = lesson(f"set: {{x_controller.proportional: -3 V/mm}}\n{goals}")
    kept = run_and_keep(prepare(runaway, registry), registry, tmp_path / "a.h5")
    assert kept.failure.startswith("X following error")
    assert not kept.nothing_cut
    assert [goal.hint for goal in kept.goals] == ["The loop is unstable, see the alarm: mend that first."]
    stiff = lesson(f"duration: 1 s\nset: {{x_controller.proportional: 50 V/mm}}\n{goals}")
    swinging = run_and_keep(prepare(stiff, registry), registry, tmp_path / "b.h5")
    assert [goal.hint for goal in swinging.goals] == [
        "The loop of x_controller is unstable, its voltage goes from limit to limit: lower its gains first."
    ]
    soft = run_and_keep(prepare(lesson(f"duration: 1 s\n{goals}"), registry), registry, tmp_path / "c.h5")
    assert [goal.hint for goal in soft.goals] == [HINT]


def test_grade_tells_the_alarm_and_not_the_hint(registry: Registry) -> None:
    with pytest.raises(SimulationError) as caught:
        simulate(load_lesson("01_contour_error"), registry, "I", {"x_controller.proportional": "-3 V/mm"}, engine="plain")
    assert isinstance(caught.value.record, Record)
    found = grade(caught.value.record, "a.h5", yardstick("01_contour_error", registry), registry)
    assert found.result == UNFINISHED
    assert found.hints == ("The loop is unstable, see the alarm: mend that first.",)


def test_a_sweep_tells_the_alarm_of_the_values_it_tries(registry: Registry) -> None:
    members = Members(prepare(lesson(""), registry), ("x_controller.proportional",), {"cycle_time": registry.metric("cycle_time")})
    assert members.run(0, [300.0]).status == "complete"
    stopped = members.run(1, [-300.0])
    assert np.isnan(stopped.metrics).all()
    assert stopped.status.startswith("stopped: X following error")
    assert "gain -300 V/m of x_controller has the wrong sign" in stopped.status


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("alarms: {x_controller.eror: 5 mm}", "mine.yaml:5:10: x_controller has no output 'eror'. Did you mean 'error'?"),
        ("alarms: {x_axis.position: 5 V}", "mine.yaml:5:27: '5 V' is given in V, but m is wanted. Use a unit like m."),
        ("alarms: {x_axis.position: 5..1 mm}", "mine.yaml:5:27: the alarm leaves x_axis.position no room."),
    ],
)
def test_an_alarm_at_fault_is_refused_where_it_stands(text: str, fault: str, registry: Registry) -> None:
    with pytest.raises(LatheSimError) as caught:
        prepare(lesson(text), registry)
    assert str(caught.value).startswith(fault)


def test_a_quantised_loop_that_holds_is_not_called_unstable() -> None:
    time = np.arange(2000) * 5e-3
    step = np.where(np.arange(2000) % 2, 0.078, -0.078)
    step[:100] = 10.0
    record = Record(
        time, {"x_controller.voltage": Channel("x_controller.voltage", "V", step)}, {"sample_period": 5e-3, "status": "complete"}
    )
    assert unstable_loop(record) == ""
