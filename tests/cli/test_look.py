"""``lathesim look``: what a recording holds, the machine that fits it, and a lesson; one question at most, on a terminal alone."""

import io
from pathlib import Path

import numpy as np
import pytest

from tests.cli.command import call, done, json_of
from tests.recordings.trace_files import FILES

Capture = pytest.CaptureFixture[str]


def trace(form: str) -> str:
    """Write the file of a form here, and return its name."""
    file = FILES[form]
    file.write(Path(file.name))
    return file.name


def table(head: str, *columns: np.ndarray) -> Path:
    np.savetxt("axis.csv", np.column_stack(columns), delimiter=",", header=head, comments="")
    return Path("axis.csv")


def test_a_trace_of_a_control_becomes_a_lesson_that_check_accepts(capsys: Capture) -> None:
    said = call(capsys, "look", trace("SINUMERIK trace"), "--lesson", "mine.yaml")
    assert (said.code, said.err) == (0, "")
    assert said.out.splitlines()[:3] == [
        "trace.xml: SINUMERIK trace, 5 columns, 120 rows.", "Its clock is 'time': 500 Hz, 0.238 s.", "No gaps.",
    ]  # fmt: skip
    assert ["nckServoDataCmdPos64|7", "deg", "0", "25.704"] in [line.split() for line in said.out.splitlines()]
    assert "Note: the file tells kinds of units only; its places change as its speeds say in deg and rpm." in said.out
    assert "Machine: led_rotary_table.\n" in said.out
    assert "  drive   table.reference          'nckServoDataCmdPos64|7' in deg\n" in said.out
    assert "  compare table.current            'nckServoDataActCurr32|7' in A\n" in said.out
    assert said.out.endswith("Next: look at each line of mine.yaml, then lathesim diagnose mine.yaml trace.xml\n")
    assert "uncertain:\n  table.turned_inertia: 1000 %\n" in Path("mine.yaml").read_text(encoding="utf-8")
    assert call(capsys, "check", "mine.yaml").out == "mine.yaml: a lesson on the machine led_rotary_table.\n"


MACHINES = {
    "force_axis": ("time [s],force [N],position [mm]", "x_axis.force"),
    "voltage_axis": ("time [s],u [V],x_act [mm]", "x_dac.command"),
    "led_axis": ("time [s],x_set [mm],x_act [mm]", "x_axis.reference"),
    "led_rotary_table": ("t_ms,ref_pos_deg,motor_pos_deg", "table.reference"),
    "torque_spindle": ("time [s],torque [N*m],speed [rpm]", "spindle.torque"),
}


@pytest.mark.parametrize("machine", MACHINES)
def test_the_machine_follows_from_what_was_recorded(machine: str, capsys: Capture) -> None:
    head, driven = MACHINES[machine]
    time = 1e-3 * np.arange(200)
    told = json_of(capsys, "look", table(head, 1e3 * time if "t_ms" in head else time, np.sin(30.0 * time), time), "--json")
    assert (told["schema"], told["kind"], told["machine"]) == ("lathesim-look/1", "delimited text", machine)
    assert [item["target"] for item in told["mapping"] if item["role"] == "drive"] == [driven]
    assert told["clock"]["period"] == pytest.approx(1e-3)


def test_a_voltage_that_turns_a_motor_makes_a_torque_beside_a_reference_too(capsys: Capture) -> None:
    time = 1e-3 * np.arange(200)
    head = "time [s],reference_rad,voltage_V,angle_rad,speed_rad_s"
    said = call(capsys, "look", table(head, time, np.sign(np.sin(30.0 * time)), np.sin(30.0 * time), time, time), "--lesson", "mine.yaml")
    assert "Machine: torque_spindle.\n" in said.out
    assert "Assumed: the voltage makes 0.01 N*m/V.\n" in said.out
    assert call(capsys, "check", "mine.yaml").out == "mine.yaml: a lesson on the machine torque_spindle.\n"


def test_a_duty_cycle_drives_a_motor_and_a_column_may_be_called_by_its_unit(capsys: Capture) -> None:
    time = 1e-3 * np.arange(200)
    told = json_of(capsys, "look", table("t_ms,pwm,rpm", 1e3 * time, np.round(60.0 + 30.0 * np.sin(30.0 * time)), time), "--json")
    assert told["machine"] == "torque_spindle"
    roles = {item["role"]: (item["target"], item["unit"], item["held"]) for item in told["mapping"]}
    assert roles["drive"] == ("spindle.torque", "N*m", True)
    assert roles["compare"] == ("spindle.speed", "rpm", False)


@pytest.mark.parametrize(
    ("command", "motion", "machine"),
    [
        ("goal_position", "present_position", "led_axis"), ("target_position", "current_position", "led_axis"),
        ("goal", "position", "led_axis"), ("setpoint", "pos", "led_axis"), ("cmd", "pos_fbk", "led_axis"), ("SP", "x_act_mm", "led_axis"),
        ("reference", "angle", "led_rotary_table"), ("theta_ref", "theta", "led_rotary_table"), ("target", "angle_deg", "led_rotary_table"),
    ],
)  # fmt: skip
def test_a_commanded_place_is_known_by_the_usual_words(command: str, motion: str, machine: str, capsys: Capture) -> None:
    time = 1e-3 * np.arange(200)
    told = json_of(capsys, "look", table(f"t_s,{command},{motion}", time, np.sin(30.0 * time), np.sin(29.0 * time)), "--json")
    assert told["machine"] == machine
    assert [(item["role"], item["column"]) for item in told["mapping"]][1:] == [("drive", command), ("compare", motion)]
    assert (f"'{command}' commands what '{motion}' shows" in told["assumed"]) == ("_" not in command)
    if motion == "angle_deg":
        assert {item["unit"] for item in told["mapping"]} == {"s", "deg"}


