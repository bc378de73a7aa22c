"""``lathesim retime``: a file of samples to a record of set-points, and a clear sentence for what cannot be read."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from lathesim.record import load
from tests.cli.command import call, json_of, refused

LIMITS = """\
axes:
  x: {velocity: 20 mm/s, acceleration: 50 mm/s^2, jerk: 0.5 m/s^3}
  y: {velocity: 20 mm/s, acceleration: 50 mm/s^2, jerk: 0.5 m/s^3}
"""
FIVE_AXES = """\
kinematics: trunnion
feed: 10 mm/s
axes:
  x: {velocity: 40 mm/s, acceleration: 200 mm/s^2}
  y: {velocity: 40 mm/s, acceleration: 200 mm/s^2}
  z: {velocity: 40 mm/s, acceleration: 200 mm/s^2}
  a: {velocity: 60 deg/s, acceleration: 10 rad/s^2}
  b: {velocity: 60 deg/s, acceleration: 10 rad/s^2}
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with limits and a straight path."""
    (tmp_path / "limits.yaml").write_text(LIMITS, encoding="utf-8")
    (tmp_path / "five.yaml").write_text(FIVE_AXES, encoding="utf-8")
    (tmp_path / "line.csv").write_text("x [mm],y [mm]\n0,0\n50,0\n100,0\n", encoding="utf-8")
    return tmp_path


def test_a_line_becomes_set_points(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = call(capsys, "retime", folder / "line.csv", "--limits", folder / "limits.yaml", "--json", "--out", folder / "s.h5")
    result = json.loads(said.out)
    assert (said.code, result["schema"]) == (0, "lathesim-retime/1")
    assert result["duration_s"] == pytest.approx(5.4, rel=1e-4)
    record = load(folder / "s.h5")
    assert len(record) == result["set_points"] == 5401
    assert record["x.position"][[0, -1]] == pytest.approx([0.0, 0.1])
    assert np.abs(np.diff(record["x.position"])).max() <= 0.02 * 1e-3 * 1.001
    assert np.abs(np.diff(record["x.position"], 2)).max() <= 0.05 * 1e-6 * 1.001


def test_any_servo_period_gives_the_same_motion(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for period in ("1 ms", "0.37 ms"):
        out = folder / f"{period[:4]}.h5"
        call(capsys, "retime", folder / "line.csv", "--limits", folder / "limits.yaml", "--period", period, "--out", out, "--jerk")
        record = load(out)
        place = np.interp(2.0, record.time, record["x.position"])
        assert place == pytest.approx(0.02 * (2.0 - 0.25), abs=1e-9)


def test_what_is_kept_free_is_enough_for_elastic_playback(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 101)
    rows = [f"{20 * np.cos(a)},{20 * np.sin(a)}" for a in angle]
    (folder / "circle.csv").write_text("\n".join(["x [mm],y [mm]", *rows]), encoding="utf-8")
    (folder / "limits.yaml").write_text(LIMITS, encoding="utf-8")
    said = call(
        capsys, "retime", folder / "circle.csv", "--limits", folder / "limits.yaml", "--keep-free", 0.3, "--json", "--out", folder / "s.h5"
    )
    result = json.loads(said.out)
    rho, period = result["elastic_rho"], 1e-3
    kept = load(folder / "s.h5")
    for name, axis in result["axes"].items():
        assert axis["acceleration_share"] <= 0.7 * 1.001
        limit = axis["acceleration"] / axis["acceleration_share"]
        planned, speed = np.abs(kept[f"{name}.acceleration"]), np.abs(kept[f"{name}.velocity"])
        assert np.max(planned + speed * rho / period) <= 1.001 * limit


def test_poses_keep_the_feed_at_the_tool(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    s = np.linspace(0.0, 1.0, 101)
    rows = [f"{40 * u},0,20,{0.3 * np.sin(3 * u)},0.2,1" for u in s]
    (folder / "poses.csv").write_text("\n".join(["x [mm],y [mm],z [mm],i,j,k", *rows]), encoding="utf-8")
    limits, out = folder / "five.yaml", folder / "s.h5"
    result = json_of(capsys, "retime", folder / "poses.csv", "--poses", "--limits", limits, "--json", "--out", out)
    assert list(result["axes"]) == ["x", "y", "z", "a", "b"]
    assert result["duration_s"] == pytest.approx(4.05, rel=0.01)
    assert result["path_error_m"] < 1e-5


@pytest.mark.parametrize(
    ("csv", "limits", "sentence"),
    [
        ("x,y\n0,0\n", LIMITS, "line.csv:1: the column 'x' has no unit. Write the header as x [mm],y [mm],a [deg]."),
        ("x [mm],y [mm]\n0,0\n1\n", LIMITS, "line.csv:3: the row has 1 cells and the header 2."),
        ("x [mm],y [mm]\n0,zero\n", LIMITS, "line.csv:2: a cell is not a number. Write numbers with a point."),
        ("x [mm],y [mm]\n0,nan\n", LIMITS, "line.csv:2: a cell is not a finite number. Take the row away."),
        ("x [mm],y [N]\n0,0\n", LIMITS, "line.csv:1: an axis is given in a unit of"),
        ("x [mm],y [mm]\n", LIMITS, "line.csv: the file has a header and no samples. Write one row a sample."),
        ("x [mm],z [mm]\n0,0\n", LIMITS, "limits.yaml: the axis 'z' has no limits."),
        ("x [mm],y [mm]\n0,0\n", LIMITS.replace("50 mm/s^2", "50 mm/s"), "'50 mm/s' is given in mm/s, but m/s^2 is wanted."),
        (
            "x [mm],y [mm]\n0,0\n",
            LIMITS.replace("velocity", "velocty"),
            "limits.yaml: x: there is no key 'velocty'. Did you mean 'velocity'?",
        ),
        ("x [mm],y [mm]\n0,0\n", LIMITS.replace("20 mm/s", "0 mm/s"), "a limit of velocity is not above 0."),
    ],
)
def test_what_cannot_be_timed_is_told(folder: Path, capsys: pytest.CaptureFixture[str], csv: str, limits: str, sentence: str) -> None:
    (folder / "line.csv").write_text(csv, encoding="utf-8")
    (folder / "limits.yaml").write_text(limits, encoding="utf-8")
    assert sentence in refused(capsys, "retime", folder / "line.csv", "--limits", folder / "limits.yaml", "--out", folder / "s.h5").err
    assert not (folder / "s.h5").exists()
