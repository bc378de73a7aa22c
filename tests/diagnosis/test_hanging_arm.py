"""An arm that hangs from a motor: its weight pulls with the sine of the angle, beside the friction of the joint."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from lathesim.cli.main import run_command_line

LESSON = """
lesson: A joint whose weight was left out
machine: torque_spindle
sample_period: 4 ms
step: 1 ms
set: {spindle.inertia: 0.02 kg*m^2, spindle.viscous: 0.03 N*m*s/rad}
uncertain: {spindle.inertia: 20 %, spindle.viscous: 100 %}
recordings:
  time: {column: t, unit: s}
  drive: {spindle.torque: {column: torque, unit: N*m}}
  compare: {spindle.angle: {column: angle, unit: rad}}
"""
INERTIA, VISCOUS, FRICTION, WEIGHT, LOWEST = 0.021, 0.03, 0.11, 0.62, -0.35
PERIOD, FINE = 4e-3, 5


def write_log(file: Path, seed: int) -> None:
    """Write 8 s of an arm that a PD controller moves along two sines; friction holds it while less than its level pushes."""
    rng = np.random.default_rng(seed)
    angle, speed, step, rows = 0.2, 0.0, PERIOD / FINE, []

    def wanted(now: float) -> float:
        return 0.9 * math.sin(2.0 * math.pi * (0.15 + 0.02 * now) * now + seed) + 0.4 * math.sin(2.0 * math.pi * 0.63 * now)

    for sample in range(2000):
        now = PERIOD * sample
        rate = (wanted(now + 1e-3) - wanted(now - 1e-3)) / 2e-3
        torque = float(np.clip(18.0 * (wanted(now) - angle) + 0.9 * (rate - speed), -3.0, 3.0))
        rows.append((now, torque + 0.005 * rng.standard_normal(), round(angle / 1.5e-3) * 1.5e-3))
        for _ in range(FINE):
            pull = torque - VISCOUS * speed - WEIGHT * math.sin(angle - LOWEST)
            if abs(speed) < 1e-3 and abs(pull) < FRICTION:
                speed = 0.0
            else:
                after = speed + step * (pull - math.copysign(FRICTION, speed or pull)) / INERTIA
                speed = 0.0 if after * speed < 0.0 else after
            angle += step * speed
    np.savetxt(file, rows, delimiter=",", header="t,torque,angle", comments="")


def test_weight_and_friction_of_a_joint_are_named_with_their_sizes(tmp_path: Path) -> None:
    (tmp_path / "lesson.yaml").write_text(LESSON, encoding="utf-8")
    for name, seed in (("log.csv", 1), ("other.csv", 2)):
        write_log(tmp_path / name, seed)
    words = ["diagnose", "lesson.yaml", "log.csv", "--validate", "other.csv", "--json", "answer.json", "--no-report", "--out", "out"]
    for name in ("GravityTorque", "CoulombFriction", "Cogging", "AmplifierDeadZone"):
        words += ["--effect", name]
    with pytest.MonkeyPatch.context() as there:
        there.chdir(tmp_path)
        assert run_command_line(words) == 0
    answer = json.loads((tmp_path / "answer.json").read_text(encoding="utf-8"))
    sizes = {effect["effect"]: next(iter(effect["parameters"].values())) for effect in answer["effects"]}
    assert answer["verdict"] == "named"
    assert {name: size["value"] for name, size in sizes.items()} == pytest.approx(
        {"GravityTorque": WEIGHT, "CoulombFriction": FRICTION}, rel=0.03
    )
    assert answer["fit"]["spindle.angle"]["after"] < 0.02 < 1.0 < answer["fit"]["spindle.angle"]["before"]
