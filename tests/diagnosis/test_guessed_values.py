"""Values that are a guess: the lesson that ``look`` proposes has those of a template, and the machine is another one."""

from pathlib import Path

import numpy as np
import pytest

from lathesim.cli.main import run_command_line
from tests.diagnosis.asking import answer_in

MASS, VISCOUS, FRICTION = 800.0, 2000.0, 300.0
PERIOD, FINE = 2e-3, 10


def write_log(file: Path, seed: int) -> None:
    """Write 3 s of a heavy slide with dry friction that sines push: eight times the mass of the template, ten times its damping."""
    phases = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, 4)
    position, speed, step, rows = 0.0, 0.0, PERIOD / FINE, []
    for sample in range(1500):
        now = PERIOD * sample
        force = float(3000.0 * np.sin(np.pi * now + phases[0]) + 1200.0 * np.sum(np.sin(np.array([8.0, 18.0, 33.0]) * now + phases[1:])))
        rows.append((now, force, round(position / 1e-6) * 1e-6))
        for _ in range(FINE):
            speed += step * (force - VISCOUS * speed - FRICTION * np.tanh(speed / 5e-4)) / MASS
            position += step * speed
    np.savetxt(file, rows, delimiter=",", header="time_s,force_command_N,position_m", comments="")


def test_a_machine_far_from_its_template_has_other_values_and_no_wrong_scale(tmp_path: Path) -> None:
    """It had a position that was off by a factor of 0.21, as no mass beyond 4.5 times that of the template was tried."""
    for name, seed in (("log.csv", 1), ("other.csv", 2)):
        write_log(tmp_path / name, seed)
    assert run_command_line(["look", str(tmp_path / "log.csv"), "--lesson", str(tmp_path / "lesson.yaml")]) == 0
    tried = ("CoulombFriction", "ScaleFactorError", "DriveGainError")
    answer = answer_in(tmp_path, *(word for name in tried for word in ("--effect", name)))
    assert [effect["effect"] for effect in answer["effects"]] == ["CoulombFriction"]
    level = answer["effects"][0]["parameters"]["level"]
    assert level["low"] < FRICTION < level["high"]
    assert answer["baseline"]["x_axis.mass"]["refit_with"] == pytest.approx(MASS, rel=0.01)
    assert answer["baseline"]["x_axis.viscous"]["refit_with"] == pytest.approx(VISCOUS, rel=0.01)
