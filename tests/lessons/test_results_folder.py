"""Results are named after what was read: no input replaces what another one left."""

from __future__ import annotations

from pathlib import Path

import pytest

from lathesim.lessons.lesson import load_lesson, results_folder
from tests.cli.command import done, refused

LESSON = "lesson: L\nmachine: two_axis_lathe\nprogram: one_pass.nc\nduration: 0.1 s\n"


@pytest.fixture(autouse=True)
def in_a_new_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "work").mkdir()
    monkeypatch.chdir(tmp_path / "work")


def written(place: str) -> Path:
    path = Path(place)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(LESSON, encoding="utf-8")
    return path


def test_each_lesson_has_a_folder_of_its_own() -> None:
    places = ["mine.yaml", "mine.yml", "case_1/lesson.yaml", "case_2/lesson.yaml", "a/case_1/lesson.yaml", "lesson_configs/lesson.yaml"]
    places += ["../lesson.yaml", "../case_1/lesson.yaml", "10_feed_and_roughness.yaml", "lathesim_runs/01_contour_error/001.yaml"]
    folders = {place: str(results_folder(load_lesson(written(place)))) for place in places}
    folders["08"] = str(results_folder(load_lesson(Path(__file__).parents[2] / "lesson_configs/10_feed_and_roughness.yaml")))
    assert len(set(folders.values())) == len(folders)
    assert folders["mine.yaml"] == "lathesim_runs/mine"
    assert folders["case_1/lesson.yaml"] == "lathesim_runs/case_1/lesson"
    assert folders["08"] == "lathesim_runs/10_feed_and_roughness"
    assert folders["lathesim_runs/01_contour_error/001.yaml"] == "lathesim_runs/01_contour_error/001"


def test_each_further_file_and_each_variant_has_a_folder_of_its_own() -> None:
    lesson = load_lesson(written("case_1/lesson.yaml"))
    files = ["case_1/a.csv", "case_1/a.mat", "a.csv", "case_2/a.csv", "../a.csv"]
    folders = [results_folder(lesson, Path(file), variant=variant) for file in files for variant in (None, "stiff")]
    folders += [results_folder(lesson, Path("case_1/a.csv"), Path("case_1/b.csv")), results_folder(lesson)]
    assert len(set(folders)) == len(folders)
    assert results_folder(lesson, None, Path("case_1/a.csv")) == Path("lathesim_runs/case_1/lesson/a_csv")


def test_the_run_of_one_case_leaves_that_of_another_alone(capsys: pytest.CaptureFixture[str]) -> None:
    written("case_1/lesson.yaml")
    written("case_2/lesson.yaml")
    done(capsys, "run", "case_1/lesson.yaml", "--no-plots")
    first = Path("lathesim_runs/case_1/lesson/lesson.h5")
    kept = first.read_bytes()
    done(capsys, "run", "case_2/lesson.yaml", "--no-plots")
    done(capsys, "run", "case_1/lesson.yaml", "--no-plots", "--program", "two_steps.nc")
    assert first.read_bytes() == kept
    assert len(list(Path("lathesim_runs").rglob("*.h5"))) == 3


@pytest.mark.parametrize(
    "command", [["conceal", "--effect", "none"], ["learn"], ["experiment", "--for", "x_axis.gain"], ["emulate", "a.csv"]]
)
def test_the_lesson_that_was_read_is_never_replaced(command: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    written("case_1/lesson.yaml")
    name, *further = command
    said = refused(capsys, name, "case_1/lesson.yaml", *further, "--out", "case_1")
    assert said.err.startswith("case_1/lesson.yaml: the new lesson.yaml would replace the lesson that was read")
    assert Path("case_1/lesson.yaml").read_text(encoding="utf-8") == LESSON
