"""``lathesim conceal`` and ``lathesim reveal``: a case for a class, and its answer opened."""

import json
from pathlib import Path

import pytest

from tests.cli.command import call, done, json_of, refused
from tests.diagnosis.small_case import write_lesson


@pytest.fixture(scope="module")
def lesson(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_lesson(tmp_path_factory.mktemp("lesson"), "0.5 s")


@pytest.fixture
def case(lesson: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Path:
    folder = tmp_path / "case"
    done(capsys, "conceal", lesson, "--effect", "CoulombFriction:level=20 N@x_axis", "--out", folder, "--seed", "4", "--validate")
    return folder


def test_conceal_writes_the_case_and_tells_the_teacher(case: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert sorted(path.name for path in case.iterdir()) == ["lesson.yaml", "recording.csv", "seal.json", "small.nc", "validate.csv"]
    assert (case.parent / "case_answer.json").is_file()
    said = done(capsys, "reveal", case, case.parent / "case_answer.json")
    assert said.out.startswith("The answer is the one that was sealed.\n\nHidden:\n  CoulombFriction at x_axis (reversal): level = 20 N\n")
    assert "x_axis.mass is " in said.out


def test_a_class_lesson_runs_and_is_in_order(case: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    done(capsys, "check", case / "lesson.yaml")
    done(capsys, "run", case / "lesson.yaml", "--plain", "--no-plots", "--out", tmp_path / "run.h5")


def test_reveal_grades_a_diagnosis(case: Path, capsys: pytest.CaptureFixture[str]) -> None:
    effect = {
        "effect": "CoulombFriction", "at": "x_axis", "family": "reversal", "tied_with": [],
        "parameters": {"level": {"value": 21.4, "unit": "N", "low": 19.5, "high": 23.3}},
    }  # fmt: skip
    guess = case.parent / "guess.json"
    guess.write_text(json.dumps({"schema": "lathesim-diagnosis/1", "verdict": "named", "effects": [effect]}), encoding="utf-8")
    answer = case.parent / "case_answer.json"
    said = done(capsys, "reveal", case, answer, "--guess", guess)
    assert "Right: CoulombFriction at x_axis." in said.out
    assert "level: 21.4 N for 20 N, off by 7.0%, not within 5 %, its interval holds the truth" in said.out
    told = json_of(capsys, "reveal", case / "seal.json", answer, "--guess", guess, "--within", "10", "--json")
    assert told["grade"]["right"] is True
    assert told["grade"]["effects"][0]["parameters"]["level"]["right"] is True
    assert "salt" not in told["answer"]


def test_a_tampered_answer_leaves_with_one_and_one_sentence(case: Path, capsys: pytest.CaptureFixture[str]) -> None:
    answer = case.parent / "case_answer.json"
    answer.write_text(answer.read_text().replace('"value": 20.0', '"value": 25.0'), encoding="utf-8")
    said = call(capsys, "reveal", case, answer)
    assert (said.code, said.out) == (1, "")
    assert said.err == (
        f"{case / 'seal.json'}: the answer does not fit the seal: one of them was changed, or case_answer.json belongs to another case. "
        "Ask for the files as they were made.\n"
    )


def test_a_changed_recording_is_told(case: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (case / "recording.csv").write_text("t\n", encoding="utf-8")
    said = call(capsys, "reveal", case, case.parent / "case_answer.json")
    assert (said.code, said.err) == (0, "recording.csv is missing or not as it was sealed.\n")


def test_a_case_is_not_written_twice(case: Path, lesson: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = refused(capsys, "conceal", lesson, "--effect", "none", "--out", case)
    assert "there is a sealed case here already. Choose another place, or take it away." in said.err


def test_nothing_can_be_hidden(lesson: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = done(capsys, "conceal", lesson, "--effect", "none", "--out", tmp_path / "none", "--answer", tmp_path / "kept.json")
    assert said.out.startswith("Hidden:\n  nothing\n")
    assert json.loads((tmp_path / "kept.json").read_text())["effects"] == []


@pytest.mark.parametrize(
    ("options", "code", "sentence"),
    [
        ([], 2, "Say what is hidden with --effect, or leave it to --random."),
        (["--effect", "none", "--random"], 2, "Say what is hidden with --effect, or leave it to --random."),
        (["--effect", "none", "--effect", "Backlash"], 2, "--effect none hides nothing, so it stands alone."),
        (["--effect", "Backlahs"], 1, "there is no effect 'Backlahs'. Did you mean 'Backlash'?"),
        (["--effect", "none", "--answer", "case/answer.json"], 1, "the answer would lie in the folder for the class."),
        (["--effect", "none", "--drive", "missing.csv"], 1, "missing.csv: there is no such file."),
    ],
)
def test_what_cannot_be_concealed_is_said(
    options: list[str],
    code: int,
    sentence: str,
    lesson: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    said = call(capsys, "conceal", lesson, "--out", "case", *options)
    assert (said.code, said.out) == (code, "")
    assert sentence in said.err


def test_a_recorded_drive_moves_a_lesson_that_has_none(case: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = (case / "lesson.yaml").read_text().replace("  x_controller.reference: exercise.x_reference\n", "  x_controller.reference: 0 m\n")
    (case / "lesson.yaml").write_text(text, encoding="utf-8")
    still = call(capsys, "conceal", case / "lesson.yaml", "--effect", "none", "--out", tmp_path / "a")
    assert (still.code, "--drive FILE" in still.err) == (1, True)
    done(capsys, "conceal", case / "lesson.yaml", "--effect", "none", "--out", tmp_path / "a", "--drive", case / "recording.csv")
    first, second = ((folder / "recording.csv").read_text().splitlines() for folder in (case, tmp_path / "a"))
    assert [line.split(",")[1] for line in second[1:400]] == [line.split(",")[1] for line in first[1:400]]


@pytest.mark.slow
def test_the_shipped_lesson_conceals_at_random(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ("--random", "--validate", "--seed", "5")
    said = done(capsys, "conceal", "22_what_is_wrong_with_this_machine", "--out", tmp_path / "case", *arguments)
    assert "The answer, to be kept: " in said.out
    first, second = ((tmp_path / "case" / name).read_text() for name in ("recording.csv", "validate.csv"))
    assert first.count("\n") == second.count("\n") == 17002
    assert first.splitlines()[5000].split(",")[1] != second.splitlines()[5000].split(",")[1]
