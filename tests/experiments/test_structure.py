"""Changes that an emulation may make to the structure of a machine."""

from lathesim.experiments.structure_search import changed, possible_changes
from lathesim.lessons.changed_lesson import changed_lesson
from lathesim.lessons.lesson import lesson_from_text, load_lesson
from lathesim.lessons.simulate import prepare
from lathesim.plugins import load_registry


def test_values_that_a_change_brings_are_written_in_units_that_a_lesson_takes() -> None:
    registry, lesson = load_registry(installed=False), load_lesson("27_a_controller_that_tells_nothing")
    changes = possible_changes(prepare(lesson, registry), registry)
    held = changed(lesson, changes)
    brought = {value.name: value for change in changes for value in change.brings}
    values = {name: f"{value.high:.6g} {value.unit}".removesuffix(" 1") for name, value in brought.items()}
    text = changed_lesson(held, [], values, held.path.parent)
    plan = prepare(lesson_from_text(text, held.path), registry).plan

    assert any(name.endswith("coulomb_friction.level") for name in brought)
    for name, value in brought.items():
        assert plan.values[name] == float(f"{value.high:.6g}"), name
