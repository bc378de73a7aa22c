"""``lathesim run``: what it writes, where it leaves it, and how it ends."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from lathesim.record import load
from tests.cli.command import PUSHED, call, done, environment, json_of, refused

ONE = ("run", "01_contour_error", "--variant", "I", "--plain")

ENDLESS = """\
lesson: A table that is pushed for hours
machine: pushed
duration: 100000 s
"""


def test_json_of_one_case(capsys: pytest.CaptureFixture[str]) -> None:
    said = call(capsys, *ONE, "--json", "--no-plots")
    assert (said.code, said.err) == (0, "")
    result = json.loads(said.out)
    assert result["schema"] == "lathesim-run/1"
    assert (result["lesson"], result["variant"], result["engine"], result["status"]) == ("01_contour_error", "I", "plain", "complete")
    assert result["record"] == "lathesim_runs/01_contour_error/01_contour_error_I.h5"
    assert 0.0 < result["wall_time_s"] < 60.0
    wanted = {
        "cycle_time": "s",
        "max_contour_error": "m",
        "contour_error_squared_integral": "m^2*s",
        "max_surface_roughness": "m",
        "max_cutting_force": "N",
    }
    assert {name: result["metrics"][name]["unit"] for name in wanted} == wanted
    assert result["metrics"]["cycle_time"]["value"] == 18.48
    assert not list(Path("lathesim_runs").rglob("*.png"))


def test_the_record_tells_how_to_run_it_again(capsys: pytest.CaptureFixture[str]) -> None:
    done(capsys, *ONE, "--no-plots", "--set", "x_controller.proportional=0.3 V/mm", "--seed", "11", "--out", "own.h5")
    record = load("own.h5")
    assert record.meta["lesson_name"] == "01_contour_error"
    assert "variants:" in str(record.meta["lesson"])
    assert record.meta["variant"] == "I"
    assert record.meta["overrides"] == "x_controller.proportional=0.3 V/mm"
    assert record.meta["seed"] == 11
    assert record.meta["status"] == "complete"
    assert Path(str(record.meta["program"])).name == "liu_landers_2004_example_1.nc"
    assert record.unit("x_axis.position") == "m"


def test_a_case_is_told_with_published_values_goal_and_plots(capsys: pytest.CaptureFixture[str]) -> None:
    said = done(capsys, *ONE)
    lines = {line.partition("  ")[0]: line.split("  ")[1:] for line in said.out.splitlines()}
    assert [cell.strip() for cell in lines["cycle time"] if cell] == ["18.48 s", "18.48 s"]
    assert "max contour error  at most 0.2 mm  0.68508 mm  missed by 0.485 mm (243 %)" in said.out
    assert "Hint: Raise the proportional gain of both axes." in said.out
    assert "1 record and 4 plots in lathesim_runs/01_contour_error" in said.out
    names = sorted(path.name for path in Path("lathesim_runs/01_contour_error").glob("*.png"))
    assert names == [f"01_contour_error_I_{name}.png" for name in ("contour_error", "path", "surface", "voltages")]


def test_without_a_variant_all_run_and_a_table_compares_them(capsys: pytest.CaptureFixture[str]) -> None:
    write_short_program()
    said = done(capsys, "run", "01_contour_error", "--plain", "--no-plots", "--program", "short.nc")
    table = said.out.splitlines()
    assert " ".join(table[0].split()) == (
        "case cycle time published max contour error published contour error squared integral published goals"
    )
    assert [line.split()[0] for line in table[2:8]] == ["I", "II", "III", "IV", "V", "VI"]
    assert "6 records and no plots in" in said.out


def test_json_of_all_cases_repeats_the_first_at_the_top(capsys: pytest.CaptureFixture[str]) -> None:
    write_short_program()
    result = json.loads(
        call(capsys, "run", "01_contour_error", "--plain", "--no-plots", "--json", "--program", "short.nc", "--out", "r.h5").out
    )
    assert list(result["variants"]) == ["I", "II", "III", "IV", "V", "VI"]
    assert result["metrics"] == result["variants"]["I"]["metrics"]
    assert result["variants"]["II"]["record"] == "r_II.h5"
    assert Path("r_VI.h5").is_file()


def write_short_program() -> None:
    Path("short.nc").write_text("G90 G94 G71\nG00 X17 Z14\nM03 S1000 G01 Z20 F600\nM30\n", encoding="utf-8")


AIR = """\
G90 G95 G71
G97 S1200 M03
G00 X25.0 Z14.0
G01 Z17.0 F0.5
G00 X26.0
M30
"""
IN_THE_AIR = re.compile(
    r"othing was cut: the program leads the tool no nearer to the stock than 7 mm, at a radius of 25 mm and z = 15\.?\d* mm in line 4 of "
    r"air\.nc; take it to a radius below 18 mm at feed, or set stock\.stock_radius to more than 25 mm\."
)


def test_a_program_that_never_meets_the_stock_is_told_and_reaches_no_goal_of_cutting(capsys: pytest.CaptureFixture[str]) -> None:
    Path("air.nc").write_text(AIR, encoding="utf-8")
    asked = ("run", "10_feed_and_roughness", "--program", "air.nc", "--plain", "--no-plots")
    said = call(capsys, *asked, "--variant", "start", "--out", "air.h5")
    assert (said.code, said.err) == (0, "")
    assert len(IN_THE_AIR.findall(said.out)) == 1
    table = [line.split("  ") for line in said.out.splitlines()]
    cells = {line[0]: [cell.strip() for cell in line[1:] if cell.strip()] for line in table}
    assert "max surface roughness           no value: nothing was cut\n" in said.out
    assert cells["max surface roughness"] == ["at most 1.6 um", "-", "not reached: nothing was cut"]
    assert cells["max cutting force"] == ["at most 1.42 kN", "-", "not reached: nothing was cut"]
    assert cells["cycle time"][-1] == "met"
    assert "Hint" not in said.out
    result = json_of(capsys, *asked, "--variant", "start", "--json")
    assert IN_THE_AIR.fullmatch(result["nothing_cut"].removeprefix("n"))
    for name, unit in (("max_surface_roughness", "m"), ("max_cutting_force", "N"), ("removed_volume", "m^3"), ("max_contour_error", "m")):
        assert result["metrics"][name] == {"value": None, "unit": unit, "reason": "no value: nothing was cut"}
    graded = call(capsys, "grade", "10_feed_and_roughness", "air.h5")
    assert len(IN_THE_AIR.findall(graded.out)) == 1
    assert "1 of 3 goals met: missed." in graded.out
    (told,) = json_of(capsys, "grade", "10_feed_and_roughness", "air.h5", "--json")["records"]
    goal = told["goals"][0]
    assert (goal["met"], goal["value"], goal["missed_by"], goal["reason"]) == (False, None, None, "no value: nothing was cut")
    all_cases = call(capsys, *asked)
    assert "\nstart, " in all_cases.out
    assert 1 <= len(IN_THE_AIR.findall(all_cases.out)) < 5  # cases with the same sentence share it
    assert [line.split()[3:6] for line in all_cases.out.splitlines()[2:7]] == [["no", "value", "no"]] * 5


def test_a_program_that_cuts_is_not_told_to_cut_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    write_short_program()
    said = call(capsys, *ONE, "--no-plots", "--program", "short.nc")
    assert "nothing was cut" not in said.out
    assert "nothing_cut" not in json_of(capsys, *ONE, "--no-plots", "--program", "short.nc", "--json")


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["run", "02_nothing"], "there is no lesson '02_nothing'. See 'lathesim lessons'."),
        ([*ONE, "--program", "none.nc"], "there is no part program 'none.nc'."),
        (["run", "01_contour_error", "--variant", "X"], "the lesson has no variant 'X'. It has I, II, III, IV, V, VI."),
        (
            [*ONE, "--set", "x_axis.time_constnt=20 ms"],
            "--set x_axis.time_constnt=20 ms: x_axis has no parameter 'time_constnt'. Did you mean 'time_constant'?",
        ),
        ([*ONE, "--set", "x_axis.time_constant=20"], "'20' has no unit. Write it with one, for example '20 s'."),
        ([*ONE, "--plugins", "nowhere"], "there is no plug-in folder 'nowhere'."),
    ],
)
def test_wrong_input_gets_one_message_and_leaves_with_one(arguments: list[str], sentence: str, capsys: pytest.CaptureFixture[str]) -> None:
    said = refused(capsys, *arguments)
    assert said.err.rstrip("\n").endswith(sentence)
    assert said.err.count("\n") == 1
    assert said.out == ""


def test_a_wrong_program_names_file_and_line(capsys: pytest.CaptureFixture[str]) -> None:
    Path("wrong.nc").write_text("G90 G94 G71\nG01 X10 Z10\n", encoding="utf-8")
    assert refused(capsys, *ONE, "--program", "wrong.nc").err.startswith("wrong.nc:2: ")


def test_an_output_folder_that_cannot_be_made_is_refused_before_the_run(capsys: pytest.CaptureFixture[str]) -> None:
    Path("taken").write_text("a file", encoding="utf-8")
    assert refused(capsys, *ONE, "--out", "taken/run.h5").err == "taken: 'taken' is no folder. Choose another place.\n"


def test_a_full_disk_is_told(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    import resource

    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    ignored = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, before[1]))
    try:
        said = call(capsys, *ONE, "--no-plots", "--out", "full.h5")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, ignored)
    assert said.code == 1
    assert said.err.startswith("full.h5: ")
    assert not Path("full.h5").exists()


BURSTING = """\
machine: A mass that is pushed away ever harder
sample_period: 5 ms
step: 1 ms
parts: {burst: {component: Burst}}
"""
BURST = """\
from lathesim.component import Component, Output, State, Parameter
from lathesim.hookspecs import hookimpl