def test_a_command_without_a_quantity_goes_with_the_motion_of_its_axis_and_pushes_nothing(capsys: Capture) -> None:
    time = 1e-3 * np.arange(200)
    wave, other = np.sin(30.0 * time), np.cos(30.0 * time)
    two = json_of(capsys, "look", table("t_s,x_goal,x_pos,y_goal,y_pos", time, wave, wave, other, other), "--axis", "y", "--json")
    assert [item["column"] for item in two["mapping"]][1:] == ["y_goal", "y_pos"]
    # a speed that was asked for is none that was measured, and a place as it is now no current
    assert json_of(capsys, "look", table("t_s,goal,omega", time, wave, wave), "--json")["machine"] is None
    amperes = json_of(capsys, "look", table("t_s,current_A,current_angle", time, wave, other), "--json")
    assert [(item["role"], item["column"]) for item in amperes["mapping"]][1:] == [("drive", "current_A"), ("compare", "current_angle")]


@pytest.mark.parametrize(("column", "held"), [("torque_cmd [N*m]", True), ("iq_set [A]", True), ("torque_act [N*m]", False)])
def test_a_commanded_torque_or_current_is_held_until_the_next_row(column: str, held: bool, capsys: Capture) -> None:
    time = 1e-3 * np.arange(200)
    said = call(capsys, "look", table(f"time [s],{column},speed [rpm]", time, np.sin(30.0 * time), time), "--lesson", "mine.yaml")
    assert (", held until the next row\n" in said.out) == held
    assert ("held: true" in Path("mine.yaml").read_text(encoding="utf-8")) == held
    done(capsys, "check", "mine.yaml")


def test_gaps_and_missing_values_are_counted(capsys: Capture) -> None:
    time = np.delete(1e-3 * np.arange(300), slice(100, 150))
    force = np.where(np.arange(250) == 20, np.nan, np.sin(30.0 * time))
    told = json_of(capsys, "look", table("time [s],force [N],position [mm]", time, force, time), "--json")
    assert (told["clock"]["gaps"], told["clock"]["longest_gap"]) == (1, pytest.approx(0.051))
    assert [item["missing"] for item in told["columns"]] == [0, 1, 0]


def test_on_a_terminal_one_thing_is_asked(capsys: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = io.StringIO("0.25\n")
    monkeypatch.setattr(terminal, "isatty", lambda: True, raising=False)
    monkeypatch.setattr("sys.stdin", terminal)
    said = call(capsys, "look", trace("ODrive log"), "--lesson", "mine.yaml")
    assert said.out.startswith("What the current makes, in N*m/A [0.1]: ")
    assert "scale: 0.25\n" in Path("mine.yaml").read_text(encoding="utf-8")
    assert "Assumed: the current makes" not in said.out


def test_elsewhere_nothing_is_asked_and_each_assumption_is_listed(capsys: Capture) -> None:
    said = call(capsys, "look", trace("ODrive log"), "--lesson", "mine.yaml")
    assert "Assumed: the current makes 0.1 N*m/A.\n" in said.out
    text = Path("mine.yaml").read_text(encoding="utf-8")
    assert "# Assumed: the current makes 0.1 N*m/A.\n" in text and "scale: 0.1\n" in text


def test_a_file_without_clock_and_units_gets_both_from_the_user_or_by_name(capsys: Capture) -> None:
    name = trace("Heidenhain scope")
    assert "Assumed: the rows come at 47.619 Hz.\n" in call(capsys, "look", name).out
    said = call(capsys, "look", name, "--rate", "50 Hz", "--lesson", "mine.yaml")
    assert "It has no clock.\n" in said.out and "rows come at" not in said.out
    assert "Assumed: 'x_s_actual' is in mm.\n" in said.out
    assert "rate: 50 Hz\n" in Path("mine.yaml").read_text(encoding="utf-8")


def test_the_axis_is_chosen_by_name(capsys: Capture) -> None:
    time = 1e-3 * np.arange(200)
    path = table("time [s],x_force [N],x_pos [mm],y_force [N],y_pos [mm]", time, time, time, time, time)
    assert "Assumed: axis 'x' is meant; others that fit: y.\n" in call(capsys, "look", path).out
    assert "'y_force' in N" in call(capsys, "look", path, "--axis", "y").out
    said = call(capsys, "look", path, "--axis", "z")
    assert (said.code, said.err) == (1, "axis.csv: no axis 'z' fits a machine. Those that do: 'x', 'y'.\n")


def test_where_no_machine_fits_that_is_said_and_no_lesson_written(capsys: Capture) -> None:
    name = trace("Klipper accelerometer")
    said = call(capsys, "look", name)
    assert (said.code, said.out.splitlines()[-1]) == (
        0,
        "No machine fits: nothing in the file drives a motion that it shows, for 100 rows at least.",
    )
    said = call(capsys, "look", name, "--lesson", "mine.yaml")
    assert said.code == 1 and "no machine fits what is in the file" in said.err and not Path("mine.yaml").exists()
