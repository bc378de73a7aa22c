"""A lesson as a notebook: a file that Jupyter opens, whose cells run as they stand, and that gives no solution away."""

import contextlib
import io
import json
from pathlib import Path
from typing import Any

import pytest

import lathesim as ls
from lathesim.classroom.teacher_notes import teacher_notes
from lathesim.errors import LatheSimError
from lathesim.lessons.lesson import load_lesson
from lathesim.shipped import shipped_files
from tests.cli.command import call, done

QUICK = ["18_stability_lobes", "25_which_program_next"]


def checked(path: Path) -> list[dict[str, Any]]:
    """Return the cells of a notebook that has what the format 4.5 requires; Jupyter's own check is made where it is installed."""
    data = json.loads(path.read_text(encoding="utf-8"))
    assert (data["nbformat"], data["nbformat_minor"]) == (4, 5)
    assert set(data["metadata"]["kernelspec"]) >= {"name", "display_name"}
    for cell in data["cells"]:
        further = {"execution_count", "outputs"} if cell["cell_type"] == "code" else set()
        assert set(cell) == {"cell_type", "id", "metadata", "source"} | further
    assert len({cell["id"] for cell in data["cells"]}) == len(data["cells"])
    with contextlib.suppress(ImportError):
        import nbformat

        nbformat.validate(data)
    return list(data["cells"])


def run_cells(cells: list[dict[str, Any]]) -> str:
    """Run the code cells one after the other, as a notebook does, and return what they printed."""
    names: dict[str, Any] = {}
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        for cell in cells:
            if cell["cell_type"] == "code":
                exec("".join(cell["source"]), names)  # noqa: S102
    return printed.getvalue()


@pytest.mark.parametrize(
    "name",
    [pytest.param(path.stem, marks=[] if path.stem in QUICK else pytest.mark.slow) for path in shipped_files("lesson_configs", "*.yaml")],
)
def test_the_cells_of_a_notebook_run(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    assert call(capsys, "notebook", name).out == f"See {name}.ipynb\n"
    cells, lesson = checked(tmp_path / f"{name}.ipynb"), load_lesson(name)
    printed = run_cells(cells)
    assert printed.count("{'") >= max(1, len(lesson.variants)) + len(lesson.settings.try_)
    text = "".join("".join(cell["source"]) for cell in cells)
    assert all(question.ask in text for question in lesson.settings.questions)
    assert all(task in text for task in lesson.settings.try_)
    numbers = [note.answer for note, asked in zip(teacher_notes(lesson).answers, lesson.settings.questions, strict=True) if asked.within]
    assert not any(number in text for number in numbers)


def test_a_lesson_of_ones_own_is_found_from_the_folder_of_the_notebook(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    lesson = tmp_path / "own" / "mine.yaml"
    lesson.parent.mkdir()
    choice = "questions: [{ask: Which?, choices: [one, two], answer: two}, {ask: How long?, within: 1 mm, answer: 4 mm}]"
    lesson.write_text(f"lesson: Mine\nmachine: turning_with_chatter\n{choice}\n", encoding="utf-8")
    done(capsys, "notebook", lesson, "--out", tmp_path / "books" / "mine.ipynb")
    monkeypatch.chdir(tmp_path / "books")
    cells = checked(Path("mine.ipynb"))
    (first,) = (cell["source"][-1] for cell in cells if "import lathesim as ls\n" in cell["source"])
    assert first == "lesson = ls.lesson('../own/mine.yaml')"
    answered = [{**cell, "source": [line.replace('answer = ""', 'answer = "two"') for line in cell["source"]]} for cell in cells[-3:]]
    found = {"lesson": ls.lesson("../own/mine.yaml")}
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        exec("".join(answered[0]["source"]), found)  # noqa: S102
    assert printed.getvalue() == "Right.\n"
    assert call(capsys, "notebook", lesson, "--out", "mine.txt").err == "mine.txt: a notebook cannot be written as '.txt'. Use .ipynb.\n"


def test_an_answer_is_judged_in_python() -> None:
    lesson = ls.lesson("01")
    assert not lesson.is_right(2, "1 1/s")
    with pytest.raises(LatheSimError, match=r"there is no question 3\. The lesson has 2\."):
        lesson.is_right(3, "1")
    with pytest.raises(LatheSimError, match="is not among the choices"):
        lesson.is_right(1, "nowhere")


def test_a_notebook_shows_a_figure() -> None:
    record = ls.lesson("18").run()
    assert record.plot("mode.displacement")._repr_png_().startswith(b"\x89PNG")
