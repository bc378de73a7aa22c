"""A closed controller learnt from way-points at 10 Hz."""

import json
import signal
from pathlib import Path

import numpy as np
import pytest

from lathesim.engine.assembly import FloatArray
from lathesim.experiments.objective import Objective
from lathesim.experiments.waypoints import read_waypoints
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare, run_prepared
from lathesim.plugins import Registry
from tests.cli.command import call, done, refused

LESSON = "27_a_controller_that_tells_nothing"
CHANGED = {"x_element_1.gain": 0.03, "x_controller.loop_gain": 24.0, "x_element_3.frequency": 50.0}


def write_waypoints(place: Path, registry: Registry, variant: str, noise: float, seconds: float) -> None:
    """Write uneven way-points of a machine with other values than the lesson's."""
    record = run_prepared(prepare(load_lesson(LESSON), registry, variant, CHANGED), engine="compiled")
    random = np.random.default_rng(5)
    time = np.arange(0.0, seconds, 0.1) + random.uniform(0.0, 0.03, round(seconds * 10))
    columns = [np.interp(time, record.time, record[name]) * 1e3 for name in ("x_axis.position", "y_axis.position")]
    columns = [column + random.normal(0.0, noise * 1e3, len(time)) for column in columns]
    np.savetxt(place, np.column_stack([time, *columns]), delimiter=",", header="time,x,y", comments="", fmt="%.5f")


@pytest.fixture(scope="module")
def waypoints(tmp_path_factory: pytest.TempPathFactory, registry: Registry) -> Path:
    folder = tmp_path_factory.mktemp("waypoints")
    write_waypoints(folder / "three_speeds.csv", registry, "three_speeds", 10e-6, 27.0)
    write_waypoints(folder / "staircase.csv", registry, "staircase", 10e-6, 24.0)
    return folder


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory, registry: Registry) -> Path:
    """Nine seconds of the staircase."""
    place = tmp_path_factory.mktemp("short") / "staircase.csv"
    write_waypoints(place, registry, "staircase", 10e-6, 9.0)
    return place


@pytest.mark.parametrize(
    ("given", "name"),
    [("", "staircase"), ("three_speeds=", "three_speeds"), ("../part_programs/closed_controller_diamond.nc=", "closed_controller_diamond")],
    ids=["by its file", "by a variant", "by a part program"],
)
def test_way_points_are_called_as_what_was_run(registry: Registry, short: Path, given: str, name: str) -> None:
    assert read_waypoints(load_lesson(LESSON), f"{given}{short}", registry).name == name


def test_way_points_beside_a_recorded_reference_are_read(registry: Registry, tmp_path: Path) -> None:
    rows = [f"{0.1 * row:.1f},{row},{row},{row},0,0" for row in range(30)]
    file = tmp_path / "axis.csv"
    file.write_text("\n".join(["time,reference,motor,table,voltage,current", *rows]), encoding="utf-8")
    read = read_waypoints(load_lesson("22_what_is_wrong_with_this_machine"), str(file), registry)
    assert "x_scale.position" in read.channels
    assert "x_controller.reference" not in read.channels


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_emulated_machine_follows_a_program_that_was_not_fitted(
    capsys: pytest.CaptureFixture[str], waypoints: Path, tmp_path: Path
) -> None:
    said = call(
        capsys,
        "emulate", LESSON, waypoints / "three_speeds.csv", "--validate", waypoints / "staircase.csv", "--out", tmp_path / "e",
        "--json",
    )  # fmt: skip
    assert said.code == 0, said.err
    told = json.loads((tmp_path / "e" / "emulation.json").read_text())
    assert told["schema"] == "lathesim-emulation/1"
    assert told["recordings"][0]["rms_m"] < 16e-6 < told["recordings"][0]["rms_given_m"]
    (unseen,) = told["unseen"]
    assert max(unseen["rms"].values()) < 12e-6
    assert 0.9 < unseen["in_band"] < 0.985
    hidden = " ".join(item["sentence"] for item in told["directions"]["hidden"])
    for gain in ("x_speed_controller.gain", "x_power_controller.gain", "x_controller.loop_gain"):
        assert f"Only the products of {gain} with each of" in hidden
    done(capsys, "check", str(tmp_path / "e" / "lesson.yaml"))


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ("0,0,0\n0.1,1,0\n0.2,2,0\n", "the recording has 3 way-points. Record at least 20, while the axes move."),
        ("".join(f"{row / 10},5,5\n" for row in range(40)), "nothing moves in the recording. Record a program that moves the axes."),
    ],
)
def test_recordings_that_tell_nothing_are_refused(capsys: pytest.CaptureFixture[str], tmp_path: Path, rows: str, message: str) -> None:
    (tmp_path / "r.csv").write_text(f"time,x,y\n{rows}")
    assert message in refused(capsys, "emulate", LESSON, str(tmp_path / "r.csv"), "--out", str(tmp_path / "e")).err
    assert not (tmp_path / "e").exists()


