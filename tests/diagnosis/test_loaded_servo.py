"""A hobby servo that carries a load: its loop is closed, and only its command and its angle were recorded."""

from pathlib import Path

import numpy as np
import pytest

from lathesim.diagnosis.diagnose import ask, diagnose
from lathesim.effects.lag import MotorInductance
from lathesim.identification.replay.loading import load_case
from lathesim.lessons.lesson import load_lesson
from lathesim.plugins import load_registry
from tests.diagnosis.asking import answer_in

LESSON = """
lesson: A servo whose load was left out
machine: rotary_axis
sample_period: 20 ms
step: 1 ms
set:
  encoder.resolution: 1.534e-3 rad
  controller.proportional: 40 V/rad
  controller.derivative_gain: 0 V*s/rad
  dac.bits: 24
  dac.smallest_voltage: -6.8 V
  dac.largest_voltage: 6.8 V
  drive.conductance: 0.424 A/V
  drive.back_emf: 0.85 V*s/rad
  drive.effort_constant: 0.85 N*m/A
  axis.inertia: 0.006 kg*m^2
  axis.viscous: 0 N*m*s/rad
  axis.gravity: 0 N*m
recordings:
  time: {column: t, unit: s}
  drive: {controller.reference: {column: command, unit: rad, held: true}}
  compare: {encoder.angle: {column: angle, unit: rad}}
uncertain: {axis.inertia: 50 %, drive.back_emf: 30 %, controller.proportional: 100 %}
"""
GAIN, BACK_EMF, INERTIA = 12.0, 1.35, 0.015
PERIOD, FINE = 0.02, 40


def write_log(file: Path, commands: np.ndarray, load: float, late: int = 0) -> None:
    """Write how a servo of proportional gain and 6.8 V follows commands that are held for 20 ms each, with a load [N*m]; each acts so many
    samples ``late``."""
    angle, speed, step, rows = 0.0, 0.0, PERIOD / FINE, []
    for sample, command in enumerate(commands):
        wanted = commands[max(sample - late, 0)]
        rows.append((PERIOD * sample, command, round(angle / 1.534e-3) * 1.534e-3))
        voltage = float(np.clip(GAIN * (wanted - angle), -6.8, 6.8))
        for _ in range(FINE):
            speed += step * (0.85 * 0.424 * (voltage - BACK_EMF * speed) - load) / INERTIA
            angle += step * speed
    np.savetxt(file, rows, delimiter=",", header="t,command,angle", comments="")


def write_case(folder: Path, loads: tuple[float, float], late: int = 0) -> None:
    """Write the lesson and two recordings, a sweep and steps, each with a load [N*m], of a servo that may be ``late``."""
    time = PERIOD * np.arange(150.0)
    write_log(folder / "log.csv", 0.8 * np.sin(2.0 * np.pi * (0.5 + 0.4 * time) * time), loads[0], late)
    write_log(folder / "other.csv", np.repeat(np.random.default_rng(3).choice([-0.55, 0.55], 15), 10), loads[1], late)
    (folder / "lesson.yaml").write_text(LESSON, encoding="utf-8")


def test_a_load_is_named_with_its_size_and_the_values_beside_it(tmp_path: Path) -> None:
    write_case(tmp_path, (0.42, 0.42))
    tried = ("ForceOffset", "CoulombFriction", "ChannelTimeShift", "MotorInductance")
    answer = answer_in(tmp_path, *(word for name in tried for word in ("--effect", name)))
    (load,) = answer["effects"]
    assert load["effect"] == "ForceOffset"
    assert load["parameters"]["offset"]["value"] == pytest.approx(0.42, rel=0.1)
    assert answer["fit"]["encoder.angle"]["after"] < 0.1 * answer["fit"]["encoder.angle"]["before"]
    # a loop holds the motion whatever the values are: the second recording judges, and is not fitted too
    assert any("validated on other.csv" in line for line in answer["summary"])


def test_a_limit_that_the_second_recording_stays_below_is_not_said_to_predict_worse(tmp_path: Path) -> None:
    """Small steps never ask for 6.8 V, so that they say nothing of what a sweep shows plainly."""
    write_case(tmp_path, (0.0, 0.0))
    write_log(tmp_path / "other.csv", np.repeat(np.random.default_rng(3).choice([-0.1, 0.1], 15), 10), 0.0)
    (tmp_path / "lesson.yaml").write_text(LESSON.replace("6.8 V", "100 V"), encoding="utf-8")
    answer = answer_in(tmp_path, "--effect", "DriveSaturation", "--effect", "DriveGainError")
    (limit,) = (one for one in answer["explanations"] if one["name"] == "DriveSaturation")
    assert limit["reason"] == "is never reached in the recording that judges, which cannot validate it"
    said = "DriveSaturation at drive fits log.csv clearly better, but other.csv never reaches it and cannot validate it."
    assert answer["summary"][0].endswith(said)
    assert "Validate with a recording that reaches DriveSaturation at drive, as log.csv does." in answer["summary"][-1]


def test_a_loop_that_follows_its_command_may_hide_a_load(tmp_path: Path) -> None:
    """The lesson alone follows the command within half of its spread, whatever is missing."""
    write_case(tmp_path, (0.3, 0.3), late=2)
    tried = ("ForceOffset", "CoulombFriction", "ChannelTimeShift", "TransportDelay")
    answer = answer_in(tmp_path, *(word for name in tried for word in ("--effect", name)))
    assert "ForceOffset" in [one["effect"] for one in answer["effects"]]
    assert answer["fit"]["encoder.angle"]["after"] < 0.3 * answer["fit"]["encoder.angle"]["before"]


def test_a_closed_loop_that_does_not_follow_as_recorded_is_fitted_by_the_error_of_its_simulation(tmp_path: Path) -> None:
    """Forces a fifth as large as those that act, which nobody measured, move a free body that far; a loop holds against them."""
    write_case(tmp_path, (0.2, 0.7))
    case = load_case(load_lesson(tmp_path / "lesson.yaml"), [tmp_path / "log.csv", tmp_path / "other.csv"], load_registry())
    lines: list[str] = []
    diagnose(ask("servo", case.machine, case.recordings, (MotorInductance,)), lines.append)
    assert any("the error of the simulation" in line for line in lines)
