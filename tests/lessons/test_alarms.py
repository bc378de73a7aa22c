"""Alarms: a run-away axis stops the run with a sentence of its own, and no hint advises more of what makes the loop unstable."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lathesim.analysis.failed_run import unstable_loop
from lathesim.errors import LatheSimError, SimulationError
from lathesim.lessons.alarms import AlarmWatch
from lathesim.lessons.grading import UNFINISHED, grade, yardstick
from lathesim.lessons.kept_run import run_and_keep
from lathesim.lessons.lesson import Lesson, lesson_from_text, load_lesson
from lathesim.lessons.simulate import prepare, simulate
from lathesim.lessons.sweep_runs import Members
from lathesim.plugins import Registry
from lathesim.record import Channel, FloatArray, Record
from tests.lessons.small_machine import write_lesson

HINT = "Raise the gain."
HEAD = "lesson: L\nmachine: two_axis_lathe\nprogram: one_pass.nc\nengine: plain\n"


def lesson(text: str) -> Lesson:
    return lesson_from_text(f"{HEAD}{text}\n", Path("mine.yaml"))


@pytest.mark.parametrize(
    ("text", "alarm"),
    [
        (
            "set: {x_controller.proportional: -3 V/mm}",
            "the following error of x_controller is 100.1 mm at 0.49 s, above the limit of 100 mm; the loop is unstable: "
            "the proportional gain -3 V/mm of x_controller has the wrong sign.",
        ),
        ("set: {z_controller.integral: -4 V/(mm*s)}", "the integral gain -4000 V/(m*s) of z_controller has the wrong sign."),
        (
            "set: {x_controller.proportional: 30 V/mm, x_dac.bits: 32, x_dac.smallest_voltage: -1 MV, x_dac.largest_voltage: 1 MV}",
            "the loop is unstable: what x_controller drives swings further and further; "
            "lower the proportional gain 30 V/mm of x_controller.",
        ),
        (
            "alarms: {z_controller.error: 5 mm}",
            "the following error of z_controller is 5.053 mm at 0.09 s, above the limit of 5 mm; slow the axis down, or widen the alarm "
            "z_controller.error.",
        ),
        (
            "alarms: {x_axis.position: 0..10 mm}",
            "the position of x_axis is 10.14 mm at 0.325 s, outside 0 mm to 10 mm; slow the axis down, ",
        ),
    ],
)
def test_an_axis_outside_its_limits_stops_the_run_with_an_alarm(text: str, alarm: str, registry: Registry) -> None:
    with pytest.raises(SimulationError) as caught:
        simulate(lesson(text), registry)
    assert alarm in caught.value.fact
    assert "program" not in caught.value.message
    assert isinstance(caught.value.record, Record)
    assert caught.value.record.status == f"failed: {caught.value.fact}"


def test_an_alarm_of_an_axis_that_follows_a_spindle_names_the_loop_of_the_spindle(registry: Registry) -> None:
    with pytest.raises(SimulationError) as caught:
        simulate(load_lesson("05_spindle_droop"), registry, "PI", {"spindle_controller.proportional": "-1 V*s/rad"}, engine="plain")
    assert "the following error of x_controller is 101.2 mm" in caught.value.fact
    assert "the loop is unstable: the proportional gain -1 V*s/rad of spindle_controller has the wrong sign." in caught.value.fact


def test_an_axis_that_does_not_stand_where_the_program_starts_comes_there_without_an_alarm(registry: Registry) -> None:
    record = simulate(lesson("start_point: {x: 0.15 m, z: 0.15 m}\nduration: 3 s"), registry)
    assert record["x_controller.error"][0] > 0.1
    assert record["x_controller.error"][-1] < 0.1


def test_no_hint_advises_a_higher_gain_where_the_loop_is_unstable(registry: Registry, tmp_path: Path) -> None:
    goals = f"goals: [{{metric: max_x_following_error, at_most: 1 mm, hint: {HINT}}}]"
    runaway = lesson(f"set: {{x_controller.proportional: -3 V/mm}}\n{goals}")
    kept = run_and_keep(prepare(runaway, registry), registry, tmp_path / "a.h5")
    assert kept.failure.startswith("the following error of x_controller")
    assert not kept.nothing_cut
    assert [goal.hint for goal in kept.goals] == ["The loop is unstable, see the alarm: correct that first."]
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
    assert found.hints == ("The loop is unstable, see the alarm: correct that first.",)


def test_a_sweep_tells_the_alarm_of_the_values_it_tries(registry: Registry) -> None:
    members = Members(prepare(lesson(""), registry), ("x_controller.proportional",), {"cycle_time": registry.metric("cycle_time")})
    assert members.run(0, [300.0]).status == "complete"
    stopped = members.run(1, [-300.0])
    assert np.isnan(stopped.metrics).all()
    assert stopped.status.startswith("stopped: the following error of x_controller")
    assert "gain -300 V/m of x_controller has the wrong sign" in stopped.status


TURRET = """\
machine: A turret
sample_period: 5 ms
step: 1 ms
alarms: {turret.position: -90..90 mm, regulator_of_turret.error: 80 mm}
parts:
  glass: {component: LinearEncoder}
  servo: {component: PositionController}
  regulator_of_turret: {component: PositionController}
  scale: {component: LinearEncoder}
  turret: {component: EmpiricalAxis}
  bed: {component: EmpiricalAxis}