def test_unknown_program_is_refused(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    said = refused(capsys, "emulate", LESSON, f"stairs={tmp_path / 'r.csv'}", "--out", str(tmp_path / "e"))
    assert "'stairs' is neither a variant of the lesson nor a part program." in said.err


@pytest.mark.slow
def test_clock_that_runs_apart_is_told(capsys: pytest.CaptureFixture[str], short: Path, tmp_path: Path) -> None:
    rows = np.loadtxt(short, delimiter=",", skiprows=1)
    rows[:, 0] *= 1.02
    rows[[3, 4]] = rows[[4, 3]]
    np.savetxt(tmp_path / "fast.csv", rows, delimiter=",", header="time,x,y", comments="", fmt="%.5f")
    few = ("--method", "genetic", "--population", "8", "--generations", "1", "--free", "x_controller.loop_gain", "--keep-structure")
    assert "its clock runs" not in call(capsys, "emulate", LESSON, short, *few, "--out", tmp_path / "e").err
    said = call(capsys, "emulate", LESSON, tmp_path / "fast.csv", *few, "--out", tmp_path / "e")
    assert "rows were out of order in time; they were sorted." in said.err
    assert "fast.csv: its clock runs 2 % fast against the program as simulated, 181 ms after 9.09 s. Correct its time column" in said.err
    told = json.loads((tmp_path / "e" / "emulation.json").read_text())
    assert [sentence.partition(":")[0] for sentence in told["clocks"]] == [str(told["recordings"][0]["name"]) + ".csv"]
    assert "its clock runs 2 % fast" in (tmp_path / "e" / "report.html").read_text()


@pytest.mark.slow
@pytest.mark.filterwarnings("default")
def test_the_workers_of_a_cluster_learn_the_same(capsys: pytest.CaptureFixture[str], short: Path, tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    files = [f"{program}={short}" for program in ("staircase", "three_speeds")]
    free = ("--free", "x_element_1.gain,x_controller.loop_gain", "--keep-structure")
    told = []
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        for name, where in (("here", ()), ("there", ("--cluster", cluster.scheduler_address))):
            done(capsys, "emulate", LESSON, *files, *free, "--out", tmp_path / name, *where)
            told.append(json.loads((tmp_path / name / "emulation.json").read_text()))
    assert [{**data, "wall_time_s": 0.0} for data in told[1:]] == [{**told[0], "wall_time_s": 0.0}]


def test_stopped_emulation_keeps_the_best_machine_so_far(
    capsys: pytest.CaptureFixture[str], short: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    costs = Objective.costs
    populations: list[int] = []

    def interrupted_in_the_third(objective: Objective, points: FloatArray) -> FloatArray:
        populations.append(len(points))
        if len(populations) == 3:
            signal.raise_signal(signal.SIGINT)
        return costs(objective, points)

    monkeypatch.setattr(Objective, "costs", interrupted_in_the_third)
    # A shell starts its background jobs with Ctrl-C ignored, and children inherit that.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    said = call(
        capsys,
        "emulate", LESSON, short, "--method", "genetic", "--population", "8", "--free", "x_controller.loop_gain,x_element_1.gain",
        "--out", tmp_path / "e",
    )  # fmt: skip
    signal.signal(signal.SIGINT, before)
    assert said.code == 130, said.err
    assert len(populations) == 3
    assert "Stopped: this is the best machine so far." in said.out
    told = json.loads((tmp_path / "e" / "emulation.json").read_text())
    assert told["stopped"]
    assert told["recordings"][0]["rms_m"] <= told["recordings"][0]["rms_given_m"]
    assert load_lesson(str(tmp_path / "e" / "lesson.yaml")).title
