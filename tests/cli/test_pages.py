"""The commands that tell what there is: lessons, components, effects, plug-ins, wiring, schema; and check and init."""

import json
import typing
from pathlib import Path

import pytest

from lathesim.cli.main import run_command_line
from lathesim.lessons.schema import CourseUnit
from tests.cli.command import ROOT, call, done, refused

Capture = pytest.CaptureFixture[str]


def test_lessons_names_unit_minutes_level_title_and_variants(capsys: Capture) -> None:
    said = done(capsys, "lessons")
    lines = said.out.splitlines()
    assert lines[:2] == [
        "basics",
        "  01_contour_error                    40 min  beginner      Servo control and contour error  [I, II, III, IV, V, VI]",
    ]
    assert [line for line in lines if not line.startswith(" ")] == list(typing.get_args(CourseUnit))


def test_a_former_name_of_a_lesson_is_as_good_and_the_new_one_is_said(capsys: Capture) -> None:
    said = done(capsys, "wiring", "05_integral_windup")
    assert said.err == "The lesson '05_integral_windup' is now called '03_integral_windup'.\n"
    Path("lesson_configs").mkdir()
    Path("lesson_configs/05_integral_windup.yaml").write_text(
        "lesson: Mine\nmachine: turning_with_chatter\nduration: 1 s\n", encoding="utf-8"
    )
    assert call(capsys, "wiring", "05_integral_windup").err == ""


def test_lessons_tells_a_lesson_at_fault_and_goes_on(capsys: Capture) -> None:
    Path("lesson_configs").mkdir()
    Path("lesson_configs/00_mine.yaml").write_text("lesson: Mine\nmachin: two_axis_lathe\n", encoding="utf-8")
    said = refused(capsys, "lessons")
    assert said.err == "lesson_configs/00_mine.yaml:2:1: there is no key 'machin' here. Did you mean 'machine'?\n"
    assert said.out.startswith("basics\n  01_contour_error ")


def test_components_lists_every_stock_part_in_one_line_each(capsys: Capture) -> None:
    said = done(capsys, "components")
    names = [line.split()[0] for line in said.out.splitlines()]
    assert names == sorted(names)
    assert {"EmpiricalAxis", "PositionController", "ConstantVelocityInterpolator"} <= set(names)


def test_the_page_of_a_component_has_equation_units_and_bounds(capsys: Capture) -> None:
    page = call(capsys, "components", "EmpiricalAxis").out
    assert "tau dv/dt + v = K V - Kd F" in page
    assert "voltage  [V]  must be wired" in page
    assert "gain              [m/(s*V)]  0.01878 (at least 0)" in page
    assert "derivative(speed, voltage, force, gain, time_constant, disturbance_gain)" in page
    assert page.rstrip().endswith("From lathesim.components.axes.")


def test_a_component_that_is_none(capsys: Capture) -> None:
    said = call(capsys, "components", "EmpiricalAxes")
    assert (said.code, said.out) == (1, "")
    assert said.err == "there is no component 'EmpiricalAxes'. Did you mean 'EmpiricalAxis'?\n"


def test_effects_are_listed_by_number_of_the_catalogue(capsys: Capture) -> None:
    lines = call(capsys, "effects").out.splitlines()
    numbers = [int(line.split()[0]) for line in lines if not line.strip().startswith("-")]
    assert numbers == sorted(numbers)
    assert lines[0].split()[:3] == ["1", "CoulombFriction", "reversal"]


def test_the_page_of_an_effect_says_what_it_is_known_by(capsys: Capture) -> None:
    page = call(capsys, "effects", "CoulombFriction").out
    for title in (
        "Catalogue      1",
        "Family         reversal",
        "Vanishes with  level = 0",
        "Fingerprint ",
        "Confused with",
        "Told apart by",
        "Source ",
    ):
        assert f"\n{title}" in page
    assert page.rstrip().endswith("insert: [{effect: CoulombFriction, at: x_axis}]")
    assert "Fitted anew" not in page
    assert "\nFitted anew    in each recording: phase, second_phase\n" in call(capsys, "effects", "Cogging").out


