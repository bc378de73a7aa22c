"""One verdict from several recordings of a machine, and the program that a tied diagnosis asks for."""

import json
import threading
from dataclasses import replace
from pathlib import Path

import pytest

from lathesim.diagnosis.records.diagnosis import ChannelFit, Diagnosis, Evidence, FoundEffect, Verdict
from lathesim.experiments import sequence
from lathesim.experiments.design_experiment import DesignWish
from lathesim.experiments.sequence import joined
from lathesim.lessons.lesson import Lesson, load_lesson
from lathesim.plugins import load_registry
from tests.cli.command import call, done, json_of, refused
from tests.diagnosis.pushed_table import Hidden, write_case
from tests.diagnosis.sample_diagnoses import made, varied

LESSON = "22_what_is_wrong_with_this_machine"
ONLY = ("--effect", "CoulombFriction", "--effect", "ForceOffset", "--effect", "TorqueRipple")
GENERAL = "Constant speeds in both directions."
ONE_WAY = """\
(One way only: dry friction and a friction with two levels look the same)
N10 G90 G94 G71 G18
N20 G01 X10.0 F600
N30 X30.0 F1200
N40 X60.0 F1800
N50 X62.0 F300
N60 M30
"""


@pytest.mark.parametrize("times", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_further_recordings_judge_the_new_one(times: int, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    lesson, new, before = write_case(tmp_path, Hidden(dry=8.0))
    told = json_of(capsys, "diagnose", lesson, new, *("--with", lesson, before) * times, *ONLY, "--json", "-", "--no-report")
    assert told["verdict"] == "named"
    assert [(item["effect"], item["at"]) for item in told["effects"]] == [("CoulombFriction", "x_axis")]
    assert {item["recording"] for item in told["fit"].values()} == {before.name}


def test_recordings_called_the_same_are_told_apart(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    lesson, new, before = write_case(tmp_path, Hidden(dry=8.0))
    (tmp_path / "before").mkdir()
    other = before.rename(tmp_path / "before" / new.name)
    said = json_of(capsys, "diagnose", lesson, new, "--with", lesson, other, *ONLY, "--json", "-", "--no-report")
    assert {item["recording"] for item in said["fit"].values()} == {str(other)}


def test_recordings_of_different_machines_are_not_joined(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    lesson, new, before = write_case(tmp_path, Hidden(dry=8.0))
    other = tmp_path / "other.yaml"
    other.write_text(lesson.read_text(encoding="utf-8").replace("x_axis.mass: 40 kg", "x_axis.mass: 55 kg"), encoding="utf-8")
    said = refused(capsys, "diagnose", lesson, new, "--with", other, before, *ONLY, "--no-report")
    assert "the recordings are of different machines: x_axis.mass is" in said.err


def tied() -> Diagnosis:
    """Return a diagnosis that could not tell play from friction."""
    found = FoundEffect(
        "Backlash", "x_scale", "reversal", 0.6, {}, tied_with=("PreslidingFriction at x_axis",), separating_experiment=GENERAL
    )
    told = f"Backlash cannot be told from PreslidingFriction at x_axis here. {GENERAL}"
    return made("tied", "", LESSON, "r.csv", "r.csv", effects=(found,), not_told=(told,))


@pytest.fixture
def few_programs(monkeypatch: pytest.MonkeyPatch) -> Lesson:
    """Lesson 12, for which few and short programs are tried."""
    monkeypatch.setattr(sequence, "DesignWish", lambda: DesignWish(at_most=5.0, candidates=4, draws=1))
    return load_lesson(LESSON)


@pytest.mark.slow
def test_tied_diagnosis_names_the_program_that_is_written(few_programs: Lesson, tmp_path: Path) -> None:
    heard: list[str] = []
    registry = load_registry(installed=False)
    found = sequence.with_designed_program(tied(), few_programs, registry, tmp_path / "next", None, heard.append)
    program = tmp_path / "next" / "program.nc"
    assert found.effects[0].separating_experiment == str(program)
    assert "M30" in program.read_text(encoding="utf-8")
    assert load_lesson(tmp_path / "next" / "lesson.yaml").title == "What is wrong with this machine?, the next run"
    assert heard[-1] == f"The program that would tell is {program}."
    (advice,) = found.rest.not_told
    assert GENERAL not in advice
    assert advice.endswith(f"Run {program}, and diagnose it with {program.with_name('lesson.yaml')} together with this recording (--with).")


def test_stopped_design_keeps_the_diagnosis(few_programs: Lesson, tmp_path: Path) -> None:
    stop = threading.Event()
    stop.set()
    heard: list[str] = []
    registry = load_registry(installed=False)
    assert sequence.with_designed_program(tied(), few_programs, registry, tmp_path / "next", None, heard.append, stop) == tied()
    assert heard[-1] == "No program is designed: stopped before one was tried."
    assert not (tmp_path / "next").exists()


def test_diagnosis_without_a_tie_needs_no_program(few_programs: Lesson, tmp_path: Path) -> None:
    heard: list[str] = []
    named = made("named", "", LESSON, "r.csv", "r.csv", effects=(FoundEffect("Backlash", "x_scale", "reversal", 0.99, {}),))
    registry = load_registry(installed=False)
    assert sequence.with_designed_program(named, few_programs, registry, tmp_path / "next", None, heard.append) == named
    assert heard == ["No program is designed: the diagnosis (named) leaves no explanations to distinguish."]


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_tie_of_a_one_way_run_is_split_by_the_designed_program(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("one_way.nc").write_text(ONE_WAY, encoding="utf-8")
    text = load_lesson(LESSON).path.read_text(encoding="utf-8").partition("variants:")[0]
    text = text.replace("../part_programs/axis_exercise.nc", "one_way.nc").replace("duration: 17 s", "duration: 5 s")
    Path("one_way.yaml").write_text(text, encoding="utf-8")
    hidden = ("--effect", "CoulombFriction:level=20 N@x_axis", "--seed", "5")
    done(capsys, "conceal", "one_way.yaml", *hidden, "--out", "first")
    done(capsys, "diagnose", "first/lesson.yaml", "first/recording.csv", "--design", "--out", "answer", "--json", "tied.json")
    told = json.loads(Path("tied.json").read_text(encoding="utf-8"))
    assert told["verdict"] == "tied"
    assert told["effects"][0]["separating_experiment"] == "answer/next/program.nc"
    done(capsys, "program", "answer/next/program.nc")
    done(capsys, "conceal", "answer/next/lesson.yaml", *hidden, "--out", "second")
    joined = call(
        capsys,
        "diagnose", "second/lesson.yaml", "second/recording.csv", "--with", "first/lesson.yaml", "first/recording.csv", "--no-report",
        "--json", "-",
    )  # fmt: skip
    assert joined.code == 0, joined.err
    told = json.loads(joined.out)
    assert told["verdict"] == "named"
    assert [(item["effect"], item["at"], item["tied_with"]) for item in told["effects"]] == [("CoulombFriction", "x_axis", [])]


def judged_by(recording: str, named: str, *tied: str, gains: dict[str, tuple[float, float]]) -> Diagnosis:
    """Return the answer of a recording that was judged by another one: what it names, what ties with that, and the gains of all."""
    effect = FoundEffect(named, "x_axis", "reversal", 0.6, {}, tied_with=tied)
    tried = tuple((f"{name} at x_axis", *sizes) for name, sizes in gains.items())
    verdict: Verdict = "tied" if tied else "named"
    return made(verdict, "", LESSON, "new.csv", recording, effects=(effect,), evidence=Evidence(tried=tried))


def test_likelihoods_of_several_recordings_add_up_to_one_name() -> None:
    # neither recording tells alone: friction leads by little on the first, and by more than 3 % of all on both together
    first = judged_by("a.csv", "Backlash", "CoulombFriction", gains={"Backlash": (900.0, 805.0), "CoulombFriction": (895.0, 800.0)})
    second = judged_by("b.csv", "CoulombFriction", gains={"Backlash": (900.0, 400.0), "CoulombFriction": (895.0, 950.0)})
    found = joined([first, second])
    assert found.verdict == "named"
    assert [(effect.effect, effect.tied_with) for effect in found.effects] == [("CoulombFriction", ())]
    assert found.effects[0].probability > 0.99


def test_recordings_that_do_not_tell_together_leave_the_tie() -> None:
    gains = {"Backlash": (900.0, 805.0), "CoulombFriction": (895.0, 800.0)}
    found = joined([judged_by(name, "Backlash", "CoulombFriction", gains=gains) for name in ("a.csv", "b.csv")])
    assert found.verdict == "tied"
    assert found.effects[0].tied_with == ("CoulombFriction at x_axis",)


def test_one_other_recording_adds_its_likelihood_too() -> None:
    # the new recording alone leaves a tie, what judges is far ahead
    gains = {"Backlash": (900.0, 800.0), "CoulombFriction": (895.0, 600.0)}
    found = joined([judged_by("a.csv", "Backlash", "CoulombFriction", gains=gains)])
    assert found.verdict == "named"
    assert found.effects[0].tied_with == ()


def test_an_answer_without_effects_stays_as_it_is() -> None:
    nothing = made("no_mismatch", "", LESSON, "new.csv", "a.csv")
    assert joined([nothing]).verdict == "no_mismatch"
    near, far = (
        varied(nothing, validation=name, fit={"x.speed": ChannelFit("m/s", 1.0, off, off, name)}) for name, off in (("a", 2.0), ("b", 6.0))
    )
    shown = joined([near, far])
    assert (shown.question.validation, shown.question.judges) == ("b", ("a", "b"))
    lag = replace(nothing, verdict="named", effects=(FoundEffect("CurrentLoopLag", "spindle", "lag", 1.0, {}),))
    even = joined([nothing, lag])
    assert (even.verdict, [(one.effect, one.probability) for one in even.effects]) == ("tied", [("CurrentLoopLag", 0.5)])


@pytest.mark.parametrize(("behind", "verdict", "ties"), [(40.0, "named", ()), (10.0, "tied", ("Cogging",))])
def test_effects_that_stand_together_are_held_against_what_was_tried_in_their_place(
    behind: float, verdict: str, ties: tuple[str, ...]
) -> None:
    # 3 % of 1600 nats on both recordings are 48
    effects = (
        FoundEffect("CoulombFriction", "x_axis", "reversal", 0.9, {}),
        FoundEffect("TorqueRipple", "x_axis", "once per turn", 0.6, {}, tied_with=("Cogging",)),
    )
    evidence = Evidence(
        tried=(("CoulombFriction at x_axis", 900.0, 900.0), ("TorqueRipple at x_axis", 800.0, 800.0)),
        runners_up=(("CoulombFriction at x_axis", "DriveGain at x_axis", 300.0), ("TorqueRipple at x_axis", "Cogging at x_axis", behind)),
    )
    answers = [made("tied", "", LESSON, "new.csv", name, effects=effects, evidence=evidence) for name in ("a.csv", "b.csv")]
    found = joined(answers)
    assert found.verdict == verdict
    assert [effect.tied_with for effect in found.effects] == [(), ties]
