"""The twin and the tolerance: machines of one and of two axes follow set-points, and what is shown is kept."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare
from lathesim.live.stepped_machine import SteppedMachine, axes_of
from lathesim.plugins import load_registry
from lathesim.record import load
from tests.cli.command import call, done
from tests.live.campaign.machines import step
from tests.live.servo import LESSON
from tests.live.streams import stream, written


def test_each_axis_of_a_lathe_follows_its_own_set_points() -> None:
    ready = prepare(load_lesson("01_contour_error"), load_registry([]))
    outputs = ["x_axis.position", "z_axis.position"]
    machine = SteppedMachine(ready, axes_of(ready, ("x", "z"), {}), record=outputs)
    points = np.zeros((600, 2))
    points[:, 0] = np.minimum(np.arange(600) * 5e-5, 0.01)
    points[:, 1] = -0.5 * points[:, 0]
    values = machine.advance(points)
    ends = values[[machine.plan.channels.index(name) for name in outputs], -1]
    assert ends == pytest.approx([0.01, -0.005], abs=3e-4)


def test_a_twin_shows_and_keeps_reference_executed_and_simulated(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recording = written(stream(8.0, 1, friction=step(8.0, 4.0, 0.0, 20.0)), tmp_path / "r.h5")
    said = done(capsys, "twin", LESSON, recording, "--fast", "--every", "1 s", "--out", tmp_path / "twin.h5")
    lines = [line for line in said.out.splitlines() if line.startswith("t =")]
    assert len(lines) >= 7
    assert all("reference" in line and "executed" in line and "simulated" in line for line in lines)
    kept = load(tmp_path / "twin.h5")
    assert len(kept) == 8000
    off = np.abs(kept["x_drive.current"] - kept["twin.x_drive.current"])
    before, after = off[1000:4000].mean(), off[4000:].mean()
    assert after > 3.0 * before


@pytest.mark.slow
def test_a_path_is_slower_only_where_the_machine_would_leave_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    angle = np.linspace(0.0, 0.5 * np.pi, 40)
    arc = np.column_stack([3.0 * (1.0 - np.cos(angle)), -20.0 - 3.0 * np.sin(angle)])
    way = np.vstack([np.column_stack([np.zeros(40), np.linspace(0.0, -19.5, 40)]), arc])
    rows = "\n".join(f"{x:.6f},{z:.6f}" for x, z in way)
    (tmp_path / "path.csv").write_text(f"x [mm],z [mm]\n{rows}\n", encoding="utf-8")
    axis = "{velocity: 15 mm/s, acceleration: 200 mm/s^2}"
    (tmp_path / "limits.yaml").write_text(f"axes:\n  x: {axis}\n  z: {axis}\n", encoding="utf-8")
    said = call(
        capsys, "retime", tmp_path / "path.csv", "--limits", tmp_path / "limits.yaml", "--period", "5 ms", "--json",
        "--tolerance", "300um", "--lesson", "01_contour_error",
    )  # fmt: skip
    result = json.loads(said.out)
    cost = result["tolerance"]
    assert cost["before_m"] > 300e-6
    assert cost["after_m"] <= 300e-6
    assert 0.0 < cost["slower_share"] < 0.6
    assert result["duration_s"] > cost["duration_before_s"]
