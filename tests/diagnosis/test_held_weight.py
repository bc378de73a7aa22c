"""A vertical axis in a closed loop: dry friction alone seems to hold it, though a weight does most."""

import math
from pathlib import Path

import numpy as np
import pytest

from tests.diagnosis.asking import answer_in

LESSON = """
lesson: A vertical axis under cascade control
machine: cascade_axis
sample_period: 1 ms
step: 0.25 ms
set:
  x_controller.position_gain: 60 1/s
  x_controller.velocity_gain: 55 V*s/m
  x_controller.mean_share: 0
  x_drive.effort_constant: 35 N/A
  x_axis.mass: 40 kg
  x_axis.viscous: 150 N*s/m
  x_encoder.resolution: 1 um
recordings:
  time: {column: t, unit: s}
  drive: {x_controller.reference: {column: wanted, unit: m, held: true}}
  compare: {x_encoder.position: {column: position, unit: m}, x_controller.voltage: {column: voltage, unit: V}}
uncertain: {x_axis.mass: 5 %, x_axis.viscous: 30 %}
"""
MASS, VISCOUS, DRIVE, FRICTION, WEIGHT = 41.0, 160.0, 35.0, 60.0, 120.0
PERIOD, FINE, COUNT = 1e-3, 40, 1e-6
STROKES = (
    [(0.1, 0.5, 0.04), (0.7, 1.5, -0.06), (1.7, 1.9, 0.02), (2.0, 2.8, 0.05)],
    [(0.1, 0.9, -0.05), (1.0, 1.3, 0.03), (1.5, 2.3, 0.06), (2.4, 2.6, -0.015)],
)


def write_log(file: Path, strokes: list[tuple[float, float, float]]) -> None:
    """Write 3 s of the axis, which moves by strokes (begin [s], end [s], distance [m])."""
    time = PERIOD * np.arange(3000)
    wanted = np.zeros(len(time))
    for begin, end, distance in strokes:
        share = np.clip((time - begin) / (end - begin), 0.0, 1.0)
        wanted += distance * (share - np.sin(2.0 * np.pi * share) / (2.0 * np.pi))
    place, speed, before, step, rows = 0.0, 0.0, 0.0, PERIOD / FINE, []
    for instant, goal in zip(time, wanted, strict=True):
        position = round(place / COUNT) * COUNT
        voltage = float(np.clip(55.0 * (60.0 * (goal - position) - (position - before) / PERIOD), -10.0, 10.0))
        rows.append((instant, goal, position, voltage))
        before, push = position, DRIVE * voltage - WEIGHT
        for _ in range(FINE):
            if speed == 0.0 and abs(push) <= FRICTION:
                continue
            moved = speed + step * (push - VISCOUS * speed - math.copysign(FRICTION, speed or push)) / MASS
            # dry friction stops a motion and turns none round
            speed = 0.0 if moved * speed < 0.0 else moved
            place += step * speed
    np.savetxt(file, rows, delimiter=",", header="t,wanted,position,voltage", comments="")


def test_a_weight_is_found_where_friction_alone_seems_to_hold_it(tmp_path: Path) -> None:
    (tmp_path / "lesson.yaml").write_text(LESSON, encoding="utf-8")
    for name, strokes in zip(("log.csv", "other.csv"), STROKES, strict=True):
        write_log(tmp_path / name, strokes)
    answer = answer_in(
        tmp_path, *(word for name in ("CoulombFriction", "AsymmetricFriction", "ForceOffset") for word in ("--effect", name))
    )
    sizes = {effect["effect"]: next(iter(effect["parameters"].values()))["value"] for effect in answer["effects"]}
    assert sizes == {"CoulombFriction": pytest.approx(FRICTION, rel=0.02), "ForceOffset": pytest.approx(WEIGHT, rel=0.01)}
