"""Both machine templates of the two-axis lathe, run over short programs: what the parts do together."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import yaml

from lathesim.engine.run import run
from lathesim.engine.wiring import Plan, wire
from lathesim.lessons.assemble import assemble
from lathesim.lessons.lesson import load_lesson
from lathesim.plugins import Registry, load_registry
from lathesim.record import Record

EXAMPLE_2 = """N10 G90 G94 G71
N20 M03 G00 X15.0 Z10.0 S1000
N30 G01 Z15.0 F120
N40 X17.0 Z35.0
N50 G00 X20.0 Z0.0
N60 X0.0
"""
EXAMPLE_1 = Path(__file__).parents[2] / "part_programs" / "liu_landers_2004_example_1.nc"
MACHINES = Path(__file__).parents[2] / "lesson_configs" / "machines"
PLUGINS = Path(__file__).parents[2] / "plugins"


@pytest.fixture(scope="module")
def registry() -> Registry:
    return load_registry([PLUGINS])


def plan_of(folder: Path, registry: Registry, program: str, machine: str = "two_axis_lathe", more: str = "") -> Plan:
    (folder / "program.nc").write_text(program)
    lesson = folder / "lesson.yaml"
    lesson.write_text(f"lesson: A test\nmachine: {machine}\nprogram: program.nc\n{more}\n")
    return wire(assemble(load_lesson(lesson), registry))


@pytest.fixture(scope="module")
def example_1(tmp_path_factory: pytest.TempPathFactory, registry: Registry) -> Record:
    return run(plan_of(tmp_path_factory.mktemp("example_1"), registry, EXAMPLE_1.read_text()), engine="plain")


def test_example_1_case_1(example_1: Record) -> None:
    touching = example_1["cutting.in_contact"] > 0.5
    error = example_1["contour.contour_error"][touching] * 1000.0
    assert example_1.time[-1] == pytest.approx(18.480, abs=1e-9)
    assert np.abs(error).max() == pytest.approx(0.684, rel=0.03)  # Liu and Landers (2004), Table 1: 0.68494 mm
    assert np.sum(error * error) * 0.005 == pytest.approx(0.1113, rel=0.06)


def test_the_spindle_reaches_its_speed_under_load(example_1: Record) -> None:
    speed = example_1["spindle.speed"] * 60 / (2 * math.pi)
    assert speed[2000] == pytest.approx(1000.0, rel=0.01)
    assert example_1["load.torque"][2000] > 1.0


def test_both_templates_agree_but_for_the_models_of_the_drives() -> None:
    empirical, analytical = (
        yaml.safe_load((MACHINES / f"{name}.yaml").read_text()) for name in ("two_axis_lathe", "two_axis_lathe_analytical")
    )
    models = {"x_axis", "z_axis", "spindle"}
    assert empirical["wires"].items() <= analytical["wires"].items()
    for machine in (empirical, analytical):
        machine["parts"] = {name: entry for name, entry in machine["parts"].items() if name not in models}
    assert empirical["parts"] == analytical["parts"]


RESULTS = {
    "radial thrust force": ("cutting_force.radial_force", "N"),
    "longitudinal thrust force": ("cutting_force.longitudinal_force", "N"),
    "cutting force": ("cutting_force.cutting_force", "N"),
    "spindle torque": ("load.torque", "N*m"),
    "spindle power": ("load.power", "W"),
    "feed": ("cutting.feed", "m"),
    "tool wear": ("tool_wear.flank_wear", "m"),
    "surface finish": ("surface_finish.roughness", "m"),
    "spindle velocity": ("spindle.speed", "rad/s"),
    "spindle velocity error": ("spindle_controller.error", "rad/s"),
    "spindle voltage": ("spindle_dac.voltage", "V"),
    "spindle current": ("spindle.current", "A"),
    **{f"{axis} position": (f"{axis}_axis.position", "m") for axis in "xz"},
    **{f"{axis} velocity": (f"{axis}_axis.velocity", "m/s") for axis in "xz"},
    **{f"{axis} position error": (f"contour.{axis}_error", "m") for axis in "xz"},
    **{f"{axis} measured position error": (f"{axis}_controller.error", "m") for axis in "xz"},
    **{f"{axis} voltage": (f"{axis}_dac.voltage", "V") for axis in "xz"},
    **{f"{axis} current": (f"{axis}_axis.current", "A") for axis in "xz"},
    "contour error": ("contour.contour_error", "m"),
    "cross-coupling voltage": ("cross_coupling.voltage", "V"),
}
"""What the 2004 paper plots (its section Results) -> channel and unit. Currents are those of modelled motors."""


@pytest.fixture(scope="module")
def everything(tmp_path_factory: pytest.TempPathFactory, registry: Registry) -> Record:
    """The analytical lathe with a process controller, cross-coupling and an edge that wears."""
    more = """\
replace: {process_controller: NonlinearProcessController, cutting_force: SandovalForce}
set: {stock.stock_radius: 17 mm, cross_coupling.proportional: 0.25 V/mm, tool_wear.force_growth: 1000 1/m}
"""
    folder = tmp_path_factory.mktemp("everything")
    return run(plan_of(folder, registry, EXAMPLE_2, "two_axis_lathe_analytical", more), engine="plain")


@pytest.mark.parametrize("result", RESULTS)
def test_every_result_of_the_paper_is_a_channel_with_unit_and_description(result: str, everything: Record) -> None:
    name, unit = RESULTS[result]
    channel = everything.channels[name]
    assert channel.unit == unit
    assert len(channel.description) > 10
    assert np.isfinite(channel.values).all()
    assert np.abs(channel.values).max() > 0.0


def test_the_empirical_lathe_gives_them_all_but_the_currents(example_1: Record) -> None:
    assert {result for result, (name, _) in RESULTS.items() if name not in example_1} == {"spindle current", "x current", "z current"}


def test_currents_are_recorded_where_motors_are_modelled_and_friction_agrees_with_the_effect(tmp_path: Path, registry: Registry) -> None:
    short = "N10 G90 G94 G71\nN20 G00 X1.0 Z1.0\nN30 G01 X2.0 F60\nN40 X1.5\n"
    machine = "two_axis_lathe_analytical"
    built_in = run(plan_of(tmp_path, registry, short, machine, "set: {x_axis.table_coulomb: 300 N}"), engine="plain")
    assert 0.0 < np.abs(built_in["x_axis.current"]).max() <= 25.0
    assert {"z_axis.current", "spindle.current", "x_axis.drive_force"} <= set(built_in.channels)
    inserted = run(
        plan_of(tmp_path, registry, short, machine, "insert: [{effect: CoulombFriction, at: x_axis, level: 300 N}]"), engine="plain"
    )
    apart = np.abs(built_in["x_axis.position"] - inserted["x_axis.position"]).max()
    without = run(plan_of(tmp_path, registry, short, machine), engine="plain")
    assert apart < 0.2 * np.abs(built_in["x_axis.position"] - without["x_axis.position"]).max()
