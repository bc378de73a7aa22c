"""Remedies: neutral ones leave no trace, those from a diagnosis keep their promise, and bad input gets one sentence."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lathesim.cli.main import run_command_line
from lathesim.compensation.diagnosed_machine import Diagnosed, InsertedRemedy
from lathesim.compensation.learn import program_text
from lathesim.compensation.planning import REPAIRS, answered
from lathesim.effects.position_remedies import interpolated
from lathesim.lessons.lesson import lesson_from_text, load_lesson
from lathesim.lessons.part_values import write_table
from lathesim.lessons.simulate import simulate
from lathesim.plugins import load_registry
from tests.cli.command import done, refused

AXIS = "22_what_is_wrong_with_this_machine"


def diagnosis(*effects: tuple[str, str, dict[str, tuple[float, str]]], verdict: str = "named", **further: Any) -> dict[str, Any]:
    """Return a diagnosis as ``diagnose --json`` writes it, sure of its values to 1 %."""
    named, lines = [], []
    for name, at, values in effects:
        known = {key: {"value": v, "unit": unit, "low": v - 0.02 * abs(v), "high": v + 0.02 * abs(v)} for key, (v, unit) in values.items()}
        named.append({"effect": name, "at": at, "family": "", "probability": 0.99, "parameters": known, "tied_with": []})
        lines.append({"effect": name, "at": at, **{key: f"{v!r} {unit}" if unit != "1" else repr(v) for key, (v, unit) in values.items()}})
    return {
        "schema": "lathesim-diagnosis/1",
        "verdict": verdict,
        "effects": named,
        "insert": lines,
        "baseline": {},
        "adequate": True,
    } | further


def remedied(tmp_path: Path, data: Any, *options: str, lesson: str = AXIS, code: int = 0) -> Path:
    """Ask for the remedies of a diagnosis, which ends with a code; return where they are."""
    tmp_path.mkdir(exist_ok=True)
    file = tmp_path / "diagnosis.json"
    file.write_text(data if isinstance(data, str) else json.dumps(data), encoding="utf-8")
    assert run_command_line(["remedy", lesson, str(file), "--out", str(tmp_path / "out"), *options]) == code
    return tmp_path / "out"


def one_sentence(capsys: pytest.CaptureFixture[str]) -> str:
    """Return the one sentence of a refusal."""
    (row,) = [row for row in capsys.readouterr().err.strip().splitlines() if not row.startswith("Compiling")]
    return row


def concealed(tmp_path: Path, effect: str) -> str:
    """Hide an effect in the axis; return the lesson for who looks for it."""
    tmp_path.mkdir(exist_ok=True)
    assert run_command_line(["conceal", AXIS, "--effect", effect, "--seed", "3", "--out", str(tmp_path / "case")]) == 0
    return str(tmp_path / "case" / "lesson.yaml")


def removed_share(tmp_path: Path, lesson: Path) -> float:
    """Record the concealed machine again with a lesson; return the share of the effect that is gone."""
    again = ["conceal", "--again", str(tmp_path / "case_answer.json"), "--lesson", str(lesson), "--out", str(tmp_path / "again")]
    assert run_command_line(again) == 0
    result = json.loads((tmp_path / "again" / "result.json").read_text())
    return float(result["rms_deviation"]["x_scale.position"]["removed_share"])


@pytest.mark.parametrize("name", sorted(load_registry().remedies))
def test_a_remedy_of_which_nothing_acts_leaves_every_bit_as_it_was(name: str, tmp_path: Path) -> None:
    registry = load_registry()
    remedy: Any = registry.remedies[name]
    port = {"reading": "voltage", "drive": "reference", "measured": "measured"}[remedy.site]
    entry = f"  - {{remedy: {name}, at: x_controller.{port}, name: mend, share: 0"
    entry += ", other: z_encoder.position" if name == "AcrossTable" else ""
    entry += ", spindle_speed: 0 rad/s" if name == "SpindleGrowthModel" else ""
    source = load_lesson("09_learning")
    text = source.text.partition("variants:")[0] + f"insert:\n{entry}}}\nduration: 1 s\n"
    tables = getattr(remedy, "example_tables", {})
    for table, rows in tables.items():
        write_table(tmp_path / f"{table}.csv", remedy.declarations[table].columns, np.array(rows))
        text += f"tables: {{mend.{table}: {table}.csv}}\n"
    lesson = lesson_from_text(text, tmp_path / "lesson.yaml")
    plain = source.text.partition("variants:")[0] + "duration: 1 s\n"
    without = simulate(lesson_from_text(plain, tmp_path / "plain.yaml"), registry)
    run = simulate(lesson, registry)
    assert np.array_equal(run["contour.contour_error"], without["contour.contour_error"])


def test_a_table_leaves_what_the_formula_says() -> None:
    places = np.arange(0.0, 0.0101, 0.5e-3)
    table = [[float(x), float(5e-6 * np.sin(2.0 * np.pi * x / 5e-3))] for x in places]
    fine = np.linspace(0.0, 0.01, 20_001)
    left = np.array([5e-6 * np.sin(2.0 * np.pi * x / 5e-3) - interpolated(table, x, 1) for x in fine])
    # the largest residual lies between the two points beside a crest
    assert np.max(np.abs(left)) == pytest.approx(5e-6 * (1.0 - np.cos(np.pi * 0.1)), rel=1e-3)


@pytest.mark.slow
def test_friction_is_taken_away_and_the_promise_is_kept(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = diagnosis(("CoulombFriction", "x_axis", {"level": (20.1, "N")}))
    out = remedied(tmp_path, found, lesson=concealed(tmp_path, "CoulombFriction:level=20 N@x_axis"))
    answer = json.loads((out / "remedy.json").read_text())
    assert [item["remedy"] for item in answer["remedies"]] == ["FrictionFeedforward"]
    assert answer["remedies"][0]["share"] < 1.0
    assert removed_share(tmp_path, out / "lesson.yaml") > 0.95
    promise = answer["promise"]["rms_deviation of x_scale.position"]
    assert promise["low"] < promise["after"] * 3.0
    assert all(size["high"] > 1.15 * size["low"] for name, size in answer["promise"].items() if "rms_deviation" in name)
    said = done(capsys, "compare", out / "lesson.yaml", tmp_path / "again" / "recording.csv", "--no-plots")
    assert "rms_deviation of x_scale.position" in said.out


@pytest.mark.slow
@pytest.mark.parametrize(
    ("effect", "at", "values", "remedy"),
    [
        ("Backlash", "x_scale", {"width": (10e-6, "m")}, "BacklashShift"),
        ("CumulativePitchError", "x_scale", {"slope": (1e-4, "1")}, "PitchTable"),
        (
            "EncoderEccentricity",
            "x_encoder",
            {"amplitude": (3e-6, "m"), "turn": (0.008, "m"), "phase": (0.3, "rad")},
            "ReadingTable",
        ),
        ("AmplifierDeadZone", "x_dac", {"half_width": (0.1, "V")}, "InverseDeadZone"),
        ("TransportDelay", "x_dac", {"delay": (1e-3, "s")}, "MotionFeedforward"),
        ("ForceOffset", "x_axis", {"offset": (40.0, "N")}, "CommandBias"),
    ],
)
def test_a_named_effect_gets_its_remedy_and_most_of_it_goes(
    effect: str, at: str, values: dict[str, tuple[float, str]], remedy: str, tmp_path: Path
) -> None:
    out = remedied(tmp_path, diagnosis((effect, at, values)))
    answer = json.loads((out / "remedy.json").read_text())
    assert [item["remedy"] for item in answer["remedies"]] == [remedy]
    assert answer["promise"]["rms_deviation of x_scale.position"]["removed_share"] > 0.7
    assert (out / "lesson.yaml").is_file()


@pytest.mark.parametrize("verdict", ["no_mismatch", "parameters_only", "unknown", "recording_fault"])
def test_a_machine_without_a_named_effect_is_left_alone(verdict: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = remedied(tmp_path, diagnosis(verdict=verdict))
    assert json.loads((out / "remedy.json").read_text())["remedies"] == []
    assert "remedy:" not in (out / "lesson.yaml").read_text()
    assert "nothing to mend" in capsys.readouterr().out or verdict in ("unknown", "recording_fault")


def test_what_no_software_mends_is_told_to_be_repaired(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = remedied(tmp_path, diagnosis(("LostCounts", "x_encoder", {"jump": (60e-6, "m"), "instant": (6.0, "s")})))
    assert "repair the encoder's cable, plug or supply" in capsys.readouterr().out
    assert json.loads((out / "remedy.json").read_text())["remedies"] == []


def test_every_effect_has_a_remedy_or_a_repair_and_none_has_both() -> None:
    registry = load_registry()
    assert answered(registry) <= set(registry.effects)
    assert set(REPAIRS) <= set(registry.effects)
    assert not answered(registry) & set(REPAIRS)
    assert {name for name, kind in registry.remedies.items() if "sized_for" not in vars(kind)} == {"LearnedCorrection"}


GUEST = '''
from lathesim.effects.command_remedies import CommandBias
from lathesim.effects.offset_and_gain import ForceOffset
from lathesim.effects.remedy import Sizes
from lathesim.hookspecs import hookimpl


class HangingWeight(ForceOffset):
    """Pulls an axis to one side:  F = offset."""

    catalogue = 0


class Counterweight(CommandBias):
    """Holds a weight:  out = in + share bias."""

    answers = ("HangingWeight",)

    @classmethod
    def sized_for(cls, effect):
        return Sizes({"bias": effect.per_force * effect.values["offset"]}, tuned=("bias",))


@hookimpl
def register_effects():
    return [HangingWeight]


@hookimpl
def register_remedies():
    return [Counterweight]
'''


def test_an_effect_of_a_plug_in_gets_the_remedy_of_a_plug_in(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    plugin = tmp_path / "weight.py"
    plugin.write_text(GUEST, encoding="utf-8")
    named = diagnosis(("HangingWeight", "x_axis", {"offset": (40.0, "N")}))
    out = remedied(tmp_path, named, "--plugins", str(plugin))
    answer = json.loads((out / "remedy.json").read_text())
    (found,) = answer["remedies"]
    assert (found["remedy"], found["answers"]) == ("Counterweight", ["HangingWeight"])
    assert answer["promise"]["rms_deviation of x_scale.position"]["removed_share"] > 0.7
    assert (out / "lesson.yaml").is_file()


def test_a_remedy_that_sizes_what_it_does_not_have_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    plugin = tmp_path / "weight.py"
    plugin.write_text(GUEST.replace('Sizes({"bias"', 'Sizes({"biass"'), encoding="utf-8")
    named = diagnosis(("HangingWeight", "x_axis", {"offset": (40.0, "N")}))
    remedied(tmp_path, named, "--plugins", str(plugin), code=1)
    assert "the remedy 'Counterweight' sizes 'biass', which is no parameter of it." in capsys.readouterr().err


@pytest.mark.parametrize(
    ("data", "told"),
    [
        ("no json", "the diagnosis is no JSON file."),
        ({"schema": "lathesim-answer/1"}, "the file has the schema 'lathesim-answer/1', and the diagnosis has"),
        (diagnosis(("CoulombFriction", "y_axis", {"level": (20.0, "N")})), "the machine of this lesson has no part 'y_axis'."),
        ({**diagnosis(("CoulombFriction", "x_axis", {"level": (20.0, "N")})), "insert": []}, "has no line to insert for CoulombFriction."),
        ({**diagnosis(("CoulombFriction", "x_axis", {"level": (20.0, "N")})), "effects": 3}, "'effects' of the diagnosis is no list."),
        ({**diagnosis(("CoulombFriction", "x_axis", {"level": (20.0, "N")})), "baseline": [2]}, "'baseline' of the diagnosis is no table."),
        (diagnosis(("CoulombFriction", "x_axis", {"level": (float("nan"), "N")})), "a value of the diagnosis is no number."),
        (diagnosis(("Nothing", "x_axis", {"level": (20.0, "N")})), "there is no effect 'Nothing'."),
    ],
)
def test_a_diagnosis_at_fault_gets_one_sentence(data: Any, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    remedied(tmp_path, data, code=1)
    assert told in one_sentence(capsys)


@pytest.mark.slow
def test_a_tied_or_inadequate_diagnosis_says_what_may_not_be_claimed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = diagnosis(("ForceOffset", "x_axis", {"offset": (40.0, "N")}), verdict="tied", adequate=False)
    found["effects"][0]["tied_with"] = ["ConverterOffset"]
    remedied(tmp_path, found)
    told = capsys.readouterr().out
    assert "it may be ConverterOffset instead" in told
    assert "nothing of the rest" in told


def test_a_remedy_is_not_put_in_twice(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = diagnosis(("ForceOffset", "x_axis", {"offset": (40.0, "N")}))
    entry = "insert:\n  - {remedy: CommandBias, at: x_controller, name: x_controller_command_bias, bias: 1.1 V}\n"
    source = load_lesson(AXIS)
    mended = source.text.partition("variants:")[0].replace("../", f"{source.path.parents[1]}/") + entry
    (tmp_path / "mended.yaml").write_text(mended, encoding="utf-8")
    remedied(tmp_path, found, lesson=str(tmp_path / "mended.yaml"), code=1)
    assert "the lesson has CommandBias at x_controller already." in capsys.readouterr().err


@pytest.mark.slow
def test_a_table_that_folds_back_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = remedied(tmp_path, diagnosis(("CumulativePitchError", "x_scale", {"slope": (1e-4, "1")})))
    table = next(out.glob("*.csv"))
    lines = table.read_text().splitlines()
    table.write_text("\n".join([*lines[:-2], lines[-1], lines[-2]]) + "\n")
    assert "the positions of a table rise." in refused(capsys, "run", out / "lesson.yaml", "--out", tmp_path / "r.h5").err


@pytest.mark.slow
def test_a_mirrored_program_takes_the_friction_away_on_a_closed_control(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = diagnosis(("CoulombFriction", "x_axis", {"level": (20.1, "N")}))
    out = remedied(tmp_path, found, "--as", "program", lesson=concealed(tmp_path, "CoulombFriction:level=20 N@x_axis"))
    done(capsys, "program", out / "mirrored.nc")
    assert removed_share(tmp_path, out / "lesson_program.yaml") > 0.9


def test_a_program_of_way_points_keeps_time_however_small_the_steps() -> None:
    rng = np.random.default_rng(4)
    slow = np.cumsum(rng.normal(0.0, 1e-9, 400))
    asked = np.stack([np.concatenate([slow, np.full(7, slow[-1]), slow[-1] + np.linspace(0.0, 2e-3, 50)])])
    asked[:, 0] = 0.0
    place, found = 0.0, [0.0]
    for line in program_text(asked, 1e-3, ["X"], None).splitlines()[4:-1]:
        words = {word[0]: float(word[1:]) for word in line.split()}
        if words["G"] == 4.0:
            found += [place] * round(words["P"] / 1e-3)
            continue
        lasts = abs(words["X"] - place) / words["F"] * 60.0 / 1e-3
        assert 0.99 < lasts < 1.0 + 1e-6
        place = words["X"]
        found.append(place)
    assert np.allclose(found, 1e3 * asked[0], atol=0.51e-6)
    assert len(found) == asked.shape[1]


@pytest.mark.slow
def test_what_bends_under_the_cut_is_mirrored_and_what_a_recorder_does_is_not(tmp_path: Path) -> None:
    lathe = str(Path(__file__).with_name("concealed_lathe.yaml"))
    found = diagnosis(("ToolCompliance", "x_scale", {"compliance": (3e-8, "m/N")}))
    found["insert"][0]["force"] = "cutting_force.radial_force"
    out = remedied(tmp_path, found, "--as", "program", lesson=lathe)
    registry, source = load_registry(), load_lesson(lathe)
    bending = "insert: [{effect: ToolCompliance, at: x_scale, compliance: 3e-8 m/N, force: cutting_force.radial_force}]\n"
    mirrored = load_lesson(str(out / "lesson_program.yaml"))
    sound, bent, mended = (
        simulate(lesson, registry)["x_scale.position"]
        for lesson in (
            source,
            lesson_from_text(source.text + bending, source.path),
            lesson_from_text(mirrored.text + bending, mirrored.path),
        )
    )
    assert np.std(mended - sound) < 0.1 * np.std(bent - sound)
    out = remedied(tmp_path / "recorder", diagnosis(("ClockSkew", "x_scale", {"skew": (1e-4, "1")})), "--as", "program")
    assert not (out / "mirrored.nc").is_file()


@pytest.mark.slow
def test_a_mirrored_path_that_gouges_or_leaves_the_travel_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    remedied(tmp_path, diagnosis(("Backlash", "x_scale", {"width": (5e-3, "m")})), "--as", "program", code=1)
    assert "gouges" in one_sentence(capsys)
    source = load_lesson(AXIS)
    machine = (source.path.parent / "machines" / "cascade_axis.yaml").read_text()
    (tmp_path / "machines").mkdir()
    (tmp_path / "machines" / "short_axis.yaml").write_text(machine + "\ntravel: {x_low: 0 mm, x_high: 180 mm}\n")
    text = source.text.replace("machine: cascade_axis", "machine: short_axis")
    text = text.replace("../part_programs", str(source.path.parent.parent / "part_programs"))
    (tmp_path / "lesson.yaml").write_text(text)
    found = diagnosis(("CumulativePitchError", "x_scale", {"slope": (-1e-4, "1"), "origin": (0.05, "m")}))
    remedied(tmp_path, found, "--as", "program", lesson=str(tmp_path / "lesson.yaml"), code=1)
    assert "the machine travels from 0" in one_sentence(capsys)


def removed_again(tmp_path: Path, effect: str, found: dict[str, Any], *options: str, change: tuple[str, str] = ("", "")) -> float:
    """Return the share of a hidden effect that the remedy for a diagnosis removes on the concealed machine."""
    out = remedied(tmp_path, found, *options, lesson=concealed(tmp_path, effect))
    lesson = out / "lesson.yaml"
    if change[0]:
        lesson.write_text(re.sub(*change, lesson.read_text()))
    return removed_share(tmp_path, lesson)


@pytest.mark.slow
def test_a_remedy_on_the_reference_is_recorded_again(tmp_path: Path) -> None:
    assert removed_again(tmp_path, "Backlash:width=12 um@x_scale", diagnosis(("Backlash", "x_scale", {"width": (12e-6, "m")}))) > 0.9


@pytest.mark.slow
def test_without_the_margin_an_uncertain_size_overcompensates(tmp_path: Path) -> None:
    found = diagnosis(("CoulombFriction", "x_axis", {"level": (25.0, "N")}))
    found["effects"][0]["parameters"]["level"] |= {"low": 15.0, "high": 35.0}
    hidden = "CoulombFriction:level=20 N@x_axis"
    assert removed_again(tmp_path / "with", hidden, found) > removed_again(tmp_path / "without", hidden, found, "--without-margin") + 0.05


@pytest.mark.slow
def test_without_the_model_of_the_loop_the_pulse_comes_at_the_wrong_time(tmp_path: Path) -> None:
    found = diagnosis(("CoulombFriction", "x_axis", {"level": (20.0, "N")}))
    hidden = "CoulombFriction:level=20 N@x_axis"
    early = removed_again(tmp_path / "early", hidden, found, change=(r"  (lag|inner): .*", r"  \1: 0 s"))
    assert removed_again(tmp_path / "model", hidden, found) > early + 0.03


@pytest.mark.slow
def test_a_circle_is_promised_quadrant_by_quadrant(tmp_path: Path) -> None:
    lesson = load_lesson("23_mend_this_machine")
    own = lesson.text.partition("variants:")[0]
    (tmp_path / "circle.yaml").write_text(own, encoding="utf-8")
    inertia = {"level": (100.0, "N")}
    found = diagnosis(("CoulombFriction", "x_axis", inertia), ("CoulombFriction", "z_axis", inertia))
    for entry in found["insert"]:
        entry["inertia"] = "9720 kg"
    out = remedied(tmp_path, found, lesson=str(tmp_path / "circle.yaml"))
    promise = json.loads((out / "remedy.json").read_text())["promise"]
    for quarter in ("+X", "+Z", "-X", "-Z"):
        size = promise[f"circular_spread at {quarter}"]
        assert size["after"] < 0.3 * size["before"]


@pytest.mark.slow
def test_the_table_for_a_control_is_in_its_units(tmp_path: Path) -> None:
    out = remedied(tmp_path, diagnosis(("Backlash", "x_scale", {"width": (10e-6, "m")})), "--as", "table")
    assert "play" in (out / "control_table.txt").read_text()
    assert " um" in (out / "control_table.txt").read_text()


PLAY = 10e-6


def along_the_play(times: float, folder: Path) -> tuple[float, float]:
    """Return the shares of the error that a shift of ``times`` the true play leaves: with its sign, and of its rms."""
    shift = {"width": times * PLAY, "lag": 5.393e-3, "inner": 10.64e-3, "spread": 5.2e-3}
    line = InsertedRemedy("BacklashShift", "x_controller", "x_controller_backlash_shift", shift)
    effect = {"effect": "Backlash", "at": "x_scale", "name": "x_scale_backlash", "width": f"{PLAY} m"}
    bench = Diagnosed(load_lesson("22_what_is_wrong_with_this_machine"), load_registry(), (effect,), {}, folder).bench([line])
    sound, bare, mended = (bench.table(record)[0] for record in bench.runs([bench.sound, bench.bare, {}], exact=True))
    before, after = bare - sound, mended - sound
    return float(after @ before / (before @ before)), float(np.sqrt(np.mean(after**2) / np.mean(before**2)))


@pytest.mark.parametrize(("times", "left"), [(0.5, 0.5), (1.0, 0.0), (1.5, -0.5), (2.0, -1.0)])
def test_more_than_the_true_play_is_an_error_of_the_other_sign(times: float, left: float, tmp_path: Path) -> None:
    along, rms = along_the_play(times, tmp_path)
    # at a reversal the drive takes its time to cross the play, the longer the more it is asked to cross
    assert along == pytest.approx(left, abs=0.02 * times)
    assert rms == pytest.approx(abs(left), abs=0.04)
