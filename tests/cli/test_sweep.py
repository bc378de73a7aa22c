"""``lathesim sweep``: the table, going on after a stop, the plot, a cluster, and what is refused."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from lathesim.lessons.sweep_runs import Member
from lathesim.lessons.sweep_table import SweepTable
from tests.cli.command import call, done, environment, refused

LESSON = """\
lesson: A table under position control
machine: pushed
duration: 0.5 s
set: {controller.proportional: 0.4 V/mm}
goals: [{metric: settled, at_most: 1 mm}]
"""
PUSHED = """\
machine: A table under position control
sample_period: 5 ms
step: 1 ms
parts:
  controller: {component: PositionController}
  table: {component: EmpiricalAxis, set: {gain: 18.78 mm/(s*V), time_constant: 24.3 ms}}
wires:
  controller.reference: 1 mm
  controller.measured: table.position
  table.voltage: controller.voltage
"""
METRIC = '''\
"""How far the table is from where it should be at the end."""

from lathesim.analysis.metric import Metric, signal
from lathesim.hookspecs import hookimpl


def settled(record):
    return abs(float(signal(record, "controller.error")[-1]))


@hookimpl
def register_metrics():
    return [Metric("settled", "m", "distance left at the end", settled)]
'''
SWEEP = ("sweep", "pushed_table.yaml", "--plugins", "own", "--vary")


@pytest.fixture(autouse=True)
def in_a_folder_with_a_lesson() -> None:
    Path("pushed_table.yaml").write_text(LESSON, encoding="utf-8")
    Path("pushed.yaml").write_text(PUSHED, encoding="utf-8")
    Path("own").mkdir()
    Path("own/settled.py").write_text(METRIC, encoding="utf-8")


def rows(path: str | Path = "s.csv") -> list[str]:
    """Return the rows of a table without its comments and heading."""
    return [line for line in Path(path).read_text().splitlines() if not line.startswith("#")][1:]


def test_a_sweep_over_one_parameter(capsys: pytest.CaptureFixture[str]) -> None:
    said = done(capsys, *SWEEP, "controller.proportional=0.1..0.5:9", "--out", "s.csv")
    assert said.err.splitlines()[0] == "controller.proportional is varied in V/mm, the unit in which the lesson gives it."
    lines = Path("s.csv").read_text().splitlines()
    assert lines[0] == "# lathesim-sweep/1"
    assert lines[1] == "# lesson: pushed_table"
    assert lines[3] == "# vary: controller.proportional=0.1..0.5:9"
    assert lines[4] == "run,controller.proportional [V/mm],settled [m],status"
    cells = [line.split(",") for line in rows()]
    assert [cell[0] for cell in cells] == [str(number) for number in range(9)]
    assert [float(cell[1]) for cell in cells] == pytest.approx([0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5])
    assert [float(cell[2]) for cell in cells] == sorted((float(cell[2]) for cell in cells), reverse=True)
    assert {cell[3] for cell in cells} == {"complete"}
    assert "settled: least 0.9903 um at controller.proportional = 0.5 V/mm; most " in said.out
    assert Path("s.png").stat().st_size > 10_000


def test_two_parameters_lists_ratios_and_joined_names(capsys: pytest.CaptureFixture[str]) -> None:
    vary = ("controller.proportional=0.1..0.4 V/mm:3log", "--vary", "table.gain=10, 20 mm/(s*V)")
    done(capsys, *SWEEP, *vary, "--out", "s.csv")
    cells = [line.split(",") for line in rows()]
    assert [(float(cell[1]), float(cell[2])) for cell in cells] == [(0.1, 10), (0.1, 20), (0.2, 10), (0.2, 20), (0.4, 10), (0.4, 20)]
    assert Path("s.png").is_file()
    done(capsys, *SWEEP, "controller.smallest_voltage+controller.largest_voltage=1 V, 2 V", "--out", "j.csv", "--no-plot")
    assert "run,controller.smallest_voltage+controller.largest_voltage [V],settled [m],status" in Path("j.csv").read_text()


def test_the_sweep_gives_what_single_runs_give(capsys: pytest.CaptureFixture[str]) -> None:
    import json

    call(capsys, *SWEEP, "controller.proportional=0.2,0.3 V/mm", "--out", "s.csv", "--no-plot")
    for row, gain in zip(rows(), ("0.2", "0.3"), strict=True):
        setting = f"controller.proportional={gain} V/mm"
        run = call(capsys, "run", "pushed_table.yaml", "--plugins", "own", "--set", setting, "--json", "--no-plots", "--plain")
        assert float(row.split(",")[2]) == json.loads(run.out)["metrics"]["settled"]["value"]


def test_a_group_keeps_apart_what_is_refused_what_ends_and_what_does_not(capsys: pytest.CaptureFixture[str]) -> None:
    vary = ("table.time_constant=0.01 ms, 20 ms, 24 ms", "--vary", "controller.proportional=0.1..0.5 V/mm:20", "--threads")
    done(capsys, *SWEEP, *vary, "1", "--out", "s.csv", "--no-plot")
    assert [row.partition(",")[0] for row in rows()] == [str(number) for number in range(60)]
    assert all(",,refused: " in row for row in rows()[:20])
    assert all(row.endswith(",complete") for row in rows()[20:])
    done(capsys, *SWEEP, "controller.proportional=0.5 V/mm", "--set", "table.time_constant=24 ms", "--out", "one.csv", "--no-plot")
    assert rows("one.csv")[0].split(",")[2:] == rows()[59].split(",")[3:]


def test_a_run_that_breaks_down_has_the_reason_in_its_row(capsys: pytest.CaptureFixture[str]) -> None:
    said = done(capsys, *SWEEP, "table.time_constant=0.01 ms, 20 ms", "--out", "s.csv", "--no-plot")
    first, second = rows()
    assert first.startswith("0,0.01,,refused: ")
    assert second.endswith(",complete")
    assert "1 run has no complete result: refused: The step of 1000 us is too long" in said.out


def test_a_sweep_goes_on_where_it_was_stopped_and_makes_nothing_twice(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    arguments = (*SWEEP, "controller.proportional=0.1..0.5 V/mm:12", "--threads", "2", "--no-plot", "--out")
    done(capsys, *arguments, "whole.csv")
    made: list[int] = []
    add = SweepTable.add

    def counted(self: SweepTable, member: Member) -> None:
        if len(made) == 5:
            raise KeyboardInterrupt
        made.append(member.number)
        add(self, member)

    monkeypatch.setattr(SweepTable, "add", counted)
    said = call(capsys, *arguments, "s.csv")
    assert said.code == 130
    assert said.err == "Stopped after 5 of 12 runs; the same command goes on from there.\n"
    with Path("s.csv").open("a") as file:
        file.write("11,0.5,3.1")  # a row that was cut off while it was written
    again: list[int] = []
    monkeypatch.setattr(SweepTable, "add", lambda self, member: (again.append(member.number), add(self, member))[1])
    said = done(capsys, *arguments, "s.csv")
    assert sorted(again) == sorted(set(range(12)) - set(made))
    assert Path("s.csv").read_bytes() == Path("whole.csv").read_bytes()
    assert call(capsys, *arguments, "s.csv").out.startswith("12 runs, 0 of them made now;")


@pytest.mark.skipif(not hasattr(os, "killpg"), reason="needs POSIX signals")
def test_a_killed_sweep_ends_with_the_same_table(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = [*SWEEP, "controller.proportional=0.1..0.5 V/mm:1000", "--no-plot", "--out"]
    call(capsys, *arguments, "warm.csv")
    process = subprocess.Popen([sys.executable, "-m", "lathesim", *arguments, "s.csv"], env=environment(), stdout=subprocess.DEVNULL)
    deadline = time.monotonic() + 60.0
    while (not Path("s.csv").exists() or len(rows()) < 20) and time.monotonic() < deadline:
        time.sleep(0.002)
    process.send_signal(signal.SIGKILL)
    process.wait()
    left = len(rows())
    assert 20 <= left < 1000
    said = done(capsys, *arguments, "s.csv")
    assert Path("s.csv").read_bytes() == Path("warm.csv").read_bytes()
    assert int(said.out.split(" of them")[0].split(", ")[1]) in (1000 - left, 1000 - left + 1)


@pytest.mark.parametrize(
    ("vary", "sentence"),
    [
        ("controller.proportional", "this names no parameters and values."),
        ("controller.proportional=1..2", "'1..2' is no range."),
        ("controller.proportional=1..2 V/mm:1", "a range has 1 values, and 2 or more are expected."),
        ("controller.proportional=0..2 V/mm:4log", "equal ratios need two ends of one sign, neither of them 0."),
        ("controller.proportional=1..2 mm:4", "'1 mm' is given in mm, but V/m is wanted."),
        ("controller.integral=1..2:4", "the values have no unit, and V/(m*s) is wanted."),
        ("controller.propotional=1..2 V/mm:4", "controller has no parameter 'propotional'. Did you mean 'proportional'?"),
        ("contoller.proportional=1..2 V/mm:4", "there is no part 'contoller'. Did you mean 'controller'?"),
        ("controller.reference=1..2 mm:4", "controller.reference is an input, not a parameter."),
        ("table.time_constant=-1..1 s:3", "table.time_constant is -1 s, outside 1e-06 to inf s."),
        ("table.gain=1, , 2 mm/(s*V)", "a value is missing."),
    ],
)
def test_what_is_refused(vary: str, sentence: str, capsys: pytest.CaptureFixture[str]) -> None:
    said = refused(capsys, *SWEEP, vary, "--out", "s.csv")
    assert said.err.startswith(f"--vary {vary}: ")
    assert sentence in said.err
    assert not Path("s.csv").exists()


def test_a_table_of_another_sweep_is_left_alone(capsys: pytest.CaptureFixture[str]) -> None:
    call(capsys, *SWEEP, "controller.proportional=0.2,0.3 V/mm", "--out", "s.csv", "--no-plot")
    before = Path("s.csv").read_text()
    said = call(capsys, *SWEEP, "controller.proportional=0.2,0.4 V/mm", "--out", "s.csv")
    assert (said.code, said.err) == (
        1,
        "s.csv: the table is of another sweep: it has '# vary: controller.proportional=0.2,0.3 V/mm' where this one has "
        "'# vary: controller.proportional=0.2,0.4 V/mm'. Choose another --out, or delete the file.\n",
    )
    other = call(capsys, *SWEEP, "controller.proportional=0.2,0.3 V/mm", "--set", "table.gain=20 mm/(s*V)", "--out", "s.csv")
    assert "it has '# machine: " in other.err
    assert Path("s.csv").read_text() == before
    Path("notes.csv").write_text("mine\n")
    foreign = call(capsys, *SWEEP, "controller.proportional=0.2,0.3 V/mm", "--out", "notes.csv")
    assert foreign.err == "notes.csv: the file is there already and is no table of a sweep. Choose another --out.\n"


def test_what_else_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    twice = ("controller.proportional=0.2,0.3 V/mm", "--vary", "controller.proportional=0.2,0.3 V/mm")
    assert "controller.proportional is varied twice." in call(capsys, *SWEEP, *twice).err
    assert call(capsys, *SWEEP, "table.gain=10,20 mm/(s*V)", "--executor", "spark://x").code == 2
    nobody = call(capsys, *SWEEP, "table.gain=10,20 mm/(s*V)", "--metric", "setled")
    assert nobody.err == "there is no metric 'setled'. Did you mean 'settled'?\n"


@pytest.mark.slow
@pytest.mark.filterwarnings("default")
def test_a_cluster_gives_the_same_table(capsys: pytest.CaptureFixture[str]) -> None:
    distributed = pytest.importorskip("distributed")
    arguments = (*SWEEP, "controller.proportional=0.1..0.5 V/mm:40", "--no-plot", "--out")
    done(capsys, *arguments, "here.csv")
    options = {"n_workers": 2, "threads_per_worker": 1, "processes": True, "dashboard_address": None}
    with distributed.LocalCluster(**options) as cluster:
        address = cluster.scheduler_address.replace("tcp://", "dask://")
        said = call(capsys, *arguments, "there.csv", "--executor", address)
    assert said.code == 0, said.err
    assert Path("there.csv").read_bytes() == Path("here.csv").read_bytes()


@pytest.mark.slow
@pytest.mark.filterwarnings("default")
def test_a_cluster_that_does_not_answer(capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("distributed")
    said = refused(capsys, *SWEEP, "table.gain=10,20 mm/(s*V)", "--executor", "dask://127.0.0.1:9")
    assert said.err.endswith("no Dask scheduler answers at 127.0.0.1:9. Start one with: dask scheduler\n")


@pytest.mark.slow
def test_two_hundred_runs_of_the_first_lesson_take_less_than_ten_seconds(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ("sweep", "01_contour_error", "--metric", "max_contour_error", "--no-plot", "--vary")
    call(capsys, *arguments, "x_controller.proportional=0.2,0.3 V/mm", "--out", "warm.csv")
    begun = time.perf_counter()
    done(capsys, *arguments, "x_controller.proportional=0.1..0.5 V/mm:200", "--out", "s.csv")
    assert time.perf_counter() - begun < 10.0