IN_NO_SAMPLED_LOOP = {"BeltSlip"}
"""Effects that answer at once to a force which depends on what they change; they need a machine in which that force has a state."""
MACHINES = {"ServoLag": "led_axis"}
"""Machines of effects that no axis of the lathe has a port for."""


@pytest.mark.slow
def test_the_example_line_of_every_effect_can_be_pasted_into_a_lesson(capsys: Capture) -> None:
    from lathesim.plugins import load_registry

    for name in sorted(load_registry(installed=False).effects.keys() - IN_NO_SAMPLED_LOOP):
        line = call(capsys, "effects", name).out.rstrip().splitlines()[-1].partition("insert:")[2]
        lathe = "two_axis_lathe_analytical\nprogram: liu_landers_2004_example_1.nc"
        text = f"lesson: Pasted\nmachine: {MACHINES.get(name, lathe)}\ninsert: {line}\n"
        Path("lesson.yaml").write_text(text, encoding="utf-8")
        assert run_command_line(["check", "lesson.yaml"]) == 0, capsys.readouterr().err


def test_wiring_tells_what_feeds_each_input(capsys: Capture) -> None:
    text = call(capsys, "wiring", "01_contour_error", "--variant", "II").out
    assert "\nx_dac: DAConverter\n" in text
    block = text.partition("\nx_controller: PositionController\n")[2].partition("\n\n")[0]
    rows = [line.split() for line in block.splitlines()]
    assert ["reference", "[m]", "<-", "interpolator.x_reference"] in rows
    assert ["proportional", "[V/m]", "=", "449"] in rows
    assert ["voltage", "[V]", "->", "x_dac.command"] in rows


def test_wiring_as_a_mermaid_graph(capsys: Capture) -> None:
    lines = call(capsys, "wiring", "01_contour_error", "--mermaid").out.splitlines()
    assert lines[0] == "flowchart LR"
    assert '    x_axis["x_axis<br/><i>EmpiricalAxis</i>"]' in lines
    assert '    x_dac -->|"voltage [V]"| x_axis' in lines


def test_wiring_as_source_is_python_that_compiles(capsys: Capture) -> None:
    source = call(capsys, "wiring", "01_contour_error", "--source").out
    compile(source, "fused", "exec")
    assert "def run_block(" in source


def test_wiring_shows_a_changed_machine(capsys: Capture) -> None:
    text = call(capsys, "wiring", "01_contour_error", "--set", "x_dac.bits=12").out
    block = text.partition("\nx_dac: DAConverter\n")[2].partition("\n\n")[0]
    assert ["bits", "[1]", "=", "12"] in [line.split() for line in block.splitlines()]


@pytest.mark.parametrize("kind", ["lesson", "machine"])
def test_schema_is_json_schema_for_the_files_that_ship(kind: str, capsys: Capture) -> None:
    schema = json.loads(call(capsys, "schema", kind).out)
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    assert schema["additionalProperties"] is False
    required = {"lesson": ["lesson", "machine"], "machine": ["machine", "parts", "sample_period", "step"]}
    assert sorted(schema["required"]) == required[kind]
    assert ("try" in schema["properties"]) == (kind == "lesson")


def test_check_says_in_one_line_each_what_a_file_is(capsys: Capture) -> None:
    files = ["lesson_configs/01_contour_error.yaml", "lesson_configs/machines/two_axis_lathe.yaml", "part_programs/straight_turning.nc"]
    said = done(capsys, "check", *(ROOT / file for file in files))
    told = [line.partition(": ")[2] for line in said.out.splitlines()]
    assert len(told) == len(files)
    assert told[0] == "a lesson on the machine two_axis_lathe, 6 variants."
    assert told[1].startswith("a machine template with ")
    assert told[2].startswith("a part program with ")


