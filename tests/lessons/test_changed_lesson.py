"""A lesson written out again with what was found: it loads, runs, and has the effect in it."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from lathesim.lessons.changed_lesson import changed_lesson
from lathesim.lessons.lesson import Lesson, load_lesson
from lathesim.lessons.simulate import prepare, simulate
from lathesim.plugins import Registry
from tests.diagnosis.small_case import write_lesson

FRICTION = {"effect": "CoulombFriction", "at": "x_axis", "level": "20 N"}


@pytest.fixture
def lesson(tmp_path: Path) -> Lesson:
    return load_lesson(write_lesson(tmp_path, duration="0.4 s"))


def written(lesson: Lesson, folder: Path, insert: list[dict[str, str]], values: dict[str, str]) -> Lesson:
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "explained.yaml"
    path.write_text(changed_lesson(lesson, insert, values, folder), encoding="utf-8")
    return load_lesson(path)


def test_it_loads_with_the_effect_and_the_values(lesson: Lesson, registry: Registry, tmp_path: Path) -> None:
    changed = written(lesson, tmp_path / "found" / "deep", [FRICTION], {"x_axis.mass": "97 kg"})
    prepared = prepare(changed, registry)
    parts = {part.name: part for part in prepared.machinery.parts}
    assert parts["x_axis_coulomb_friction"].parameters["level"] == 20.0
    assert parts["x_axis"].parameters["mass"] == 97.0


def test_it_runs_and_the_friction_is_felt(lesson: Lesson, registry: Registry, tmp_path: Path) -> None:
    changed = written(lesson, tmp_path / "found", [FRICTION], {})
    before, after = (simulate(one, registry, engine="plain") for one in (lesson, changed))
    assert after.status == before.status
    assert len(after) == len(before)
    assert np.std(after["x_controller.voltage"] - before["x_controller.voltage"]) > 0.05


def test_without_changes_it_is_the_same_machine(lesson: Lesson, registry: Registry, tmp_path: Path) -> None:
    changed = written(lesson, tmp_path / "found", [], {})
    before, after = (simulate(one, registry, engine="plain") for one in (lesson, changed))
    assert np.array_equal(before["x_encoder.position"], after["x_encoder.position"])


def test_what_was_inserted_before_stays(registry: Registry, tmp_path: Path) -> None:
    extra = "insert:\n  - {effect: ForceOffset, at: x_axis, offset: 3 N}\nset: {x_axis.viscous: 210 N*s/m}\n"
    lesson = load_lesson(write_lesson(tmp_path, duration="0.4 s", extra=extra))
    changed = written(lesson, tmp_path / "found", [FRICTION], {"x_axis.mass": "97 kg"})
    parts = {part.name: part for part in prepare(changed, registry).machinery.parts}
    assert {"x_axis_force_offset", "x_axis_coulomb_friction"} <= set(parts)
    assert (parts["x_axis"].parameters["viscous"], parts["x_axis"].parameters["mass"]) == (210.0, 97.0)


def test_a_value_that_was_set_is_set_anew(registry: Registry, tmp_path: Path) -> None:
    lesson = load_lesson(write_lesson(tmp_path, extra="set: {x_axis.mass: 90 kg}\n"))
    changed = written(lesson, tmp_path / "found", [], {"x_axis.mass": "97 kg"})
    assert next(part for part in prepare(changed, registry).machinery.parts if part.name == "x_axis").parameters["mass"] == 97.0


def test_a_template_and_a_program_beside_the_lesson_are_found_from_the_new_folder(registry: Registry, tmp_path: Path) -> None:
    path = write_lesson(tmp_path)
    template = Path(__file__).parents[2] / "lesson_configs" / "machines" / "cascade_axis.yaml"
    (tmp_path / "own_axis.yaml").write_text(template.read_text(encoding="utf-8"), encoding="utf-8")
    path.write_text(path.read_text(encoding="utf-8").replace("machine: cascade_axis", "machine: own_axis.yaml"), encoding="utf-8")
    changed = written(load_lesson(path), tmp_path / "found", [FRICTION], {})
    data = yaml.safe_load((tmp_path / "found" / "explained.yaml").read_text(encoding="utf-8"))
    assert (data["machine"], data["program"]) == ("../own_axis.yaml", "../small.nc")
    assert prepare(changed, registry).machinery.parts


def test_the_lesson_itself_is_not_touched(lesson: Lesson, tmp_path: Path) -> None:
    before = lesson.path.read_bytes()
    first = changed_lesson(lesson, [FRICTION], {}, tmp_path)
    assert changed_lesson(lesson, [FRICTION], {}, tmp_path) == first
    assert lesson.path.read_bytes() == before


@pytest.mark.parametrize("beside", ["own_axis.yaml", "machines/own_axis.yaml"])
def test_a_template_that_the_lesson_names_without_a_path_is_found_too(beside: str, registry: Registry, tmp_path: Path) -> None:
    path = own_machine(tmp_path / "case", beside)
    changed = written(load_lesson(path), tmp_path / "answers" / "first", [FRICTION], {})
    data = yaml.safe_load(changed.path.read_text(encoding="utf-8"))
    assert (data["machine"], data["program"]) == (f"../../case/{beside}", "../../case/small.nc")
    assert prepare(changed, registry).machinery.parts


def test_it_still_loads_after_lesson_and_answer_have_moved_together(registry: Registry, tmp_path: Path) -> None:
    path = own_machine(tmp_path / "work" / "case", "own_axis.yaml")
    written(load_lesson(path), tmp_path / "work" / "case" / "out", [FRICTION], {})
    (tmp_path / "work").rename(tmp_path / "elsewhere")
    assert prepare(load_lesson(tmp_path / "elsewhere" / "case" / "out" / "explained.yaml"), registry).machinery.parts


def test_a_folder_that_is_a_link_is_followed(registry: Registry, tmp_path: Path) -> None:
    path = own_machine(tmp_path / "case", "own_axis.yaml")
    (tmp_path / "far" / "away").mkdir(parents=True)
    (tmp_path / "case" / "out").symlink_to(tmp_path / "far" / "away", target_is_directory=True)
    assert prepare(written(load_lesson(path), tmp_path / "case" / "out", [FRICTION], {}), registry).machinery.parts


def test_a_machine_that_came_with_lathesim_is_named_as_before(lesson: Lesson, tmp_path: Path) -> None:
    changed = written(lesson, tmp_path / "found", [FRICTION], {})
    assert yaml.safe_load(changed.path.read_text(encoding="utf-8"))["machine"] == "cascade_axis"


def test_the_recording_of_a_lesson_is_named_from_the_new_folder(tmp_path: Path) -> None:
    path = write_lesson(tmp_path)
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("recordings:\n", "recordings:\n  file: recording.csv\n"), encoding="utf-8")
    for named, expected in ((False, "recording.csv"), (True, "../recording.csv")):
        if named:
            (tmp_path / "recording.csv").write_text("t,q\n", encoding="utf-8")
        changed = written(load_lesson(path), tmp_path / "found", [FRICTION], {})
        assert yaml.safe_load(changed.path.read_text(encoding="utf-8"))["recordings"]["file"] == expected


def own_machine(folder: Path, beside: str) -> Path:
    """Write a lesson whose machine template stands beside it under a name of its own, and give the lesson's file."""
    folder.mkdir(parents=True)
    path = write_lesson(folder)
    (folder / beside).parent.mkdir(exist_ok=True)
    template = Path(__file__).parents[2] / "lesson_configs" / "machines" / "cascade_axis.yaml"
    (folder / beside).write_text(template.read_text(encoding="utf-8"), encoding="utf-8")
    path.write_text(path.read_text(encoding="utf-8").replace("machine: cascade_axis", "machine: own_axis"), encoding="utf-8")
    return path
