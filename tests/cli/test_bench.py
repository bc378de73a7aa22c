"""``lathesim bench``: what it says, with measuring itself cut short."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from lathesim.cli.speed import bench_rows
from lathesim.cli.speed.bench_rows import Row, Skipped
from lathesim.engine.batch import Batch
from lathesim.engine.run import run
from tests.benchmarks import lanes, scale, servo_axis, table1
from tests.benchmarks.lanes import LaneFigure
from tests.benchmarks.many_axes import axes_plan
from tests.benchmarks.scale import Hour, Series
from tests.cli.command import done, json_of, refused


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Measurements that take no time."""
    rows = [Row("compiled", 0.006), Row("by hand", 0.005, 0.0), Row("another", 3.0, 2e-4)]
    left = [Skipped("third", "it is not installed")]
    monkeypatch.setattr(bench_rows, "work_rows", lambda *_, **__: (rows, left))
    monkeypatch.setattr(bench_rows, "start_rows", lambda *_: [Row("start: lathesim --help", 0.06)])


@pytest.mark.usefixtures("short")
def test_json_has_the_rows_of_the_schema(capsys: pytest.CaptureFixture[str]) -> None:
    found = json_of(capsys, "bench", "--json", "--quick")
    assert found["schema"] == "lathesim-bench/1"
    assert all(set(row) == {"name", "median_s", "ratio_to_compiled"} for row in found["rows"])
    assert [row["ratio_to_compiled"] for row in found["rows"]] == pytest.approx([1.0, 5 / 6, 500.0, 10.0])
    assert found["skipped"] == [{"name": "third", "reason": "it is not installed"}]
    assert found["machine"]["python"].startswith("3.")


@pytest.mark.usefixtures("short")
def test_the_table_is_markdown_with_ratios_and_agreement(capsys: pytest.CaptureFixture[str]) -> None:
    said = done(capsys, "bench", "--quick")
    assert "| compiled | 6 ms | 1 |" in said.out
    assert "| by hand | 5 ms | 0.833 | 3669 | none |" in said.out
    assert "| another | 3 s | 500 | 6.11 | 0.0002 counts |" in said.out
    assert "| start: lathesim --help | 60 ms |" in said.out
    assert "Left out: third: it is not installed." in said.out


def test_a_peer_that_disagrees_is_told_and_leaves_with_one(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(bench_rows, "work_rows", lambda *_, **__: ([Row("compiled", 0.006), Row("other", 1.0, 2.5)], []))
    monkeypatch.setattr(bench_rows, "start_rows", lambda *_: [])
    assert "other differs from the engine by 2.5 encoder counts." in refused(capsys, "bench").err


def test_without_the_checkout_only_own_rows_are_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench_rows, "checkout", lambda: None)
    present, skipped = bench_rows._present(slow=True)
    assert present == []
    assert skipped[0].reason == "they are measured from a checkout, with its folder tests/benchmarks/peers"


def test_further_measurements_are_of_the_checkout(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(bench_rows, "checkout", lambda: None)
    assert refused(capsys, "bench", "--lanes").err.startswith("--lanes is measured from a checkout, with its folder tests/benchmarks.")


def test_scale_draws_and_tells_slopes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    sizes = (1.0, 10.0, 1000.0, 5000.0)
    even = Series("runs", sizes, tuple(0.006 * size for size in sizes))
    monkeypatch.setattr(scale, "scale_series", lambda *_, **__: [even])
    monkeypatch.setattr(scale, "thread_gain", lambda *_: 1.9)
    monkeypatch.setattr(scale, "hour", lambda *_: Hour(2.5, 2.0, 1.4, 160.0, 179.0))
    monkeypatch.setattr(scale, "batch_memory", lambda *_: {100: 119.0, 10000: 119.0})
    said = done(capsys, "bench", "--scale", "--save", tmp_path / "scale.png")
    assert (tmp_path / "scale.png").stat().st_size > 5000
    assert "1 to 5000 runs: 5000 times the cost; slope on a log plot 1.000, 1.000 from 10 on (1 is in proportion)" in said.out
    assert "5000 runs take 5.00 times as long as 1000" in said.out
    assert "two threads are 1.90 times as fast as one" in said.out
    found = json_of(capsys, "bench", "--scale", "--json", "--save", tmp_path / "scale.png")
    assert found["slopes"]["runs"]["all"] == pytest.approx(1.0)
    assert found["rows"][0] == {"name": "1 runs", "median_s": 0.006, "ratio_to_compiled": 1.0}


def test_table1_tells_what_is_off_its_limit(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(table1, "REFERENCE", {"I": (18.48, 0.684, 0.150)})
    said = refused(capsys, "bench", "--table1", "--quick")
    assert "| I | cycle_time | 18.48 s | 18.48 s | " in said.out
    assert "I: contour_error_squared_integral is -" in said.err
    assert "% off, more than 6 %." in said.err


def test_the_axes_of_the_scale_all_do_the_same() -> None:
    record = run(axes_plan(3), duration=2.0, engine="plain")
    assert np.ptp(record["axis1.position"]) > 0.02
    assert np.array_equal(record["axis1.position"], record["axis3.position"])


def test_lanes_hold_each_ratio_against_its_bar(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    figures = [LaneFigure("servo axis", 8.0, 7.0, True, 0.004, 0.0005), LaneFigure("Jacobian", 2.5, 2.0, False)]
    monkeypatch.setattr(lanes, "lane_figures", lambda *_, **__: (figures, ["C: gcc is not installed"]))
    said = refused(capsys, "bench", "--lanes")
    assert "| servo axis | 4 ms | 0.5 ms | 8 | at least 7 | kept |" in said.out
    assert "| Jacobian |  |  | 2.5 | at most 2 | MISSED |" in said.out
    assert "Left out: C: gcc is not installed." in said.out
    found = json.loads(refused(capsys, "bench", "--lanes", "--json").out)
    assert [row["is_within"] for row in found["rows"]] == [True, False]


@pytest.mark.skipif(bool(servo_axis.no_compiler()), reason=servo_axis.no_compiler())
def test_the_servo_axis_in_c_has_the_bits_of_the_engine(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(servo_axis, "SECONDS", 3.0)
    plan = servo_axis.servo_plan()
    values = servo_axis.spread(plan, servo_axis.VARIED, 2)
    ours = Batch(plan, servo_axis.samples_of(plan), threads=1).run(servo_axis.VARIED, values)
    theirs = servo_axis.servo_in_c(plan, 2)(values)
    assert all(np.array_equal(one, other.T) for one, other in zip(ours, theirs, strict=True))
    assert np.ptp(ours[0][0]) > 0.09
    assert not np.array_equal(ours[0], ours[1])
