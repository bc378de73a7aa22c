"""Threads follow the angle of the spindle: all passes begin at its index, whatever its speed does, and nothing stands inside a thread."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare, run_prepared
from lathesim.plugins import load_registry
from lathesim.record import Record

LEAD = 0.002
PROGRAM = """O0001
G21 G99 G97 S{speed} M03
G00 X{x} Z14.
G04 X1.
G00 X35.
G32 Z30. F2.
G00 X40.
Z14.
X34.6
G32 Z30. F2.
G00 X40.
M30
"""
CHAIN = """O0001
G21 G99 G97 S300 M03
G00 X40. Z14.
G04 X1.
G00 X35.9
G32 Z24. F2.
Z30. F3.
X40.9 Z32.5
G04 X0.1
G32 X42. F2.
G00 X45.
M30
"""
TAP = """O0001
G21 G99 G97 S300
G00 X0. Z14.
G04 X1.
G84 Z24. R16. F1.25
G80
G00 X45.
M30
"""
LESSON = """lesson: A thread
machine: {machine}
dialect: fanuc
program: thread.nc
start_point: {{x: 0 mm, z: 0 mm}}
{more}
"""


def threaded(folder: Path, machine: str, more: str = "", speed: int = 300, program: str = PROGRAM) -> Record:
    (folder / "thread.nc").write_text(program.format(speed=speed, x="40."), encoding="utf-8")
    (folder / "thread.yaml").write_text(LESSON.format(machine=machine, more=more), encoding="utf-8")
    case = prepare(load_lesson(folder / "thread.yaml"), load_registry())
    return run_prepared(case, engine="plain")


def passes(record: Record) -> list[np.ndarray]:
    """Return the samples of each thread pass in which the tool is on its way."""
    found = []
    for line in (6, 10):
        there = (record["interpolator.program_line"] == line) & (record["interpolator.feed_speed"] > 0.0)
        found.append(np.flatnonzero(there)[1:-1])
    return found


@pytest.mark.parametrize("machine", ["two_axis_lathe", "two_axis_lathe_analytical"])
@pytest.mark.parametrize("interpolator", ["ConstantVelocityInterpolator", "ConstantAccelerationInterpolator"])
def test_every_pass_begins_at_the_index_of_the_spindle_and_keeps_its_lead(tmp_path: Path, machine: str, interpolator: str) -> None:
    record = threaded(tmp_path, machine, f"replace: {{interpolator: {interpolator}}}")
    z, angle = record["interpolator.z_reference"], record["spindle.angle"]
    begins = []
    for samples in passes(record):
        assert len(samples) > 20
        begin = angle[samples] - (z[samples] - 0.014) * 2.0 * np.pi / LEAD
        assert np.ptp(begin) < 1e-6
        begins.append(begin[0] / (2.0 * np.pi))
    assert begins[0] == pytest.approx(round(begins[0]), abs=1e-6)
    assert begins[1] == pytest.approx(round(begins[1]), abs=1e-6)
    assert begins[1] > begins[0]


@pytest.mark.parametrize("interpolator", ["ConstantVelocityInterpolator", "ConstantAccelerationInterpolator", "JerkLimitedInterpolator"])
def test_a_thread_behind_a_thread_goes_on_without_a_standstill_and_one_behind_a_dwell_waits(tmp_path: Path, interpolator: str) -> None:
    """Three moves, a change of the lead and a run-out over a taper are one motion; 13.33 leads of the longer axis last 7.83 turns."""
    record = threaded(tmp_path, "two_axis_lathe", f"replace: {{interpolator: {interpolator}}}", program=CHAIN)
    line, turns = record["interpolator.program_line"], record["spindle.angle"] / (2.0 * np.pi)
    moving = record["interpolator.feed_speed"] > 0.0
    chain = np.flatnonzero((line >= 6) & (line <= 8) & moving)
    assert (np.diff(chain) == 1).all()
    begin = turns[chain[0]] - (record["interpolator.z_reference"][chain[0]] - 0.014) / LEAD
    assert begin == pytest.approx(round(begin), abs=1e-6)
    at = begin + np.array([0.0, 5.0, 7.0, 7.0 + 2.5 / 3.0])
    for axis, places in (("x", [0.01795, 0.01795, 0.01795, 0.02045]), ("z", [0.014, 0.024, 0.030, 0.0325])):
        assert record[f"interpolator.{axis}_reference"][chain] == pytest.approx(np.interp(turns[chain], at, places), abs=1e-12)
    second = np.flatnonzero((line == 10) & moving)[1]
    waited = turns[second] - (record["interpolator.x_reference"][second] - 0.02045) / LEAD
    assert waited == pytest.approx(round(waited), abs=1e-6)


def test_a_spindle_that_is_not_yet_up_to_speed_leaves_the_lead_as_it_is(tmp_path: Path) -> None:
    record = threaded(tmp_path, "two_axis_lathe", "set: {spindle.time_constant: 3 s}", speed=900)
    samples = passes(record)[0]
    z, angle, speed = (record[name][samples] for name in ("interpolator.z_reference", "spindle.angle", "spindle.speed"))
    assert speed.max() > 1.05 * speed.min()
    slope = np.diff(z) / np.diff(angle) * 2.0 * np.pi
    assert slope == pytest.approx(np.full(len(slope), LEAD), rel=1e-6)


def test_a_dip_of_the_spindle_under_load_shows_in_the_thread() -> None:
    """The reference follows the angle exactly; the slide lags by what the feed asks for, so where the spindle dips the lead is off."""
    record = run_prepared(prepare(load_lesson("16_shop_programs"), load_registry(), "thread"))
    thread = (record["interpolator.program_line"] == 20) & (record["interpolator.feed_speed"] > 0.0)
    begin = int(np.flatnonzero(thread)[0])
    first = slice(begin + 160, begin + 340)  # the first pass, behind its run-up
    speed = record["spindle.speed"][first] * 30.0 / np.pi
    assert speed.min() < 350.0 < 395.0 < speed.max()
    turned = LEAD * record["spindle.angle"][first] / (2.0 * np.pi)
    wanted = record["interpolator.z_reference"][first] + turned
    made = record["z_axis.position"][first] + turned
    assert np.ptp(wanted) < 1e-9
    assert np.ptp(made) == pytest.approx(198e-6, rel=0.1)


@pytest.mark.parametrize("interpolator", ["ConstantVelocityInterpolator", "ConstantAccelerationInterpolator"])
def test_a_tap_stays_on_its_lead_while_the_spindle_reverses_beyond_the_bottom(tmp_path: Path, interpolator: str) -> None:
    """A spindle of 5 turns/s with a lag of 0.21 s turns on by 5 0.21 (1 - ln 2) turns; its controller reverses it sooner."""
    record = threaded(tmp_path, "two_axis_lathe", f"replace: {{interpolator: {interpolator}}}", program=TAP)
    z, turns = record["interpolator.z_reference"], record["spindle.angle"] / (2.0 * np.pi)
    tapping = (record["interpolator.program_line"] == 5) & (record["interpolator.path_kind"] == 1.0)
    moving = np.flatnonzero(tapping & (record["interpolator.feed_speed"] != 0.0))[:-1]
    begin = turns[moving] - (z[moving] - 0.016) / 1.25e-3
    assert np.ptp(begin) < 1e-9
    assert begin[0] == pytest.approx(round(begin[0]), abs=1e-6)
    assert 0.1e-3 < z[tapping].max() - 0.024 < 1.25e-3 * 5.0 * 0.21 * (1.0 - np.log(2.0))
    assert record["spindle.speed"][moving].min() == pytest.approx(-300.0 * np.pi / 30.0, rel=0.05)
    assert z[-1] == pytest.approx(0.014)
