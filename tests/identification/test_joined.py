"""Two recordings fitted together: each begins in a state of its own, whatever its first readings seem to say."""

from pathlib import Path

import numpy as np
import pytest

from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.replay.experiment import baseline_free, build_experiments
from lathesim.identification.replay.joined import joined
from lathesim.identification.replay.loading import load_case
from lathesim.lessons.lesson import load_lesson
from lathesim.plugins import load_registry

LESSON = """
lesson: A motor that turns already as its log begins
machine: torque_spindle
sample_period: 10 ms
step: 1 ms
set: {spindle.inertia: 0.02 kg*m^2, spindle.viscous: 0.03 N*m*s/rad, spindle_encoder.resolution: 0.02 rad}
recordings:
  time: {column: t, unit: s}
  drive: {spindle.torque: {column: torque, unit: N*m, held: true}}
  compare: {spindle_encoder.angle: {column: angle, unit: rad}}
uncertain: {spindle.inertia: 50 %, spindle.viscous: 50 %}
"""
INERTIA, VISCOUS, SPEEDS, PERIOD, FINE = 0.025, 0.02, (4.0, -7.0), 0.01, 20


def write_log(file: Path, speed: float, frequency: float) -> None:
    """Write 3 s of a motor that turns with a speed [rad/s] when its log begins, its angle in counts of 0.02 rad."""
    angle, step, rows = 0.0, PERIOD / FINE, []
    for sample in range(300):
        torque = float(np.sin(2.0 * np.pi * frequency * sample * PERIOD))
        rows.append((PERIOD * sample, torque, round(angle / 0.02) * 0.02))
        for _ in range(FINE):
            speed += step * (torque - VISCOUS * speed) / INERTIA
            angle += step * speed
    np.savetxt(file, rows, delimiter=",", header="t,torque,angle", comments="")


def test_each_recording_begins_with_a_speed_of_its_own(tmp_path: Path) -> None:
    (tmp_path / "lesson.yaml").write_text(LESSON, encoding="utf-8")
    files = [tmp_path / "slow.csv", tmp_path / "quick.csv"]
    for file, speed, frequency in zip(files, SPEEDS, (0.7, 1.9), strict=True):
        write_log(file, speed, frequency)
    case = load_case(load_lesson(tmp_path / "lesson.yaml"), files, load_registry())
    both = joined(build_experiments(case.machine, [(one.name, one.record) for one in case.recordings], ()))
    fitted = fit(both.sensed, [*baseline_free(case.machine), *both.start_states(both.sensed.plan)])
    speeds = [begun["spindle.rotation"] for begun in both.started(fitted.by_name)]
    assert speeds == pytest.approx(SPEEDS, abs=0.1)
    assert fitted.by_name["spindle.inertia"] == pytest.approx(INERTIA, rel=0.01)
    assert fitted.by_name["spindle.viscous"] == pytest.approx(VISCOUS, rel=0.05)