class Burst(Component):
    \"\"\"Gives a position that runs away:  dx/dt = rate x x.\"\"\"

    travel = State("m", 1.0, doc="position")
    rate = Parameter("1/(m*s)", 0.0, doc="how fast it runs away")
    position = Output("m", doc="position")

    @staticmethod
    def derivative(travel: float, rate: float) -> float:
        return rate * travel * travel

    @staticmethod
    def output(travel: float) -> float:
        return travel


@hookimpl
def register_components():
    return [Burst]
"""


def test_a_case_that_breaks_down_is_reported_and_the_others_go_on(capsys: pytest.CaptureFixture[str]) -> None:
    for name, text in (("machines/bursting.yaml", BURSTING), ("plugins/burst.py", BURST)):
        Path(name).parent.mkdir()
        Path(name).write_text(text, encoding="utf-8")
    variants = "variants:\n  calm: {}\n  wild: {set: {burst.rate: 1 1/(m*s)}}\n  last: {}\n"
    Path("burst.yaml").write_text(f"lesson: Burst\nmachine: bursting\nduration: 2 s\n{variants}", encoding="utf-8")
    call_it = ("run", "burst.yaml", "--plugins", "plugins", "--plain", "--no-plots")
    said = refused(capsys, *call_it)
    assert said.err.startswith("burst_wild: burst.travel stopped being a number at t = 1.")
    assert said.err.endswith("The data up to then are kept. See lathesim_runs/burst/burst_wild.h5.\n")
    assert [line.split()[:2] for line in said.out.splitlines()[2:5]] == [["calm", "2"], ["wild", "broke"], ["last", "2"]]
    kept = load("lathesim_runs/burst/burst_wild.h5")
    assert kept.status.startswith("failed: burst.travel stopped being a number")
    assert 0.9 < kept.time[-1] < 2.0
    Path("burst.yaml").write_text(
        Path("burst.yaml").read_text(encoding="utf-8").replace("wild: {", "wild: {breaks_down: true, "), encoding="utf-8"
    )
    done(capsys, *call_it)


def test_stopped_in_the_middle_the_record_is_kept(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    @contextmanager
    def impatient(*_: object, **__: object) -> Iterator[object]:
        def told(simulated: float) -> None:
            if simulated > 3.0:
                raise KeyboardInterrupt

        yield told

    monkeypatch.setattr("lathesim.cli.progress.progress_bar", impatient)
    said = call(capsys, "run", "01_contour_error", "--plain", "--no-plots")
    assert said.code == 130
    assert said.err.startswith("Stopped at ")
    assert said.err.endswith("what was simulated until then is kept in lathesim_runs/01_contour_error/01_contour_error_I.h5.\n")
    record = load("lathesim_runs/01_contour_error/01_contour_error_I.h5")
    assert record.status == "stopped"
    assert 3.0 < record.time[-1] < 18.0
    assert not Path("lathesim_runs/01_contour_error/01_contour_error_II.h5").exists()


def test_ctrl_c_from_a_terminal_leaves_with_130(tmp_path: Path) -> None:
    Path("machines").mkdir()
    Path("machines/pushed.yaml").write_text(PUSHED, encoding="utf-8")
    Path("endless.yaml").write_text(ENDLESS, encoding="utf-8")
    command = [sys.executable, "-m", "lathesim", "run", "endless.yaml", "--plain", "--no-plots", "--out", "runs/endless.h5"]
    process = subprocess.Popen(
        command,
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env=environment(),
        cwd=tmp_path,
        # A shell starts its background jobs with Ctrl-C ignored, and children inherit that.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    deadline = time.monotonic() + 30.0
    while not Path("runs").is_dir() and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.02)
    time.sleep(1.0)
    os.kill(process.pid, signal.SIGINT)
    _, told = process.communicate(timeout=30)
    assert process.returncode == 130, told
    assert "what was simulated until then is kept in runs/endless.h5." in told
    assert load("runs/endless.h5").status == "stopped"
