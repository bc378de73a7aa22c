"""A lesson on paper: what stands on the sheet of a student and on that of the teacher, as HTML and PDF."""

from pathlib import Path

import pytest

from lathesim.classroom.sheet import sheet_blocks, write_sheet
from lathesim.classroom.teacher_notes import COPY_NOTES, teacher_notes
from lathesim.errors import RecordError
from lathesim.lessons.lesson import lesson_from_text, load_lesson
from lathesim.shipped import shipped_files
from tests.cli.command import call


def test_the_command_writes_a_page_and_a_pdf_with_the_plot(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    said = call(capsys, "sheet", "18_stability_lobes")
    assert (said.code, said.out) == (0, "See 18_stability_lobes_sheet.html\nSee 18_stability_lobes_sheet.pdf\n")
    page, pdf = Path("18_stability_lobes_sheet.html").read_text(), Path("18_stability_lobes_sheet.pdf").read_bytes()
    assert call(capsys, "sheet", "18_stability_lobes", "--out", "new/sheet.html").out == "See new/sheet.html\n"
    assert page.count("<img") == 1
    assert page.count('class="room"') == len(load_lesson("18_stability_lobes").settings.try_)
    assert pdf.startswith(b"%PDF")
    assert pdf.count(b"/Type /Page\n") + pdf.count(b"/Type /Page ") >= 2
    assert call(capsys, "sheet", "18_stability_lobes", "--solutions", "--out", "own.txt").err.endswith("Use .html or .pdf.\n")


@pytest.mark.parametrize("path", shipped_files("lesson_configs", "*.yaml"), ids=lambda path: path.stem)
def test_only_the_sheet_of_the_teacher_has_answers_and_a_solution(path: Path) -> None:
    lesson = load_lesson(path)
    notes = teacher_notes(lesson)
    student, teacher = sheet_blocks(lesson, None), sheet_blocks(lesson, notes)
    assert not any(block.kind == "answer" for block in student)
    told = [block.text for block in teacher if block.kind == "answer"]
    assert {f"Answer: {note.answer}" for note in notes.answers} <= set(told)
    assert any(text.startswith("Marks") for text in told)
    numbers = [note.answer for note, question in zip(notes.answers, lesson.settings.questions, strict=True) if question.within]
    text = "\n".join(block.text for block in student if block.kind in ("choice", "item"))
    assert not any(number in text for number in numbers)


def test_the_text_of_a_lesson_is_no_html(tmp_path: Path) -> None:
    title = "<script>alert(1)</script> & $x$"
    lesson = lesson_from_text(f"lesson: {title!r}\ntext: 'a *b* `c<d`'\nmachine: turning_with_chatter\n", tmp_path / "mine.yaml")
    for form in ("html", "pdf"):
        write_sheet(tmp_path / f"sheet.{form}", sheet_blocks(lesson, None))
    page = (tmp_path / "sheet.html").read_text()
    assert "<script" not in page
    assert '<p class="text">a <i>b</i> <code>c&lt;d</code></p>' in page
    with pytest.raises(RecordError, match=r"a sheet cannot be written as '\.doc'"):
        write_sheet(tmp_path / "sheet.doc", [])


def test_a_lesson_without_notes_has_no_solutions(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text("lesson: Mine\nmachine: turning_with_chatter\n", encoding="utf-8")
    said = call(capsys, "sheet", path, "--solutions")
    assert (said.code, said.err) == (
        1,
        f"{tmp_path / 'teacher' / 'mine.yaml'}: the lesson has no notes for teachers. {COPY_NOTES}\n",
    )
