"""A motor on one step of voltage: the speed at which it settles is a sum of dry and viscous friction, and a second step parts them."""

import math
from pathlib import Path

import numpy as np
import pytest

from lathesim.diagnosis.diagnose import ask, diagnose
from lathesim.effects.friction import CoulombFriction
from lathesim.identification.replay.loading import load_case
from lathesim.lessons.lesson import load_lesson
from lathesim.plugins import load_registry
from tests.diagnosis.asking import answer_in

LESSON = """
lesson: A small motor on an amplifier
machine: torque_spindle
sample_period: 4 ms
step: 1 ms
set: {spindle.inertia: 3e-5 kg*m^2, spindle.viscous: 5.5e-4 N*m*s/rad}
recordings:
  time: {column: t, unit: s}
  drive: {spindle.torque: {column: torque, unit: N*m, held: HELD}}
  compare: {spindle.speed: {column: speed, unit: rad/s}}
uncertain: {spindle.inertia: 30 %, spindle.viscous: 30 %}
"""
INERTIA, VISCOUS, FRICTION, PERIOD, FINE = 3.1e-5, 4e-4, 12e-3, 4e-3, 40


def write_log(file: Path, torque: float, seed: int) -> None:
    """Write 1 s of a motor that one step of torque [N m] turns."""
    rng = np.random.default_rng(seed)
    speed, step, rows = 0.0, PERIOD / FINE, []
    for sample in range(250):
        pull = torque if sample >= 25 else 0.0
        rows.append((sample * PERIOD, pull, speed + 0.3 * rng.standard_normal()))
        for _ in range(FINE):
            left = pull - VISCOUS * speed
            speed = (
                0.0 if speed == 0.0 and abs(left) < FRICTION else speed + step * (left - math.copysign(FRICTION, speed or left)) / INERTIA
            )
    np.savetxt(file, rows, delimiter=",", header="t,torque,speed", comments="")


@pytest.mark.parametrize("held", ["true", "false"])
def test_dry_friction_that_two_steps_determine_together_is_named(held: str, tmp_path: Path) -> None:
    # a torque that is interpolated between rows comes half a row early, so that no values explain even one step wholly
    (tmp_path / "lesson.yaml").write_text(LESSON.replace("HELD", held), encoding="utf-8")
    write_log(tmp_path / "log.csv", 0.12, 1)
    write_log(tmp_path / "other.csv", 0.06, 2)
    answer = answer_in(tmp_path, "--effect", "CoulombFriction")
    (effect,) = answer["effects"]
    assert effect["effect"] == "CoulombFriction"
    assert effect["parameters"]["level"]["value"] == pytest.approx(FRICTION, rel=0.03)
    assert answer["baseline"]["spindle.viscous"]["refit_with"] == pytest.approx(VISCOUS, rel=0.03)
    assert any("log.csv and other.csv were fitted together" in line for line in answer["summary"])
    assert any("RMS error of the whole simulation on log.csv and other.csv (" in line for line in answer["summary"])


def write_turns(file: Path, torques: tuple[float, float], seed: int) -> None:
    """Write 1 s of the angle, in steps of 2 mrad, of a motor that turns at one torque [N m] and then at another one."""
    turned = np.random.default_rng(seed).uniform(0.0, 2e-3)
    speed, rows = max(0.0, torques[0] - FRICTION) / VISCOUS, []
    for sample in range(250):
        pull = torques[sample >= 25]
        rows.append((sample * PERIOD, pull, 2e-3 * round(turned / 2e-3)))
        for _ in range(FINE):
            speed = max(0.0, speed + PERIOD / FINE * (pull - VISCOUS * speed - FRICTION) / INERTIA)
            turned += PERIOD / FINE * speed
    np.savetxt(file, rows, delimiter=",", header="t,torque,angle", comments="")


def test_values_that_lead_the_simulation_of_the_second_recording_astray_are_fitted_to_both(tmp_path: Path) -> None:
    """A start from rest looks like more viscous friction and more inertia, with which the second recording is simulated worse than without
    any fit."""
    lesson = LESSON.replace("HELD", "true").replace(
        "spindle.speed: {column: speed, unit: rad/s}", "spindle_encoder.angle: {column: angle, unit: rad}"
    )
    lesson = lesson.replace("inertia: 30 %, spindle.viscous: 30 %", "inertia: 200 %, spindle.viscous: 100 %")
    (tmp_path / "lesson.yaml").write_text(lesson, encoding="utf-8")
    write_turns(tmp_path / "log.csv", (0.0, 0.03), 1)
    write_turns(tmp_path / "other.csv", (0.06, 0.03), 2)
    answer = answer_in(tmp_path, "--effect", "CoulombFriction")
    (effect,) = answer["effects"]
    assert effect["parameters"]["level"]["value"] == pytest.approx(FRICTION, rel=0.01)
    assert answer["baseline"]["spindle.viscous"]["refit_with"] == pytest.approx(VISCOUS, rel=0.01)
    # it rests before the first step alone
    assert not any("stands still in" in line for line in answer["left"])


def test_no_line_of_a_figure_leads_from_one_recording_to_the_next(tmp_path: Path) -> None:
    """It would be a jump of the machine that nobody recorded."""
    (tmp_path / "lesson.yaml").write_text(LESSON.replace("HELD", "true"), encoding="utf-8")
    files = [tmp_path / "log.csv", tmp_path / "other.csv"]
    for seed, (file, size) in enumerate(zip(files, (0.12, 0.06), strict=True), 1):
        write_log(file, size, seed)
    case = load_case(load_lesson(tmp_path / "lesson.yaml"), files, load_registry())
    answer = diagnose(ask("steps", case.machine, case.recordings, (CoulombFriction,)))
    assert answer.question.together
    drawn = [(one.time, one.recorded, one.before, one.after) for one in answer.evidence.traces]
    drawn += [(one.time, one.total, one.before, one.after) for one in answer.evidence.missing]
    assert len(drawn) == 2
    for time, *lines in drawn:
        assert [np.flatnonzero(np.isnan(line)).tolist() for line in lines] == [[len(time) // 2]] * 3
