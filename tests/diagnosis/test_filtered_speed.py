"""A motor on steps of voltage, whose firmware filters the speed that it reports."""

import math
from pathlib import Path

import numpy as np
import pytest

from tests.diagnosis.asking import answer_in

LESSON = """
lesson: A small motor on an amplifier
machine: torque_spindle
sample_period: 4 ms
step: 1 ms
set: {spindle.inertia: 3e-5 kg*m^2, spindle.viscous: 4e-4 N*m*s/rad}
recordings:
  time: {column: t, unit: s}
  drive: {spindle.torque: {column: volts, unit: N*m, scale: 0.01421, held: true}}
  compare: {spindle.speed: {column: speed, unit: rad/s}}
uncertain: {spindle.inertia: 30 %, spindle.viscous: 20 %}
"""
INERTIA, VISCOUS, RESISTANCE, CONSTANT, FRICTION = 3.1e-5, 1.5e-5, 1.9, 0.027, 6.5e-3
PERIOD, FINE, LAG = 4e-3, 8, 12e-3


def write_log(file: Path, seed: int) -> None:
    """Write 6 s of a motor whose voltage steps both ways; the speed goes through y += (1 - exp(-T / LAG)) (w - y)."""
    rng = np.random.default_rng(seed)
    volts = np.repeat(rng.choice([-9.0, -6.0, -3.0, 0.0, 3.0, 6.0, 9.0], 25), 60)
    speed, shown, step, rows = 0.0, 0.0, PERIOD / FINE, []
    for sample, volt in enumerate(volts.tolist()):
        shown += (1.0 - math.exp(-PERIOD / LAG)) * (speed - shown)
        rows.append((sample * PERIOD, volt, shown + 0.3 * rng.standard_normal()))
        for _ in range(FINE):
            pull = CONSTANT * (volt - CONSTANT * speed) / RESISTANCE - VISCOUS * speed
            if abs(speed) < 0.2 and abs(pull) < FRICTION:
                speed = 0.0
            else:
                after = speed + step * (pull - math.copysign(FRICTION, speed or pull)) / INERTIA
                speed = 0.0 if after * speed < 0.0 else after
    np.savetxt(file, rows, delimiter=",", header="t,volts,speed", comments="")


def test_a_filter_that_a_firmware_computes_is_no_lag_of_the_drive(tmp_path: Path) -> None:
    (tmp_path / "lesson.yaml").write_text(LESSON, encoding="utf-8")
    for name, seed in (("log.csv", 1), ("other.csv", 2)):
        write_log(tmp_path / name, seed)
    tried = ("SensorFilter", "CurrentLoopLag", "CoulombFriction")
    answer = answer_in(tmp_path, *(word for name in tried for word in ("--effect", name)))
    sizes = {effect["effect"]: next(iter(effect["parameters"].values()))["value"] for effect in answer["effects"]}
    assert sizes == pytest.approx({"SensorFilter": LAG, "CoulombFriction": FRICTION}, rel=0.03)
    assert answer["fit"]["spindle.speed"]["after"] < 0.4
    assert any(entry["effect"] == "SensorFilter" and entry["held"] == "-1" for entry in answer["insert"])
