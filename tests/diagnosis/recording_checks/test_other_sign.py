"""A current that was recorded with the other sign: said first, and what the lesson left out is named on top of it."""

import json
from pathlib import Path

import numpy as np
import pytest

from lathesim.cli.main import run_command_line

LESSON = """
lesson: A slide that is pulled up and let down
machine: led_axis
sample_period: 20 ms
step: 20 ms
set: {x_axis.mass: 0.01 kg, x_axis.viscous: 40 N*s/m, x_axis.force_constant: 10 N/A}
uncertain: {x_axis.viscous: 30 %}
recordings:
  time: {column: t, unit: s}
  drive:
    x_axis.reference: {column: place, unit: m}
    x_axis.reference_velocity: {column: speed, unit: m/s}
  compare:
    x_axis.current: {column: current, unit: A}
"""
WEIGHT, FRICTION, NOISE = 30.0, 12.0, 0.05


def write_log(file: Path, seed: int) -> None:
    """Write a log of 16 s of a slide that goes up and down at several speeds, with a weight on it and dry friction."""
    rng = np.random.default_rng(seed)
    time = 0.02 * np.arange(800)
    speed = np.concatenate([way * size * np.sin(np.linspace(0.0, np.pi, 80)) for size in rng.uniform(0.1, 0.5, 5) for way in (1.0, -1.0)])
    force = 40.0 * speed + FRICTION * np.sign(np.round(speed, 9)) + WEIGHT
    current = -force / 10.0 + NOISE * rng.standard_normal(len(time))
    rows = np.column_stack([time, 0.02 * np.cumsum(speed), speed, current])
    np.savetxt(file, rows, delimiter=",", header="t,place,speed,current", comments="")


def test_weight_and_friction_are_named_on_top_of_the_sign(tmp_path: Path) -> None:
    (tmp_path / "lesson.yaml").write_text(LESSON, encoding="utf-8")
    for name, seed in (("log.csv", 1), ("other.csv", 2)):
        write_log(tmp_path / name, seed)
    words = ["diagnose", "lesson.yaml", "log.csv", "--validate", "other.csv", "--json", "answer.json", "--no-report", "--out", "out"]
    with pytest.MonkeyPatch.context() as there:
        there.chdir(tmp_path)
        assert run_command_line(words) == 0
    answer = json.loads((tmp_path / "answer.json").read_text(encoding="utf-8"))
    sizes = {effect["effect"]: next(iter(effect["parameters"].values()))["value"] for effect in answer["effects"]}
    assert answer["verdict"] in ("named", "tied")  # a zero of the current does the same as a weight
    assert sizes == pytest.approx({"ForceOffset": WEIGHT, "CoulombFriction": FRICTION}, rel=0.1)
    said = "x_axis.current is recorded with the other sign. Write scale: -1 for its column."
    assert answer["sentence"].startswith(said)
    assert said in answer["recording"]
