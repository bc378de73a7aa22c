"""A cut is replayed where the machine was: a replayed axis drifts, and what it would cut there is another cut."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lathesim.diagnosis.location.missing_force import passed_through
from lathesim.engine.assembly import Assembly
from lathesim.engine.wiring import wire
from lathesim.identification.catalogue.placement import insert_candidates
from lathesim.identification.replay.measured_motion import counted_motion
from lathesim.identification.replay.open_loop import follow
from lathesim.lessons.lesson import load_machine
from lathesim.lessons.simulate import check_machine
from lathesim.plugins import Registry, load_registry
from tests.diagnosis.pushed_table import PERIOD, POSITION, machine

MACHINES = Path(__file__).parents[2] / "lesson_configs" / "machines"
AXES = ("cascade_axis", "force_axis", "voltage_axis", "torque_spindle")
SPEED = 2e-3


@pytest.fixture(scope="module")
def registry() -> Registry:
    return load_registry(installed=False)


def assembly_of(name: str, registry: Registry) -> Assembly:
    return check_machine(load_machine(MACHINES / f"{name}.yaml"), registry).assembly


def followed(assembly: Assembly, outputs: tuple[str, ...]) -> dict[str, str]:
    """Return what takes the recorded motion instead of the simulated one: input -> output."""
    before = {item.target: item.source for item in assembly.wires}
    after = follow(assembly, {output: np.zeros(10) for output in outputs})
    return {item.target: before[item.target] for item in after.wires if item.source.startswith("followed_")}


def test_stock_and_cut_of_a_lathe_take_the_recorded_motion(registry: Registry) -> None:
    filled, _ = insert_candidates(assembly_of("two_axis_lathe", registry), registry.effects.values())  # type: ignore[arg-type]
    found = followed(filled, ("x_axis.position", "z_axis.position", "x_axis.velocity", "z_axis.velocity"))
    assert {"stock.x_position", "stock.z_position"} <= set(found)
    assert {target.partition(".")[0] for target in found} <= {"stock", "cutting", "load", "surface_finish"}


@pytest.mark.parametrize("name", AXES)
def test_no_sensor_drive_or_effect_of_an_axis_does(name: str, registry: Registry) -> None:
    """A scale that was shown the recorded motion of its table had no error any more."""
    filled, candidates = insert_candidates(assembly_of(name, registry), registry.effects.values())  # type: ignore[arg-type]
    assert candidates
    moving = [part for part in filled.parts if {"displacement", "flow"} <= set(part.component.ports)]
    outputs = tuple(f"{part.name}.{part.component.ports[role]}" for part in moving for role in ("displacement", "flow"))
    assert followed(filled, outputs) == {}


def test_a_feed_is_as_steady_as_its_counts_allow() -> None:
    """One count of 1 um a sample of 2 ms is 0.5 mm/s: a quarter of the feed, and next to nothing of it once smoothed."""
    time = np.arange(5000) * PERIOD
    noise = 0.3e-6 * np.random.default_rng(1).standard_normal(len(time))
    feed = counted_motion(machine().assembly, {POSITION: SPEED * time + noise})["x_axis.velocity"][500:-500]
    assert np.std(feed) < 0.005 * SPEED
    assert np.mean(feed) == pytest.approx(SPEED, rel=1e-3)


def test_a_quick_motion_is_smoothed_no_more_than_it_has_to_be() -> None:
    time = np.arange(5000) * PERIOD
    place = 0.01 * np.sin(2.0 * math.pi * 3.0 * time) + 1e-8 * np.random.default_rng(1).standard_normal(len(time))
    feed = counted_motion(machine().assembly, {POSITION: place})["x_axis.velocity"]
    speed = 0.01 * 2.0 * math.pi * 3.0 * np.cos(2.0 * math.pi * 3.0 * time)
    assert np.max(np.abs(feed - speed)[200:-200]) < 0.01 * np.max(np.abs(speed))


def test_no_recorded_signal_is_a_suspect(registry: Registry) -> None:
    """The chain of a force named the recorded way of the slide among the parts that make it."""
    lathe = assembly_of("two_axis_lathe", registry)
    after = follow(lathe, {"x_axis.position": np.zeros(10), "z_axis.velocity": np.zeros(10)})
    parts = passed_through(wire(replace(after, finish="")), "cutting_force.cutting_force")
    assert "cutting" in parts
    assert not any(name.startswith("followed_") for name in parts)
    assert any(part.name.startswith("followed_") for part in after.parts)
