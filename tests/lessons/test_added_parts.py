"""Lessons that add parts to a machine, or pass another quantity through parts that take any."""

from pathlib import Path

import pytest

from lathesim.errors import LatheSimError
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare, simulate
from lathesim.plugins import Registry

MACHINE = """\
machine: A table that is pushed
sample_period: 5 ms
step: 1 ms
parts:
  table: {component: ForceAxis}
  sensor: {component: AnalogSensor, units: {signal: m}, set: {gain: 1 V/mm}}
wires: {table.force: 1 N, sensor.measured: table.position}
"""
LESSON = "lesson: L\nmachine: pushed\nduration: 0.1 s\n"


def lesson(folder: Path, more: str) -> Path:
    (folder / "pushed.yaml").write_text(MACHINE, encoding="utf-8")
    (folder / "lesson.yaml").write_text(LESSON + more, encoding="utf-8")
    return folder / "lesson.yaml"


def test_a_part_is_added_wired_set_and_recorded(tmp_path: Path, registry: Registry) -> None:
    more = """\
add: {scale: {component: LinearEncoder, set: {resolution: 1 um}}}
wires: {scale.measured: table.position}
set: {scale.resolution: 2 um}
variants: {fine: {add: {second: {component: LinearEncoder}}, wires: {second.measured: table.position}}}
"""
    path = lesson(tmp_path, more)
    record = simulate(load_lesson(path), registry, engine="plain")
    counts = record["scale.position"] / 2e-6
    assert counts.max() > 10.0
    assert counts == pytest.approx(counts.round())
    fine = simulate(load_lesson(path), registry, "fine", {"second.resolution": "5 um"}, engine="plain")
    assert {"scale.position", "second.position"} <= set(fine)
    plan = prepare(load_lesson(path), registry).plan
    assert plan.values["scale.resolution"] == 2e-6


def test_another_quantity_passes_through_a_part(tmp_path: Path, registry: Registry) -> None:
    more = "units: {sensor: {signal: m/s}}\nwires: {sensor.measured: table.velocity}\nset: {sensor.gain: 2 V/(m/s)}\n"
    record = simulate(load_lesson(lesson(tmp_path, more)), registry, engine="plain")
    assert record["sensor.voltage"][10] == pytest.approx(2.0 * record["table.velocity"][10])


def test_what_the_template_sets_in_the_old_unit_falls_back_to_the_default(tmp_path: Path, registry: Registry) -> None:
    more = "units: {sensor: {signal: m/s}}\nwires: {sensor.measured: table.velocity}\n"
    plan = prepare(load_lesson(lesson(tmp_path, more)), registry).plan
    assert plan.values["sensor.gain"] == 0.002


@pytest.mark.parametrize(
    ("more", "sentence"),
    [
        ("add: {table: {component: ForceAxis}}", "4:7: there is a part 'table' already. Use 'replace:', or another name."),
        ("units: {senso: {signal: N}}", "4:9: there is no part 'senso'. Did you mean 'sensor'?"),
        ("add: {scale: {component: LinearEncode}}", "4:26: there is no component 'LinearEncode'. Did you mean 'LinearEncoder'?"),
        ("add: {scale: {component: LinearEncoder, set: {resolution: 1 s}}}", "'1 s' is given in s, but m is wanted."),
        ("add: {scale: {component: LinearEncoder}}", "nothing feeds scale.measured"),
    ],
)
def test_what_is_refused(more: str, sentence: str, tmp_path: Path, registry: Registry) -> None:
    with pytest.raises(LatheSimError) as refused:
        prepare(load_lesson(lesson(tmp_path, f"{more}\n")), registry)
    assert sentence in str(refused.value)