def test_check_names_the_line_of_a_law_that_a_batch_computes_one_run_after_the_other(capsys: Capture) -> None:
    text, line = (ROOT / "plugins/sandoval_force.py").read_text(encoding="utf-8"), "        speed = cutting_speed / METRE_PER_MINUTE\n"
    Path("part.py").write_text(text.replace(line, f"{line}        while speed > 1e9:\n            speed -= 1.0\n"), encoding="utf-8")
    said = done(capsys, "check", "part.py")
    number = text[: text.index(line)].count("\n") + 2
    told = said.out.splitlines()[1]
    assert told.startswith("  SandovalForce: a batch computes it one run after the other, because of ")
    assert told.endswith(f"part.py:{number}: while speed > 1e9:")


def test_check_takes_a_machine_whose_tables_only_a_lesson_gives(capsys: Capture) -> None:
    said = done(capsys, "check", ROOT / "lesson_configs/machines/coordinated_plant.yaml")
    assert "a machine template with 4 parts.\n" in said.out


def test_check_tells_every_file_at_fault(capsys: Capture) -> None:
    Path("turn.nc").write_text("G90 G94 G71\nG1 X1\n", encoding="utf-8")
    Path("part.py").write_text("import nothing_here\n", encoding="utf-8")
    Path("machine.yaml").write_text(
        "machine: M\nsample_period: 5 ms\nstep: 1 ms\nparts: {table: {component: ForceAxis}}\nwires: {table.force: 1 m}\n", encoding="utf-8"
    )
    said = refused(capsys, "check", "turn.nc", "part.py", "machine.yaml", "none.nc", ROOT / "lesson_configs/01_contour_error.yaml")
    lines = [line for line in said.err.splitlines() if line != "part.py: a plug-in is code and is run now."]
    assert lines[0].startswith("turn.nc:2: ")
    assert lines[1] == "part.py:1: the plug-in cannot be imported: ModuleNotFoundError: No module named 'nothing_here'"
    assert lines[2] == "machine.yaml:5:22: '1 m' is given in m, but N is wanted. Use a unit like N."
    assert lines[3] == "none.nc: there is no such file."
    assert "a lesson on the machine two_axis_lathe, 6 variants.\n" in said.out


HEAD = "lesson: L\nmachine: two_axis_lathe\nprogram: one_pass.nc\n"


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        (
            "set: {x_controller.proportional: 3 kg}\nvariants: {a: {set: {x_controller.proportional: 3 V/mm}}}",
            "4:34: '3 kg' is given in kg, but V/m is wanted. Use a unit like V/m.",
        ),
        (
            "set: {x_dac.bits: 99}\nvariants: {a: {set: {x_dac.bits: 8}}, b: {set: {x_dac.bits: 12}}}",
            "4:19: x_dac.bits is 99, outside 1 to 32. Choose a value inside.",
        ),
        ("wires: {x_axis.force: 3 kg}\nvariants: {a: {wires: {x_axis.force: 3 N}}}", "4:23: '3 kg' is given in kg, but N is wanted."),
        (
            "insert: [{effect: CoulombFriction, at: x_axis, level: 3 kg, name: rub}]\nset: {rub.level: 20 N}",
            "4:55: '3 kg' is given in kg, but N is wanted.",
        ),
        ("program: none.nc\nvariants: {a: {program: one_pass.nc}}", "4:10: there is no part program 'none.nc'."),
        ("duration: -1 s\nvariants: {a: {duration: 1 s}}", "4:11: the time is -1 s, and it must be above zero."),
        ("tool_point: {modes: [{frequency: 3 kg, damping: 3 %, stiffness: 1 N/m}], cutting_stiffness: 1 N/m^2}", "4:1: '3 kg' is given"),
    ],
)
def test_check_looks_at_what_no_case_of_a_lesson_shows(text: str, fault: str, capsys: Capture) -> None:
    head = HEAD.replace("program: one_pass.nc", "seed: 1") if text.startswith("program") else HEAD
    Path("mine.yaml").write_text(f"{head}{text}\n", encoding="utf-8")
    assert refused(capsys, "check", "mine.yaml").err.startswith(f"mine.yaml:{fault}")


