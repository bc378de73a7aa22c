"""A motor with dry friction whose torque is logged late: its angle seems early, and a resonance does a little of what both do."""

from pathlib import Path

import numpy as np
import pytest

from tests.diagnosis.asking import answer_in

LESSON = """
lesson: A motor whose torque is logged late
machine: torque_spindle
sample_period: 2 ms
step: 0.5 ms
set: {spindle.inertia: 0.004 kg*m^2, spindle.viscous: 0.02 N*m*s/rad, spindle_encoder.resolution: 0.001 rad}
recordings:
  time: {column: t, unit: s}
  drive: {spindle.torque: {column: torque, unit: N*m}}
  compare: {spindle_encoder.angle: {column: angle, unit: rad}}
uncertain: {spindle.inertia: 10 %, spindle.viscous: 30 %}
"""
INERTIA, VISCOUS, FRICTION, LATE, PERIOD, FINE = 4e-3, 0.02, 0.08, 8, 2e-3, 20


def write_log(file: Path, seed: int, late: int = LATE) -> None:
    """Write 4 s of a motor under swept torques, held over each row, whose log shows each torque some samples after it acted."""
    time = PERIOD * np.arange(2000)
    torque = 0.9 * np.sin(2.0 * np.pi * (0.5 + 0.3 * time) * time + seed) + 0.5 * np.sin(2.0 * np.pi * 1.7 * time)
    angle, speed, step, angles = 0.0, 0.0, PERIOD / FINE, []
    for pull in torque:
        angles.append(round(angle / 1e-3) * 1e-3)
        for _ in range(FINE):
            speed += step * (pull - VISCOUS * speed - FRICTION * np.tanh(speed / 0.01)) / INERTIA
            angle += step * speed
    logged = np.concatenate([np.full(late, torque[0]), torque[: len(time) - late]]) + 3e-3 * np.random.default_rng(seed).standard_normal(
        len(time)
    )
    np.savetxt(file, np.column_stack([time, logged, angles]), delimiter=",", header="t,torque,angle", comments="")


def test_two_effects_are_found_where_a_third_one_leaves_less_than_either(tmp_path: Path) -> None:
    (tmp_path / "lesson.yaml").write_text(LESSON, encoding="utf-8")
    for seed, name in enumerate(("log.csv", "other.csv"), 1):
        write_log(tmp_path / name, seed)
    tried = ("AxialResonance", "ChannelTimeShift", "CoulombFriction")
    answer = answer_in(tmp_path, *(word for name in tried for word in ("--effect", name)))
    sizes = {effect["effect"]: next(iter(effect["parameters"].values())) for effect in answer["effects"]}
    # what is held until the next row acts half a row later than what is interpolated
    truth = {"CoulombFriction": FRICTION, "ChannelTimeShift": -(LATE - 0.5) * PERIOD}
    assert sizes.keys() == truth.keys()
    for name, value in truth.items():
        assert sizes[name]["low"] < value < sizes[name]["high"]
        assert sizes[name]["value"] == pytest.approx(value, rel=0.05)
    assert answer["fit"]["spindle_encoder.angle"]["after"] < 0.05 * answer["fit"]["spindle_encoder.angle"]["before"]


def test_a_command_that_was_held_has_no_lag_though_the_lesson_does_not_say_so(tmp_path: Path) -> None:
    """Held until the next row it acts half a row later than interpolated, which had passed for a lag of the drive."""
    (tmp_path / "lesson.yaml").write_text(LESSON, encoding="utf-8")
    for seed, name in enumerate(("log.csv", "other.csv"), 1):
        write_log(tmp_path / name, seed, late=0)
    answer = answer_in(tmp_path, *(word for name in ("CurrentLoopLag", "CoulombFriction") for word in ("--effect", name)))
    assert [effect["effect"] for effect in answer["effects"]] == ["CoulombFriction"]
    assert any("write 'held: true' if it was commanded" in said for said in answer["recording"])
    assert answer["history"][-1]["move"] == "held inputs"
