"""An arm that hangs from a motor: its weight pulls with the sine of the angle, beside the friction of the joint."""

import math
from pathlib import Path

import numpy as np
import pytest

from tests.diagnosis.asking import answer_in

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
INERTIA, VISCOUS, FRICTION, LOSS, WEIGHT, LOWEST = 0.021, 0.03, 0.11, 0.3, 0.62, -0.35
PERIOD, FINE = 4e-3, 5
WEIGHED = f", spindle.gravity: {WEIGHT} N*m, spindle.lowest: {LOWEST} rad"


def write_log(file: Path, seed: int, *, geared: bool = False) -> None:
    """Write 5 s of an arm that a PD controller moves along two sines; friction holds it while less than its level pushes. A gear loses a
    share of the mean of the torques of drive and weight, a joint a constant torque."""
    rng = np.random.default_rng(seed)
    angle, speed, step, rows = 0.2, 0.0, PERIOD / FINE, []

    def wanted(now: float) -> float:
        return 0.9 * math.sin(2.0 * math.pi * (0.15 + 0.02 * now) * now + seed) + 0.4 * math.sin(2.0 * math.pi * 0.63 * now)

    for sample in range(1250):
        now = PERIOD * sample
        rate = (wanted(now + 1e-3) - wanted(now - 1e-3)) / 2e-3
        torque = float(np.clip(18.0 * (wanted(now) - angle) + 0.9 * (rate - speed), -3.0, 3.0))
        rows.append((now, torque + 0.005 * rng.standard_normal(), round(angle / 1.5e-3) * 1.5e-3))
        for _ in range(FINE):
            weight = WEIGHT * math.sin(angle - LOWEST)
            pull, level = torque - VISCOUS * speed - weight, LOSS * (abs(torque) + abs(weight)) / 2.0 if geared else FRICTION
            if abs(speed) < 1e-3 and abs(pull) < level:
                speed = 0.0
            else:
                after = speed + step * (pull - math.copysign(level, speed or pull)) / INERTIA
                speed = 0.0 if after * speed < 0.0 else after
            angle += step * speed
    np.savetxt(file, rows, delimiter=",", header="t,torque,angle", comments="")


@pytest.mark.parametrize(
    ("geared", "known", "truth"),
    [(False, "", {"GravityTorque": WEIGHT, "CoulombFriction": FRICTION}), (True, WEIGHED, {"GearLoss": LOSS})],
)
def test_weight_and_friction_of_a_joint_are_named_with_their_sizes(
    tmp_path: Path, geared: bool, known: str, truth: dict[str, float]
) -> None:
    """At rest the friction holds what drive and weight leave."""
    (tmp_path / "lesson.yaml").write_text(LESSON.replace("viscous: 0.03 N*m*s/rad", f"viscous: 0.03 N*m*s/rad{known}"), encoding="utf-8")
    for name, seed in (("log.csv", 1), ("other.csv", 2)):
        write_log(tmp_path / name, seed, geared=geared)
    tried = ("GravityTorque", "CoulombFriction", "GearLoss", "Cogging", "AmplifierDeadZone")
    answer = answer_in(tmp_path, *(word for name in tried for word in ("--effect", name)))
    sizes = {effect["effect"]: next(iter(effect["parameters"].values())) for effect in answer["effects"]}
    assert answer["verdict"] == "named"
    assert {name: size["value"] for name, size in sizes.items()} == pytest.approx(truth, rel=0.03)
    assert answer["fit"]["spindle.angle"]["after"] < 0.02 < answer["fit"]["spindle.angle"]["before"]