def test_check_takes_an_overridden_value_of_a_part_that_every_case_replaces(capsys: Capture) -> None:
    torque = (
        "units: {dynamometer: {signal: N*m}, dynamometer_adc: {signal: N*m}, process_controller: {signal: N*m}}, "
        "wires: {dynamometer.measured: load.torque}, "
        "set: {dynamometer.gain: 0.1 V/(N*m), process_controller.reference: 8 N*m, process_controller.start_estimate: 20 N*m, "
        "process_controller.smallest_estimate: 20 N*m, process_controller.contact_threshold: 1 N*m}"
    )
    text = (
        "replace: {process_controller: AdaptiveProcessController}\n"
        f"set: {{process_controller.reference: 400 N}}\nvariants: {{torque: {{{torque}}}}}\n"
    )
    Path("mine.yaml").write_text(HEAD + text, encoding="utf-8")
    done(capsys, "check", "mine.yaml")


def test_init_copies_everything_and_never_overwrites(capsys: Capture) -> None:
    done(capsys, "init", "work")
    lesson = Path("work/lesson_configs/01_contour_error.yaml")
    assert lesson.read_bytes() == (ROOT / "lesson_configs/01_contour_error.yaml").read_bytes()
    assert Path("work/lesson_configs/machines/two_axis_lathe.yaml").is_file()
    assert Path("work/part_programs/liu_landers_2004_example_1.nc").is_file()
    lesson.write_text("lesson: mine\n", encoding="utf-8")
    again = call(capsys, "init", "work")
    assert again.out.startswith("work: 0 files copied, ")
    assert lesson.read_text(encoding="utf-8") == "lesson: mine\n"


def test_init_copies_solutions_for_a_teacher_only(capsys: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    solutions = {
        *(f"lesson_configs/teacher/{path.stem}.yaml" for path in (ROOT / "lesson_configs").glob("*.yaml")),
        "lesson_configs/14_lathe_design_solution.md",
        "lesson_configs/14_lathe_design_search.py",
        "part_programs/axis_next_designed.nc",
        "part_programs/axis_two_suspects_designed.nc",
    }
    call(capsys, "init", "student")
    call(capsys, "init", "staff", "--teacher")
    student, staff = ({str(path.relative_to(top)) for path in Path(top).rglob("*") if path.is_file()} for top in ("student", "staff"))
    assert staff - student == solutions
    monkeypatch.chdir("student")
    done(capsys, "check", "lesson_configs/25_which_program_next.yaml", "lesson_configs/26_two_suspects_one_run.yaml")


PLUGIN = """\
from lathesim.component import Component, Output
from lathesim.hookspecs import hookimpl


class Still(Component):
    \"\"\"Gives nothing.\"\"\"

    force = Output("N", doc="force")

    @staticmethod
    def output() -> float:
        return 0.0


@hookimpl
def register_components():
    return [Still]
"""


def test_plugins_of_a_workspace_are_loaded_and_told(capsys: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    Path("plugins").mkdir()
    Path("plugins/still.py").write_text(PLUGIN, encoding="utf-8")
    Path("plugins/wrong.py").write_text(PLUGIN.replace("register_components", "register_component"), encoding="utf-8")
    assert "Still" not in call(capsys, "components").out
    call(capsys, "init", ".", "--yes")
    said = call(capsys, "components")
    assert "\nStill " in said.out
    assert said.err == "Left out: plugins/wrong.py:15: there is no hook 'register_component'. Did you mean 'register_components'?\n"