wires:
  servo.reference: 50 mm
  servo.measured: glass.position
  bed.voltage: servo.voltage
  glass.measured: bed.position
  regulator_of_turret.reference: 1 mm
  regulator_of_turret.measured: scale.position
  turret.voltage: regulator_of_turret.voltage
  scale.measured: turret.position
"""
"""Two axes whose parts have other names; the one without an alarm may have any gain."""


@pytest.mark.parametrize(
    ("gains", "alarm"),
    [
        (
            "servo.proportional: -9 V/mm, regulator_of_turret.proportional: -3 V/mm",
            "the following error of regulator_of_turret is 80.85 mm at 0.475 s, above the limit of 80 mm; the loop is unstable: the "
            "proportional gain -3 V/mm of regulator_of_turret has the wrong sign.",
        ),
        (
            "regulator_of_turret.proportional: 30 V/mm, regulator_of_turret.smallest_voltage: -1 MV, "
            "regulator_of_turret.largest_voltage: 1 MV",
            "the loop is unstable: what regulator_of_turret drives swings further and further; "
            "lower the proportional gain 30 V/mm of regulator_of_turret.",
        ),
    ],
)
def test_an_alarm_follows_the_wires_to_the_loop_of_its_axis(gains: str, alarm: str, registry: Registry, tmp_path: Path) -> None:
    machine = load_lesson(write_lesson(tmp_path, f"duration: 5 s\nset: {{{gains}}}\n", machine=TURRET, head="lesson: L\nmachine: small\n"))
    with pytest.raises(SimulationError) as caught:
        simulate(machine, registry)
    assert alarm in caught.value.fact


def test_a_hint_of_another_machine_follows_its_wires(registry: Registry, tmp_path: Path) -> None:
    text = "duration: 3 s\nset: {servo.proportional: 50 V/mm, regulator_of_turret.proportional: 0.1 V/mm}\n"
    record = simulate(load_lesson(write_lesson(tmp_path, text, machine=TURRET, head="lesson: L\nmachine: small\n")), registry)
    assert unstable_loop(record) == "The loop of servo is unstable, its voltage goes from limit to limit: lower its gains first."


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


TIME = np.arange(4000) * 5e-3


@pytest.mark.parametrize(
    "command",
    [
        np.where(np.arange(4000) < 100, 10.0, np.where(np.arange(4000) % 2, 0.078, -0.078)),
        np.where(np.arange(4000) // 2 % 2, 0.002, -0.002),
        3.0 * np.sin(2.0 * np.pi * 5.0 * TIME),
        np.zeros(4000),
    ],
    ids=["steps after a rapid move", "an axis that stands", "a command that swings", "none"],
)
def test_a_loop_that_holds_is_not_called_unstable(command: FloatArray) -> None:
    channels = {"servo.command": Channel("servo.command", "V", command)}
    record = Record(TIME, channels, {"sample_period": 5e-3, "status": "complete", "loop_commands": "servo.command"})
    assert unstable_loop(record) == ""


@pytest.mark.parametrize(("swings", "unstable"), [(5, True), (4, True), (3, False)])
def test_four_whole_swings_that_grow_make_a_loop_unstable(swings: int, unstable: bool, registry: Registry) -> None:
    """The swing in which the limit is met has not reached its height, so it does not count."""
    prepared = prepare(lesson(""), registry)
    sizes = 0.1 * 1.5 ** np.arange(-swings, 1.0)
    error = np.concatenate([(-1.0) ** place * size * np.sin(np.linspace(0.01, 3.1, 30)) for place, size in enumerate(sizes)])
    values = np.zeros((len(prepared.plan.channels), len(error)))
    values[prepared.plan.channels.index("x_controller.error")] = 1.001 * error
    found = AlarmWatch(prepared.plan, prepared.alarms).look(0, values)
    assert found is not None
    assert ("swings further and further" in found[1]) == unstable
