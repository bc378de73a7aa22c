"""A lesson says on which side of a spring a sensor sits; what it does not say is assumed, and told before the run."""

from pathlib import Path

import pytest

from lathesim.errors import LessonError
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.program_path import run_warnings
from lathesim.lessons.sensor_sides import assumed_sides
from lathesim.lessons.simulate import Prepared, prepare
from lathesim.plugins import Registry

MACHINE = """\
machine: A table that is pushed
sample_period: 1 ms
step: 1 ms
parts:
  table: {component: ForceAxis}
  encoder: {component: LinearEncoder}
  scale: {component: LinearEncoder, side: load}
  meter: {component: AnalogSensor, units: {signal: N}}
wires: {table.force: 1 N, encoder.measured: table.position, scale.measured: table.position, meter.measured: 0 N}
"""
SPRING = "insert: [{effect: AxialResonance, at: table, name: spring, table_share: 0.5}]\n"


def prepared(folder: Path, registry: Registry, more: str, variant: str | None = None) -> Prepared:
    (folder / "pushed.yaml").write_text(MACHINE, encoding="utf-8")
    (folder / "lesson.yaml").write_text(f"lesson: L\nmachine: pushed\nduration: 0.1 s\n{SPRING}{more}", encoding="utf-8")
    return prepare(load_lesson(folder / "lesson.yaml"), registry, variant)


def at_load(case: Prepared) -> list[str]:
    """Return the sensors that see what is behind the spring."""
    sources = {item.target: item.source for item in case.machinery.wires}
    return [name for name in ("encoder", "scale") if sources[f"{name}.measured"].startswith("spring_beyond")]


def test_a_variant_moves_a_sensor_to_the_other_side(tmp_path: Path, registry: Registry) -> None:
    more = "side: {encoder: motor}\nvariants: {as_built: {}, turned: {side: {encoder: load, scale: motor}}}"
    built, turned = (prepared(tmp_path, registry, more, name) for name in ("as_built", "turned"))
    assert (at_load(built), at_load(turned)) == (["scale"], ["encoder"])
    assert run_warnings(built.case, built.plan) == ()


def test_a_side_that_nobody_says_is_told(tmp_path: Path, registry: Registry) -> None:
    case = prepared(tmp_path, registry, "")
    assert at_load(case) == ["scale"]
    assert run_warnings(case.case, case.plan) == (
        "Assumed at the spring of table: encoder on the motor side. Confirm with 'side: {encoder: motor}' in the lesson, "
        "or write the other side.",
    )


def test_a_side_that_a_diagnosis_has_found_is_told_and_no_longer_assumed(tmp_path: Path, registry: Registry) -> None:
    assert (
        assumed_sides(prepared(tmp_path, registry, "").machinery, "table", {"encoder": "motor"})
        == "The recordings show encoder on the motor side."
    )


@pytest.mark.parametrize(
    ("more", "fact"),
    [
        ("side: {meter: load}", "meter .AnalogSensor. measures no motion, so it sits on no side of a spring"),
        ("side: {table: load}", "table .ForceAxis. measures no motion"),
        ("side: {encodr: load}", "there is no part 'encodr'"),
        ("side: {encoder: table}", "'motor' or 'load' is expected"),
    ],
)
def test_what_sits_on_no_side_is_refused_where_it_is_written(tmp_path: Path, registry: Registry, more: str, fact: str) -> None:
    with pytest.raises(LessonError, match=fact) as refused:
        prepared(tmp_path, registry, more)
    assert refused.value.place.split(":")[-2] == "5"
