"""With neutral parameters an effect is not there, bit for bit; with others it is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lathesim.component import Parameter
from lathesim.components.axes import ForceAxis
from lathesim.conformance import check_component
from lathesim.effects.friction import CoulombFriction
from lathesim.effects.register import stock_effects
from lathesim.engine.assembly import Assembly, Part, Wire
from lathesim.engine.fuse import fuse
from lathesim.engine.wiring import wire
from lathesim.lessons.assemble import assemble
from lathesim.lessons.insertion import insert_effect
from lathesim.lessons.lesson import load_lesson
from lathesim.record import Record
from tests.effects.rigs import PLACES, machinery, record, registry, with_effect

EFFECTS = stock_effects()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("rigs")


@pytest.fixture(scope="module")
def baselines(folder: Path) -> dict[str, Record]:
    return {name: record(machinery(name, folder)) for name in ("axis", "led", "spindle", "cutting")}


def differing(first: Record, second: Record) -> list[str]:
    """Return the channels of the first that have other bits in the second."""
    return [name for name in first.channels if first[name].tobytes() != second[name].tobytes()]


def test_each_effect_is_tried_somewhere() -> None:
    assert set(PLACES) == set(EFFECTS)


@pytest.mark.parametrize("name", EFFECTS)
def test_neutral_is_bit_for_bit_the_baseline(name: str, folder: Path, baselines: dict[str, Record]) -> None:
    rig, at, sources, setting = PLACES[name]
    # what is not of the strength of the effect keeps the value with which it is felt
    others = {key: value for key, value in setting.items() if key not in EFFECTS[name].neutral}
    placed = with_effect(machinery(rig, folder), name, at, **sources, **others, **EFFECTS[name].neutral)
    assert differing(baselines[rig], record(placed)) == []


def test_defaults_are_neutral() -> None:
    for name, effect in EFFECTS.items():
        assert {key: effect.declarations[key].default for key in effect.neutral} == effect.neutral, name  # type: ignore[attr-defined]


@pytest.mark.parametrize("name", EFFECTS)
def test_is_felt(name: str, folder: Path) -> None:
    rig, at, sources, setting = PLACES[name]
    felt = record(with_effect(machinery(rig, folder), name, at, **sources, **setting))
    neutral = record(with_effect(machinery(rig, folder), name, at, **sources, **EFFECTS[name].neutral))
    assert all(np.isfinite(channel.values).all() for channel in felt.channels.values())
    outgoing = next(channel for channel in felt.channels if channel.endswith(".outgoing"))
    assert not np.allclose(felt[outgoing], neutral[outgoing], rtol=1e-6, atol=0.0)


@pytest.mark.parametrize("rig", ["axis", "spindle", "cutting"])
def test_all_neutral_effects_of_a_rig_together_are_the_baseline(rig: str, folder: Path) -> None:
    placed = machinery(rig, folder)
    plain = record(placed, 0.05)
    for name, (where, at, sources, _) in PLACES.items():
        if where == rig:
            placed = with_effect(placed, name, at, **sources, **EFFECTS[name].neutral)
    assert differing(plain, record(placed, 0.05)) == []


def test_every_effect_keeps_the_contract() -> None:
    assert {name: faults for name, effect in EFFECTS.items() if (faults := check_component(effect))} == {}


def test_the_engine_leaves_an_idle_effect_out() -> None:
    """Its law stands in a branch that a neutral value does not take."""
    parts = (Part("x_axis", ForceAxis),)
    assembly = Assembly(parts, (Wire("x_axis.force", constant=1.0),), 1e-3, 1e-3)
    source = fuse(wire(insert_effect(assembly, CoulombFriction, "x_axis", name="rub"))).source
    assert "rub__idle = rub__level == 0.0" in source
    assert "if rub__idle:" in source


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
