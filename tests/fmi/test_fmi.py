"""Machines and parts as FMUs, and FMUs as parts: one written in C for FMI 2.0, one made by PythonFMU3, and lathesim's own."""

import shutil
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from lathesim.cli.main import run_command_line
from lathesim.engine.wiring import wire
from lathesim.errors import LatheSimError, SimulationError
from lathesim.fmi.exporting import held_by_an_fmu
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare, run_prepared
from lathesim.plugins import load_registry
from lathesim.record import Record
from lathesim.workspace import mark_workspace
from tests.cli.command import call, done
from tests.shipped_machine import shipped_machine

fmpy = pytest.importorskip("fmpy")
from fmpy.simulation import instantiate_fmu  # noqa: E402
from fmpy.validation import validate_fmu  # noqa: E402

pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="an FMU is linked by a C compiler")

LESSON = """
lesson: An axis comes to rest
machine: cascade_axis
duration: 0.2 s
set: {x_axis.speed: 0.2 m/s}
"""
TABLE = """
add: {table: {component: FMU, file: table.fmu, set: {gain: 3 V}}}
wires: {table.speed: x_axis.velocity, table.brake: 0}
"""
LAG = """
import math
from pythonfmu3 import Float64, Fmi3Causality, Fmi3Slave, Fmi3Variability


class Lag(Fmi3Slave):
    def __init__(self, **given):
        super().__init__(**given)
        self.time, self.u, self.y, self.half_life = 0.0, 0.0, 0.0, 0.002
        self.register_variable(Float64("time", causality=Fmi3Causality.independent, variability=Fmi3Variability.continuous))
        self.register_variable(Float64("u", causality=Fmi3Causality.input, start=0.0))
        self.register_variable(Float64("half_life", causality=Fmi3Causality.parameter, variability=Fmi3Variability.fixed, start=0.002))
        self.register_variable(Float64("y", causality=Fmi3Causality.output))

    def do_step(self, time, step):
        self.y = self.u + (self.y - self.u) * 0.5 ** (step / self.half_life)
        return True
"""


def ran(folder: Path, further: str = "", **changes: str) -> Record:
    """Return the record of the lesson with further lines, run with the FMUs of a folder."""
    lesson = folder / "axis.yaml"
    lesson.write_text(LESSON + further, encoding="utf-8")
    return run_prepared(prepare(load_lesson(lesson), load_registry([folder], installed=False), overrides=changes))


