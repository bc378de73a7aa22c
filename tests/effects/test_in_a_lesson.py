"""Every stock effect takes its values from the line of a lesson, whatever else it brings along."""

from pathlib import Path

import pytest

from lathesim.component import Parameter
from lathesim.effects.register import stock_effects
from lathesim.engine.assembly import Part
from lathesim.lessons.assemble import assemble
from lathesim.lessons.lesson import load_lesson
from tests.effects.places import PLACES
from tests.effects.rigs import registry

TEMPLATES = {"axis": "cascade_axis", "led": "led_axis", "spindle": "torque_spindle", "cutting": "cutting_process"}


def placed_by(folder: Path, template: str, **entry: str) -> Part:
    """Return the part that a lesson makes of the entry of an effect."""
    lesson = folder / "lesson.yaml"
    line = ", ".join(f'{key}: "{value}"' for key, value in {**entry, "name": "put_in"}.items())
    lesson.write_text(f"lesson: one effect\nmachine: {template}\ninsert: [{{{line}}}]\n", encoding="utf-8")
    return next(part for part in assemble(load_lesson(lesson), registry()).parts if part.name == "put_in")


def quantity(value: float, unit: str) -> str:
    """Return a value as a lesson takes it; the torque of a spindle's port is one."""
    unit = unit.replace("{effort}", "N*m")
    return f"{value}" if unit == "1" else f"{value} {unit}"


@pytest.mark.parametrize("name", stock_effects())
def test_a_lesson_gives_an_effect_its_values(name: str, tmp_path: Path) -> None:
    rig, at, sources, setting = PLACES[name]
    declared = stock_effects()[name].declarations
    wired = {key: source if isinstance(source, str) else quantity(source, declared[key].unit) for key, source in sources.items()}
    here = {"effect": name, "at": at, **wired}
    units = {key: item.unit for key, item in placed_by(tmp_path, TEMPLATES[rig], **here).component.declared(Parameter).items()}
    values = {key: quantity(float(value), units[key]) for key, value in setting.items()}
    placed = placed_by(tmp_path, TEMPLATES[rig], **here, **values)
    assert {key: placed.parameters[key] for key in setting} == pytest.approx(setting)


def test_what_an_effect_is_told_of_its_place_stays_beside_its_values(tmp_path: Path) -> None:
    placed = placed_by(tmp_path, "cascade_axis", effect="SensorFilter", at="x_drive.current", time_constant="2 ms")
    assert placed.parameters == {"time_constant": 2e-3, "held": 1.0}
