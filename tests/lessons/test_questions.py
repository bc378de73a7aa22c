"""Questions of a lesson: which answers are right, how they are sealed, and how a grade counts them."""

from __future__ import annotations

from pathlib import Path

import pytest

from lathesim.errors import LatheSimError
from lathesim.lessons.grading import grade_file
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.questions import answers_file, is_right, keep_answer, read_answers, seal
from lathesim.lessons.schema import LessonQuestion
from lathesim.lessons.simulate import simulate
from lathesim.plugins import Registry
from lathesim.record_writer import save
from tests.cli.command import done, json_of

NUMBER = LessonQuestion(ask="How large?", within="0.02 mm", answer="0.685 mm")
CHOICE = LessonQuestion(ask="Which?", choices=["the first", "the second"], answer="the second")
LESSON = """\
lesson: Mine
machine: turning_with_chatter
duration: 2 ms
questions:
  - {ask: How large?, within: 0.02 mm, answer: 0.685 mm}
  - {ask: Which?, choices: [the first, the second], answer: the second}
"""


@pytest.mark.parametrize("sealed", [False, True])
@pytest.mark.parametrize(
    ("answer", "right"),
    [("0.685 mm", True), ("0.704 mm", True), ("667 um", True), ("0.71 mm", False), ("0.66 mm", False), ("-0.685 mm", False)],
)
def test_a_number_is_right_within_its_tolerance_in_any_unit(answer: str, right: bool, sealed: bool) -> None:
    question = LessonQuestion(ask=NUMBER.ask, within=NUMBER.within, sealed=seal(NUMBER, "0.685 mm")) if sealed else NUMBER
    assert is_right(question, answer) == right


def test_a_choice_is_right_where_it_is_the_sealed_one() -> None:
    sealed = LessonQuestion(ask=CHOICE.ask, choices=CHOICE.choices, sealed=seal(CHOICE, "the second"))
    assert [is_right(sealed, choice) for choice in ("the first", "the second")] == [False, True]


@pytest.mark.parametrize(
    ("question", "answer", "message"),
    [
        (NUMBER, "0.685", "has no unit"),
        (NUMBER, "0.685 s", "is given in s, but mm is wanted"),
        (CHOICE, "the third", "'the third' is not among the choices. Choose one of: the first, the second."),
    ],
)
def test_what_is_no_answer_is_refused(question: LessonQuestion, answer: str, message: str) -> None:
    with pytest.raises(LatheSimError, match=message):
        is_right(question, answer)


def test_answers_are_kept_beside_the_run_and_counted(
    registry: Registry, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.yaml").write_text(LESSON, encoding="utf-8")
    run = tmp_path / "run.h5"
    save(simulate(load_lesson("mine.yaml"), registry, engine="plain"), run)
    assert [grade_file(run, registry).right, len(grade_file(run, registry).questions)] == [0, 2]
    answers = keep_answer(run, "mine", {}, "Which?", "the first")
    answers = keep_answer(run, "mine", answers, "Which?", "the second")
    keep_answer(run, "mine", answers, "How large?", "1 mm")
    assert read_answers(run)["Which?"].tries == 2
    found = grade_file(run, registry).questions
    assert [(item.question, item.answer, item.right) for item in found] == [("How large?", "1 mm", False), ("Which?", "the second", True)]
    said = done(capsys, "grade", "run.h5").out
    assert "How large? 1 mm (not right)\nWhich? the second (right)\n1 of 2 questions answered right." in said
    assert done(capsys, "grade", "run.h5", "--csv").out.splitlines()[1].endswith(",1,2")
    assert [item["right"] for item in json_of(capsys, "grade", "run.h5", "--json")["records"][0]["questions"]] == [False, True]
    answers_file(run).write_text("{ not json", encoding="utf-8")
    assert grade_file(run, registry).right == 0


def test_check_seals_the_answers_that_stand_in_clear(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("mine.yaml").write_text(LESSON, encoding="utf-8")
    said = done(capsys, "check", "mine.yaml").out
    assert f"to seal the answer to 'Which?', write instead of it: sealed: {seal(CHOICE, 'the second')}" in said


def test_no_shipped_lesson_has_an_answer_in_clear() -> None:
    from lathesim.shipped import shipped_files

    for path in shipped_files("lesson_configs", "*.yaml"):
        assert all(question.sealed is not None for question in load_lesson(path).settings.questions), path.name


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("{ask: a, choices: [b, c], answer: d}", "mine.yaml:3:47: 'd' is not among the choices. Write it as it stands there."),
        ("{ask: a, within: 1 mm, answer: 1 s}", "mine.yaml:3:44: '1 s' is given in s, but mm is wanted. Use a unit like mm."),
        ("{ask: a, answer: 1 mm}", "mine.yaml:3:13: a question has either 'choices' or a tolerance, 'within'. Write one of them."),
        ("{ask: a, within: 1 mm}", "mine.yaml:3:13: a question has either an 'answer' or a 'sealed' one. Write one of them."),
    ],
)
def test_a_faulty_question_is_refused(line: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, registry: Registry) -> None:
    monkeypatch.chdir(tmp_path)
    Path("mine.yaml").write_text(f"lesson: Mine\nmachine: turning_with_chatter\nquestions: [{line}]\nduration: 2 ms\n", encoding="utf-8")
    with pytest.raises(LatheSimError) as caught:
        simulate(load_lesson("mine.yaml"), registry)
    assert str(caught.value) == message
