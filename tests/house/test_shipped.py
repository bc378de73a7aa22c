"""What goes into the wheel is complete: every lesson finds its machine and its part programs among what ships."""

import tomllib
from pathlib import Path

import pytest

from lathesim.lessons.lesson import find_program, load_lesson, load_machine
from lathesim.program.program_file import load_program
from lathesim.shipped import FOLDERS, shipped_files, shipped_folder
from tests.cli.command import ROOT

LESSONS = shipped_files("lesson_configs", "*.yaml")


def test_the_wheel_holds_the_folders_that_the_program_looks_for() -> None:
    with (ROOT / "pyproject.toml").open("rb") as file:
        included = tomllib.load(file)["tool"]["hatch"]["build"]["targets"]["wheel"]["force-include"]
    assert included == {name: f"lathesim/shipped/{name}" for name in FOLDERS}
    assert all((ROOT / name).is_dir() for name in FOLDERS)


@pytest.mark.parametrize("path", LESSONS, ids=lambda path: path.stem)
def test_a_lesson_finds_its_machine_and_its_programs(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    lesson = load_lesson(path.stem)
    assert lesson.path == path
    assert lesson.machine.path.parent == shipped_folder("lesson_configs") / "machines"
    named = {
        changes["program"] for changes in (lesson.source.data, *lesson.source.data.get("variants", {}).values()) if "program" in changes
    }
    for name in named:
        found = find_program(name, path.parent)
        assert found is not None
        assert found.resolve().parent == shipped_folder("part_programs").resolve()


def test_every_machine_and_every_part_program_can_be_read() -> None:
    for path in shipped_files("lesson_configs/machines", "*.yaml"):
        assert load_machine(path).settings.parts
    for path in shipped_files("part_programs", "*.nc"):
        assert load_program(path, "auto")


def test_lessons_are_numbered_without_a_gap() -> None:
    assert [int(path.name[:2]) for path in LESSONS] == list(range(1, len(LESSONS) + 1))
