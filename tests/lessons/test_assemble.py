"""A lesson over its machine template: what each key changes, and which of two entries counts."""

from pathlib import Path

import pytest

from lathesim.engine.assembly import Part, Wire
from lathesim.engine.wiring import wire
from lathesim.errors import LatheSimError
from lathesim.lessons.assemble import assemble
from lathesim.lessons.insertion import Machinery
from lathesim.lessons.lesson import load_lesson
from tests.lessons.small_machine import MACHINE, HeavyTable, small_registry, write_lesson


def assembled(folder: Path, body: str = "", variant: str | None = None, **overrides: str | float) -> Machinery:
    lesson = load_lesson(write_lesson(folder, body))
    return assemble(lesson, small_registry(), variant, {name.replace("__", "."): value for name, value in overrides.items()})


def part(machinery: Machinery, name: str) -> Part:
    return next(part for part in machinery.parts if part.name == name)


def feeds(machinery: Machinery) -> dict[str, str]:
    return {item.target: item.source for item in machinery.wires}


def test_template_values_arrive_in_si(tmp_path: Path) -> None:
    machinery = assembled(tmp_path)
    assert (machinery.sample_period, machinery.step) == (0.005, 0.001)
    assert part(machinery, "push").parameters == {"gain": 200.0}
    assert part(machinery, "table").parameters == {"mass": 20.0}
    assert part(machinery, "table").start == {"travel": 0.001}
    assert wire(machinery).channels == ("push.force", "table.position", "table.velocity", "ruler.reading")


def test_a_step_and_a_period_of_six_digits_divide_each_other(tmp_path: Path) -> None:
    machinery = assembled(tmp_path, "sample_period: 0.666667 ms\nstep: 0.166667 ms\n")
    assert (machinery.sample_period, machinery.step) == (0.666667e-3, 0.666667e-3 / 4)
    assert machinery.steps_per_sample == 4


def test_lesson_then_variant_then_command_line(tmp_path: Path) -> None:
    body = "set: {table.mass: 30 kg, push.gain: 1 N/mm, table.travel: 2 mm}\nvariants: {I: {set: {table.mass: 40 kg}}, II: {}}"
    assert part(assembled(tmp_path, body), "table").parameters == {"mass": 30.0}
    assert part(assembled(tmp_path, body), "table").start == {"travel": 0.002}
    assert part(assembled(tmp_path, body, "I"), "table").parameters == {"mass": 40.0}
    assert part(assembled(tmp_path, body, "I"), "push").parameters == {"gain": 1000.0}
    assert part(assembled(tmp_path, body, "II"), "table").parameters == {"mass": 30.0}
    assert part(assembled(tmp_path, body, "I", table__mass="50 kg"), "table").parameters == {"mass": 50.0}
    assert part(assembled(tmp_path, body, "I", table__mass=60.0), "table").parameters == {"mass": 60.0}


def test_an_override_names_its_place(tmp_path: Path) -> None:
    with pytest.raises(LatheSimError) as refused:
        assembled(tmp_path, table__mass="50")
    assert str(refused.value) == "--set table.mass=50: '50' has no unit. Write it with one, for example '50 kg'."


def test_an_unknown_variant_is_refused(tmp_path: Path) -> None:
    with pytest.raises(LatheSimError, match=r"the lesson has no variant 'III'\. It has I, II\.$"):
        assembled(tmp_path, "variants: {I: {}, II: {}}", "III")
    with pytest.raises(LatheSimError, match=r"the lesson has no variants, so there is no 'I'\. Leave --variant out\.$"):
        assembled(tmp_path, "", "I")


def test_replace_keeps_what_the_new_part_also_has(tmp_path: Path) -> None:
    machinery = assembled(tmp_path, "replace: {table: HeavyTable}\nset: {table.mass: 200 kg}")
    assert part(machinery, "table").component is HeavyTable
    assert part(machinery, "table").parameters == {"mass": 200.0}
    assert part(machinery, "table").start == {"travel": 0.001}
    with pytest.raises(LatheSimError, match=r"machines/small\.yaml:6:\d+: table\.mass is 20 kg, outside 100 to 1000 kg"):
        assembled(tmp_path, "replace: {table: HeavyTable}")


def test_wires_and_rates_can_change(tmp_path: Path) -> None:
    machinery = assembled(tmp_path, "wires: {push.measured: table.position, table.disturbance: 3 kN}\nevery: {push: 4}")
    assert feeds(machinery)["push.measured"] == "table.position"
    assert Wire("table.disturbance", constant=3000.0) in machinery.wires
    assert part(machinery, "push").every == 4


def test_the_lesson_chooses_the_channels(tmp_path: Path) -> None:
    assert assembled(tmp_path).record is None
    assert assembled(tmp_path, "record: [table.position]").record == ("table.position",)


def test_a_fault_of_the_template_names_the_template(tmp_path: Path) -> None:
    path = write_lesson(tmp_path, machine=MACHINE.replace("gain: 200", "gian: 200"))
    with pytest.raises(LatheSimError) as refused:
        assemble(load_lesson(path), small_registry())
    assert str(refused.value) == f"{tmp_path}/machines/small.yaml:5:33: push has no parameter 'gian'. Did you mean 'gain'?"


def test_quantities_may_be_pure_numbers_only_where_the_unit_is_one(tmp_path: Path) -> None:
    machinery = assembled(tmp_path, "set: {push.gain: 1e3 N/m, push.target: 2e-2 m}")
    assert part(machinery, "push").parameters == {"gain": 1000.0, "target": 0.02}