def furthest(one: Record, other: Record) -> float:
    """Return how far two records of the same channels are apart."""
    assert len(one) == len(other)
    return max(float(np.max(np.abs(one[name] - other[name]))) for name in one.channels)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the table of another tool as an FMU."""
    made = tmp_path_factory.mktemp("fmus")
    here = Path(__file__).parent
    library = made / "table.so"
    subprocess.run(["cc", "-shared", "-fPIC", "-o", library, here / "table.c"], check=True)
    with zipfile.ZipFile(made / "table.fmu", "w") as archive:
        archive.write(here / "table.xml", "modelDescription.xml")
        archive.write(library, f"binaries/{fmpy.platform}/table{fmpy.sharedLibraryExtension}")
    return made


@pytest.fixture(scope="module")
def exported(folder: Path) -> Callable[..., Path]:
    """Return what exports the machine of the lesson, or one of its parts, to the folder."""

    def export(name: str, *arguments: str) -> Path:
        (folder / "lesson.yaml").write_text(LESSON, encoding="utf-8")
        assert run_command_line(["fmu", str(folder / "lesson.yaml"), "--out", str(folder / f"{name}.fmu"), *arguments]) == 0
        return folder / f"{name}.fmu"

    return export


@pytest.fixture(scope="module")
def machine(exported: Callable[..., Path]) -> Path:
    """Return the machine of the lesson as an FMU."""
    return exported("machine")


def test_a_machine_runs_in_another_tool_as_it_runs_here(folder: Path, machine: Path) -> None:
    assert validate_fmu(str(machine)) == []
    here = ran(folder, "wires: {x_controller.reference: 3 mm, x_axis.disturbance: 20 N}", **{"x_axis.mass": "80 kg"})
    given = {"x_controller.reference": 0.003, "x_axis.disturbance": 20.0, "x_axis.mass": 80.0}
    there = fmpy.simulate_fmu(str(machine), start_values=given, output=list(here.channels))
    assert [there[name] for name in here.channels] == [pytest.approx(here[name], rel=1e-9) for name in here.channels]
    assert float(there["time"][-1]) == pytest.approx(0.2)


def test_the_description_gives_units_and_start_values(machine: Path) -> None:
    described = fmpy.read_model_description(machine)
    variables = {item.name: item for item in described.modelVariables}
    mass, reference = variables["x_axis.mass"], variables["x_controller.reference"]
    assert (mass.causality, mass.unit, float(mass.start), float(mass.min)) == ("parameter", "kg", 95.1089, 1e-9)
    assert (reference.causality, reference.unit, float(reference.start)) == ("input", "m", 0.0)
    viscous = next(unit.baseUnit for unit in described.unitDefinitions if unit.name == variables["x_axis.viscous"].unit)
    assert (viscous.kg, viscous.m, viscous.s, viscous.factor) == (1, 0, -1, 1.0)
    follows = {item.variable.name: [known.name for known in item.dependencies] for item in described.outputs}
    assert follows["x_controller.voltage"] == ["x_controller.reference"]
    assert follows["x_axis.position"] == []


def test_outputs_follow_the_inputs_of_the_communication_point(machine: Path) -> None:
    """What was computed ahead is taken back where an input changes, and a step that does not fit is refused."""
    described = fmpy.read_model_description(machine)
    at = {item.name: [item.valueReference] for item in described.modelVariables}
    logged: list[str] = []
    slave = instantiate_fmu(fmpy.extract(machine), described, logger=lambda *given: logged.append(given[-1].decode()))
    seen = []
    for restless in (False, True, False):
        slave.reset()
        slave.enterInitializationMode()
        slave.exitInitializationMode()
        for step in range(20):
            for reference in (1.0, 0.001 * step) if restless else (0.001 * step,):
                slave.setFloat64(at["x_controller.reference"], [reference])
                voltage = slave.getFloat64(at["x_controller.voltage"])
            slave.doStep(step * 0.001, 0.001)
        seen.append((*voltage, *slave.getFloat64(at["x_axis.position"])))
    assert seen[0] == seen[1] == seen[2]
    for call_of, given in ((slave.doStep, (0.02, 0.0015)), (slave.doStep, (0.5, 0.001)), (slave.setFloat64, (at["x_axis.mass"], [1.0]))):
        with pytest.raises(fmpy.fmi1.FMICallException):
            call_of(*given)
    assert logged[0] == "a step of 0.0015 s is no multiple of 0.001 s."
    slave.freeInstance()


def test_a_part_that_goes_out_and_comes_in_gives_the_same_record(
    folder: Path, exported: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    exported("loop", "--part", "x_controller", "--set", "x_controller.integral_rate=20 1/s")
    said = capsys.readouterr()
    counts = "inputs: 2, outputs: 1, parameters: 6; steps of 0.001 s."
    assert said.out.endswith(f"loop.fmu: FMI 3.0, co-simulation, {fmpy.platform_tuple}; {counts}\n")
    changed = {"x_controller.integral_rate": "20 1/s"}
    before, after = ran(folder, **changed), ran(folder, "replace: {x_controller: loop.fmu}", **changed)
    assert (furthest(before, after), after.meta["engine"]) == (pytest.approx(0.0, abs=1e-9), "plain")
    assert float(np.ptp(after["x_controller.voltage"])) > 1.0


@pytest.mark.parametrize(("part", "held"), [("x_drive", ["x_drive.velocity", "x_drive.effort"]), ("x_encoder", []), ("x_dac", [])])
def test_what_moves_between_samples_is_said_to_be_held(part: str, held: list[str]) -> None:
    assert list(held_by_an_fmu(wire(shipped_machine("cascade_axis")), part)) == held


def test_an_fmu_of_another_tool_is_a_part(folder: Path) -> None:
    """Millimetres, a truth value and a parameter of FMI 2.0; the step takes the speed that held since the instant before."""
    run = ran(folder, TABLE)
    speed = run["x_axis.velocity"]
    travelled = np.concatenate(([0.0], np.cumsum(speed[:-1]))) * 0.001
    assert run["table.position"] == pytest.approx(travelled, abs=1e-12)
    assert run["table.mirror"] == pytest.approx(3.0 * speed, abs=1e-12)
    assert not ran(folder, TABLE.replace("brake: 0", "brake: 1"))["table.position"].any()
    assert run.channels["table.position"].unit == "m"


def test_an_fmu_that_is_sampled_less_often_holds_its_outputs(folder: Path) -> None:
    run = ran(folder, TABLE + "every: {table: 4}\n")
    held = np.repeat(run["table.mirror"][::4], 4)[: len(run)]
    assert run["table.mirror"] == pytest.approx(held)
    assert run["table.mirror"][:200:4] == pytest.approx(3.0 * run["x_axis.velocity"][:200:4])


def test_an_fmu_made_by_pythonfmu3_runs_in_a_lesson(folder: Path, tmp_path: Path) -> None:
    pytest.importorskip("pythonfmu3")
    (tmp_path / "lag.py").write_text(LAG, encoding="utf-8")
    command = [sys.executable, "-m", "pythonfmu3", "build", "-f", str(tmp_path / "lag.py"), "-d", str(folder)]
    subprocess.run(command, check=True, capture_output=True)
    run = ran(folder, "add: {lag: {component: FMU, file: Lag.fmu, set: {half_life: 0.001}}}\nwires: {lag.u: 0.5}")
    assert run["lag.y"] == pytest.approx(0.5 - 0.5 ** np.arange(1.0, len(run) + 1.0), abs=1e-9)


@pytest.mark.parametrize(
    ("further", "sentence"),
    [
        ("replace: {x_controller: gone.fmu}", "there is no FMU 'gone.fmu' among the plug-ins. It is code, so put it in plugins/"),
        ("replace: {x_controller: tabel.fmu}", "there is no FMU 'tabel.fmu' among the plug-ins. Did you mean 'table.fmu'?"),
        ("add: {table: {component: FMU, file: table.fmu}}\nwires: {table.brake: 0}", "nothing feeds table.speed (table.speed). Add a wire"),
        ("add: {table: {component: FMU}}", "an FMU needs both lines. Write component: FMU, file: NAME.fmu."),
        (TABLE.replace("x_axis.velocity", "x_axis.position"), "units differ, m/s against m."),
        ("add: {table: {component: FMU, file: text.fmu}}", "text.fmu: it is no FMU: File is not a zip file."),
        ("add: {table: {component: FMU, file: old.fmu}}", "it is an FMU of FMI 1.0, and those of 2.0 and 3.0 are read."),
        ("add: {table: {component: FMU, file: exchange.fmu}}", "exchange.fmu: the FMU offers no co-simulation"),
        ("add: {table: {component: FMU, file: elsewhere.fmu}}", f"the FMU has no library for {fmpy.platform}, only for win32."),
    ],
)
def test_what_cannot_be_a_part(folder: Path, further: str, sentence: str) -> None:
    text = (Path(__file__).parent / "table.xml").read_text(encoding="utf-8")
    (folder / "text.fmu").write_text("no archive", encoding="utf-8")
    exchange = text.replace("CoSimulation", "ModelExchange")
    old = text.replace('fmiVersion="2.0"', 'fmiVersion="1.0"')
    for name, description in (("old", old), ("exchange", exchange), ("elsewhere", text)):
        with zipfile.ZipFile(folder / f"{name}.fmu", "w") as archive:
            archive.writestr("modelDescription.xml", description)
            archive.writestr("binaries/win32/table.dll", "")
    with pytest.raises(LatheSimError) as refused:
        ran(folder, further)
    assert sentence in str(refused.value)


def test_what_an_fmu_logs_is_said_and_the_data_are_kept(folder: Path) -> None:
    sentence = r"table failed at t = 0\.\d+ s in table\.fmu\.update .*: the table is too fast; it was given"
    with pytest.raises(SimulationError, match=sentence) as failed:
        ran(folder, TABLE, **{"x_controller.reference": "1 km"})
    assert isinstance(failed.value.record, Record)
    assert len(failed.value.record) > 2


def test_a_parameter_that_a_wire_changes_is_refused(folder: Path) -> None:
    with pytest.raises(SimulationError, match=r"a parameter changes during the run, and those of table\.fmu are fixed"):
        ran(folder, TABLE.replace("table.brake: 0", "table.brake: 0, table.gain: x_dac.voltage"))


def test_a_lesson_alone_loads_no_fmu(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """An FMU is code: one beside the lesson, or in a folder that nobody made a workspace, is not loaded."""
    (tmp_path / "plugins").mkdir()
    for place in (tmp_path, tmp_path / "plugins"):
        shutil.copy(folder / "table.fmu", place)
    (tmp_path / "mine.yaml").write_text(LESSON + TABLE, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    said = call(capsys, "run", "mine.yaml", "--no-plots")
    assert (said.code, "there is no FMU 'table.fmu' among the plug-ins." in said.err) == (1, True)
    assert "has plug-ins of its own (table.fmu)" in call(capsys, "init", ".").err
    mark_workspace(tmp_path)
    done(capsys, "run", "mine.yaml", "--no-plots")
    assert call(capsys, "check", "plugins/table.fmu").out == "plugins/table.fmu: 1 plug-in OK.\n"
    page = call(capsys, "components", "table.fmu").out
    assert page.startswith("table.fmu\n")
    assert "\n  mirror    [m/s]    a share of the speed\n" in page
    assert "Source: a C compiler, FMI 2.0, co-simulation. Left out: nothing that the description names." in page
    assert page.endswith("From plugins/table.fmu.\n")


def test_without_fmpy_one_sentence_says_what_to_install(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "fmpy", None)
    shutil.copy(folder / "table.fmu", folder / "unread.fmu")
    with pytest.raises(LatheSimError, match=r"unread\.fmu needs fmpy, which is not installed\. .*pip install 'lathesim\[fmi\]'"):
        ran(folder, "add: {table: {component: FMU, file: unread.fmu}}")


def test_without_a_c_compiler_one_sentence_says_what_to_install(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "lesson.yaml").write_text(LESSON, encoding="utf-8")
    monkeypatch.setattr(shutil, "which", lambda name: None)
    said = call(capsys, "fmu", folder / "lesson.yaml", "--out", folder / "no.fmu")
    assert (said.code, said.err) == (1, "an FMU is linked by a C compiler, and there is none. Install gcc or clang, or name one in CC.\n")
    assert call(capsys, "fmu", folder / "lesson.yaml", "--out", folder / "no.zip").err.endswith(f"Write --out {folder / 'no.fmu'}.\n")
