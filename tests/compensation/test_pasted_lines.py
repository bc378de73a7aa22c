"""The lines for a control: each form is read by a parser of its own, from its manual, and holds the numbers that are simulated."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lathesim.cli.main import run_command_line
from lathesim.compensation.control_lines import CONTROLS, Axis
from lathesim.compensation.diagnosed_machine import Diagnosed, InsertedRemedy
from lathesim.compensation.promise import promised
from lathesim.lessons.lesson import load_lesson
from lathesim.manual.chapters import chapter
from lathesim.plugins import load_registry
from tests.cli.command import done
from tests.compensation.test_remedies import AXIS, GUEST, diagnosis, remedied

PLAY = ("Backlash", "x_scale", {"width": (10.04e-6, "m")})
SCREW = ("CumulativePitchError", "x_scale", {"slope": (1e-4, "1")})
FRICTION = ("CoulombFriction", "x_axis", {"level": (20.0, "N")})
RINGING = ("AxialResonance", "x_axis", {"table_share": (0.3, "1"), "frequency": (150.0, "Hz"), "damping": (0.01, "1")})

SPRING = ("AxialResonance", "x_axis", {"table_share": (0.5, "1"), "frequency": (40.0, "Hz"), "damping": (0.04, "1")})


def sections(text: str, mark: str, between: str) -> dict[str, dict[str, str]]:
    """Return an INI file of LinuxCNC or a configuration of Klipper: [SECTION], key, value; a key stands once."""
    found: dict[str, dict[str, str]] = {}
    current: dict[str, str] = {}
    for row in text.splitlines():
        row = row.partition(mark)[0].strip()
        if row.startswith("["):
            assert row.endswith("]")
            current = found.setdefault(row[1:-1], {})
        elif row:
            key, there, value = row.partition(between)
            assert there
            assert key.strip() not in current
            current[key.strip()] = value.strip()
    return found


def hal(text: str) -> dict[str, str]:
    """Return what a HAL file sets; it may load and add functions too."""
    rows = [row.split() for row in text.splitlines() if row and not row.startswith("#")]
    assert {row[0] for row in rows} <= {"setp", "loadrt", "addf"}
    assert all(len(row) == 3 for row in rows)
    return {row[1]: row[2] for row in rows if row[0] == "setp"}


def triplets(text: str) -> np.ndarray[Any, Any]:
    """Return nominal places and trims [m] of a compensation file of type 0: a trim, which is added, is nominal less actual."""
    rows = np.array([[float(word) for word in row.split()] for row in text.splitlines()])
    assert rows.shape[1] == 3
    assert len(rows) <= 256
    assert np.all(np.diff(rows[:, 0]) > 0.0)
    return 1e-3 * np.column_stack([rows[:, 0], rows[:, :1] - rows[:, 1:]])


def settings(text: str) -> dict[str, str]:
    """Return the settings of grblHAL, ``$160=0.010``: 100 for an axis setting, 60 for the play, then the axis."""
    rows = [row for row in text.splitlines() if not row.startswith(";")]
    return dict(re.fullmatch(r"(\$\d+)=(\d+\.\d{3})", row).groups() for row in rows)  # type: ignore[union-attr]


def words(text: str) -> dict[str, str]:
    """Return a configuration of Smoothieware: a name and a value on a line, then a comment."""
    return dict(row.partition("#")[0].split() for row in text.splitlines() if row.partition("#")[0].strip())


NUMBERS = {
    "BACKLASH": 32450, "ENC_COMP_ENABLE": 32700, "MM_ENC_COMP_MAX_POINTS": 38000, "FRICT_COMP_MODE": 32490, "FRICT_COMP_ENABLE": 32500,
    "FRICT_COMP_ADAPT_ENABLE": 32510, "FRICT_COMP_CONST_MAX": 32520, "FRICT_COMP_TIME": 32540,
}  # fmt: skip


def machine_data(text: str) -> dict[str, float]:
    """Return machine data of SINUMERIK of axis X1, ``N32450 $MA_BACKLASH[0,X1]=0.01``; the number is that of the name."""
    found = {}
    for row in text.splitlines():
        if not row.startswith(";"):
            number, name, value = re.fullmatch(r"N(\d+) \$MA_(\w+)\[(?:0,)?X1\]=(\S+)", row).groups()  # type: ignore[union-attr]
            assert NUMBERS[name] == int(number)
            found[name] = float(value)
    return found


def leadscrew_program(text: str) -> np.ndarray[Any, Any]:
    """Return places and what is added to the axis there [m], of a part program that fills the table of X1: values move it backward."""
    rows = [row for row in text.splitlines() if not row.startswith(";")]
    assert rows.pop() == "M17"
    about, points = {}, {}
    for row in rows:
        name, number, value = re.fullmatch(r"\$AA_ENC_COMP(_\w+)?\[0,(?:(\d+),)?X1\]=(\S+)", row).groups()  # type: ignore[union-attr]
        (points if number else about)[int(number) if number else name] = float(value)
    assert list(points) == list(range(len(points)))
    assert about["_IS_MODULO"] == 0
    assert about["_MAX"] == pytest.approx(about["_MIN"] + about["_STEP"] * (len(points) - 1), abs=1e-6)
    places = about["_MIN"] + about["_STEP"] * np.arange(len(points))
    return 1e-3 * np.column_stack([places, [-value for value in points.values()]])


def line(remedy: str, share: float = 1.0, one_sided: tuple[str, ...] = (), **values: float) -> InsertedRemedy:
    return InsertedRemedy(remedy, "x_controller", f"mend_{remedy}", values, answers=("It",), one_sided=one_sided, share=share)


def pasted(control: str, *lines: InsertedRemedy, letter: str = "X", joint: int = 0) -> tuple[dict[str, InsertedRemedy], dict[str, str]]:
    held, texts = CONTROLS[control].held(lines, load_registry(), [Axis(letter, joint, "x_axis", "x_controller")])
    return {item.line.remedy: item.line for item in held if item.texts}, texts


WIDTH = line("BacklashShift", 0.9, ("width",), width=23.4567e-6)


def test_play_is_in_the_units_and_digits_of_each_control() -> None:
    held, texts = pasted("linuxcnc", WIDTH, letter="Z", joint=1)
    assert float(sections(texts["linuxcnc.ini"], "#", "=")["JOINT_1"]["BACKLASH"]) == pytest.approx(0.021111)
    assert held["BacklashShift"].values["width"] == pytest.approx(21.111e-6)
    assert held["BacklashShift"].share == 1.0
    held, texts = pasted("grblhal", WIDTH, letter="Z", joint=1)
    assert settings(texts["grblhal.txt"]) == {"$162": "0.021"}
    assert held["BacklashShift"].values["width"] == pytest.approx(21e-6)
    _, texts = pasted("smoothieware", WIDTH, letter="Y")
    assert words(texts["config.txt"]) == {"beta_backlash_mm": "0.0211", "backlash_enable": "true"}
    _, texts = pasted("sinumerik", WIDTH)
    assert machine_data(texts["sinumerik_md.ini"]) == {"BACKLASH": pytest.approx(0.021111)}


def test_what_is_finer_than_the_last_digit_is_not_written() -> None:
    held, texts = pasted("grblhal", line("BacklashShift", width=0.4e-6))
    assert not held
    assert not texts


@pytest.mark.parametrize("control", ["linuxcnc", "sinumerik"])
def test_a_table_takes_the_error_away_with_the_sign_of_the_control(control: str) -> None:
    places = np.linspace(-1e-3, 0.1004, 1001)
    rows = np.column_stack([places, 5e-6 * np.sin(places / 0.01), 5e-6 * np.sin(places / 0.01)])
    table = InsertedRemedy(
        "PitchTable", "x_controller", "m", tables={"points": (("position", "forward", "backward"), rows)}, answers=("It",)
    )
    held, texts = pasted(control, table)
    kept = held["PitchTable"].tables["points"][1]
    read = triplets(texts["x.comp"]) if control == "linuxcnc" else leadscrew_program(texts["x_enc_comp.mpf"])
    assert read[:, 0] == pytest.approx(kept[:, 0])
    assert read[:, 1] == pytest.approx(-kept[:, 1], abs=1e-15)
    assert np.interp(0.05, read[:, 0], read[:, 1]) == pytest.approx(-5e-6 * np.sin(5.0), abs=3e-9)
    assert read[0, 0] <= places[0] + 1e-6
    assert read[-1, 0] >= places[-1] - 1e-6


def test_the_play_stands_in_the_table_of_linuxcnc_as_its_own_line_is_ignored_there() -> None:
    rows = np.array([[0.0, 0.0, 0.0], [0.1, 1e-5, 1e-5]])
    table = InsertedRemedy(
        "PitchTable", "x_controller", "m", tables={"points": (("position", "forward", "backward"), rows)}, answers=("It",)
    )
    held, texts = pasted("linuxcnc", table, line("BacklashShift", width=20e-6))
    assert sections(texts["linuxcnc.ini"], "#", "=")["JOINT_0"] == {"BACKLASH": "0.020000", "COMP_FILE": "x.comp", "COMP_FILE_TYPE": "0"}
    trims = triplets(texts["x.comp"])
    # going forward the motor is to go half the play further, and a long screw less far
    assert trims[:, 1] == pytest.approx([10e-6, 0.0])
    assert trims[:, 2] == pytest.approx([-10e-6, -20e-6])
    assert held["PitchTable"].tables["points"][1] == pytest.approx(rows)


def test_gains_offsets_and_filters_are_in_the_units_of_the_control() -> None:
    gains = line("MotionFeedforward", velocity_gain=0.5, acceleration_gain=-2e-3, jerk_gain=3e-6)
    notch = line("CommandNotch", frequency=87.65432, numerator=0.01, denominator=0.4)
    _, texts = pasted("linuxcnc", gains, line("CommandBias", bias=0.25), notch)
    assert sections(texts["linuxcnc.ini"], "#", "=")["JOINT_0"]["BIAS"] == "0.250000"
    assert hal(texts["linuxcnc.hal"]) == {
        "pid.x.FF1": "0.0005",
        "pid.x.FF2": "-2e-06",
        "pid.x.FF3": "3e-09",
        "x_notch.type": "2",
        "x_notch.f0": "87.654",
        "x_notch.Q": "1.2500",
        "x_notch.enable": "1",
    }
    held, texts = pasted("sinumerik", notch, line("ReversalPulse", 0.5, ("speed",), speed=2e-3, fade=0.0123))
    drive = dict(row.split(" = ") for row in texts["sinamics.txt"].splitlines() if not row.startswith(";"))
    assert drive["p1658[0]"] == drive["p1660[0]"] == "87.6543"
    assert (drive["p1656[0].0"], drive["p1657[0]"], drive["p1659[0]"], drive["p1661[0]"]) == ("1", "2", "0.4000", "0.0100")
    assert held["CommandNotch"].values["frequency"] == 87.6543
    data = machine_data(texts["sinumerik_md.ini"])
    assert (data["FRICT_COMP_CONST_MAX"], data["FRICT_COMP_TIME"]) == pytest.approx((60.0, 0.0123))
    assert (data["FRICT_COMP_MODE"], data["FRICT_COMP_ENABLE"], data["FRICT_COMP_ADAPT_ENABLE"]) == (1, 1, 0)
    _, texts = pasted("klipper", line("InputShaper", frequency=41.23456, damping=0.05, kind=2.0))
    shaper = {"shaper_type_x": "zvd", "shaper_freq_x": "41.2346", "damping_ratio_x": "0.0500"}
    assert sections(texts["printer.cfg"], "#", ":") == {"input_shaper": shaper}


@pytest.mark.parametrize(("control", "effect", "held"), [("klipper", PLAY, "Backlash"), ("linuxcnc", FRICTION, "CoulombFriction")])
def test_a_control_without_the_setting_says_so_and_offers_the_nearest(
    control: str, effect: Any, held: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = remedied(tmp_path, diagnosis(effect), "--for", control, code=1)
    error = capsys.readouterr().err
    assert "has no setting for" in error
    assert f"it holds no remedy against {held}. The nearest is '--as program'" in error
    assert len([line for line in error.splitlines() if not line.startswith("Compiling once")]) == 1
    assert not (out / "remedy.json").exists()


def test_a_program_is_for_no_control(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    remedied(tmp_path, diagnosis(PLAY), "--for", "grblhal", "--as", "program", code=2)
    assert "give it without --for" in capsys.readouterr().err


def test_the_remedy_of_a_plug_in_is_written_or_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    plugin = tmp_path / "weight.py"
    plugin.write_text(GUEST, encoding="utf-8")
    named = diagnosis(("HangingWeight", "x_axis", {"offset": (40.0, "N")}))
    out = remedied(tmp_path, named, "--plugins", str(plugin), "--for", "linuxcnc")
    (found,) = json.loads((out / "remedy.json").read_text())["remedies"]
    written = sections((out / "linuxcnc.ini").read_text(), "#", "=")["JOINT_0"]
    assert float(written["BIAS"]) == found["parameters"]["bias"]["value"]
    law = '    @staticmethod\n    def output(incoming: float, share: float, bias: float) -> float:\n        """Add."""\n'
    other = GUEST.replace("    @classmethod", f"{law}        return incoming + 2.0 * share * bias\n\n    @classmethod")
    plugin.write_text(other, encoding="utf-8")
    remedied(tmp_path, named, "--plugins", str(plugin), "--for", "linuxcnc", code=1)
    assert "it holds no remedy against HangingWeight." in capsys.readouterr().err


@pytest.mark.slow
def test_what_a_control_does_not_hold_is_said_beside_what_it_holds(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = remedied(tmp_path, diagnosis(PLAY, FRICTION), "--for", "grblhal")
    assert settings((out / "grblhal.txt").read_text()).keys() == {"$160"}
    (row,) = [row for row in capsys.readouterr().out.splitlines() if row.startswith("CoulombFriction at x_axis: ")]
    assert "has no setting for screw, friction or vibration. The nearest is" in row
    assert row.endswith("holds all numbers.")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("control", "effects", "left"),
    [
        ("linuxcnc", (PLAY, SCREW), 0.3),
        ("grblhal", (PLAY,), 0.4),
        ("sinumerik", (SCREW,), 0.1),
        ("sinumerik", (FRICTION,), 0.4),
        ("sinumerik", (RINGING,), 0.1),
        ("klipper", (SPRING,), 0.95),
    ],
)
def test_what_is_read_back_is_what_was_tried(control: str, effects: Any, left: float, tmp_path: Path) -> None:
    lesson = stiff(tmp_path) if effects == (RINGING,) else AXIS
    found = diagnosis(*effects)
    out = remedied(tmp_path, found, "--for", control, lesson=lesson)
    answer = json.loads((out / "remedy.json").read_text())
    lines = [read_back(item, control, out) for item in answer["remedies"]]
    bench = Diagnosed(load_lesson(lesson), load_registry(), tuple(found["insert"]), {}, tmp_path).bench(lines)
    again = {size.name: size for size in promised(bench, [])[0]}
    name = "rms_deviation of x_scale.position"
    assert answer["promise"][name]["after"] == pytest.approx(again[name].after, rel=1e-6)
    assert answer["promise"][name]["before"] == pytest.approx(again[name].before, rel=1e-6)
    assert again[name].after < left * again[name].before


def stiff(folder: Path) -> str:
    """Return a lesson whose velocity loop is so stiff that a resonance makes it ring."""
    source = load_lesson(AXIS)
    text = source.text.partition("variants:")[0].replace("../", f"{source.path.parents[1]}/")
    text += "set: {x_controller.velocity_gain: 1500 V*s/m}\n"
    (folder / "stiff.yaml").write_text(text, encoding="utf-8")
    return str(folder / "stiff.yaml")


def read_back(item: dict[str, Any], control: str, out: Path) -> InsertedRemedy:
    """Return a remedy with the values that the parsers find in the files for a control."""
    values = {name: value["value"] for name, value in item["parameters"].items()}
    tables = {}
    if item["remedy"] == "BacklashShift":
        if control == "linuxcnc":
            values["width"] = 1e-3 * float(sections((out / "linuxcnc.ini").read_text(), "#", "=")["JOINT_0"]["BACKLASH"])
        else:
            values["width"] = 1e-3 * float(settings((out / "grblhal.txt").read_text())["$160"])
    elif item["remedy"] == "PitchTable":
        if control == "linuxcnc":
            half = 0.5e-3 * float(sections((out / "linuxcnc.ini").read_text(), "#", "=")["JOINT_0"]["BACKLASH"])
            rows = triplets((out / "x.comp").read_text()) - [0.0, half, -half]
        else:
            rows = leadscrew_program((out / "x_enc_comp.mpf").read_text())[:, [0, 1, 1]]
        tables["points"] = (("position", "forward", "backward"), rows * [1.0, -1.0, -1.0])
    elif item["remedy"] == "ReversalPulse":
        data = machine_data((out / "sinumerik_md.ini").read_text())
        values |= {"speed": data["FRICT_COMP_CONST_MAX"] / 6e4, "fade": data["FRICT_COMP_TIME"]}
    elif item["remedy"] == "CommandNotch":
        drive = dict(row.split(" = ") for row in (out / "sinamics.txt").read_text().splitlines() if not row.startswith(";"))
        values = {"frequency": float(drive["p1658[0]"]), "denominator": float(drive["p1659[0]"]), "numerator": float(drive["p1661[0]"])}
    else:
        shaper = sections((out / "printer.cfg").read_text(), "#", ":")["input_shaper"]
        assert shaper["shaper_type_x"] == "zv"
        values |= {"frequency": float(shaper["shaper_freq_x"]), "damping": float(shaper["damping_ratio_x"])}
    name = f"x_controller_{re.sub('(?<!^)(?=[A-Z])', '_', item['remedy']).lower()}"
    return InsertedRemedy(item["remedy"], item["at"], name, values, tables=tables)


def test_every_control_of_the_command_line_is_known(capsys: pytest.CaptureFixture[str]) -> None:
    assert f"[{'|'.join([*CONTROLS, 'table'])}]" in done(capsys, "remedy", "--help").out.replace("\n", "").replace(" ", "")


@pytest.mark.slow
def test_the_page_on_backlash_shows_what_its_commands_print(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    page = chapter("backlash").text
    program, lesson, commands, answer, lines = re.findall(r"```\w*\n(.*?)```", page, re.S)
    Path("backlash.nc").write_text(program, encoding="utf-8")
    Path("backlash.yaml").write_text(lesson, encoding="utf-8")
    (practice,) = re.findall(r"`lathesim (conceal [^`]*)`", page)
    assert run_command_line(shlex.split(practice)) == 0
    Path("case/recording.csv").rename("gauge.csv")
    capsys.readouterr()
    for command in commands.splitlines():
        assert run_command_line(shlex.split(command)[1:]) == 0
    printed = capsys.readouterr().out
    assert answer in printed
    assert all(row in printed for row in lines.splitlines())
    assert sections(Path("paste/linuxcnc.ini").read_text(), "#", "=") == {"JOINT_0": {"BACKLASH": "0.061811"}}
    for form, named in (("grblhal", "$160=0.062"), ("smoothieware", "alpha_backlash_mm 0.0618")):
        assert named in done(capsys, "remedy", "backlash.yaml", "play.json", "--for", form, "--out", form).out
    done(capsys, "remedy", "backlash.yaml", "play.json", "--as", "program", "--out", "taken_up")
    assert Path("taken_up/mirrored.nc").is_file()
