"""The nine user-written parts that ship as examples: each keeps the contract and takes its place in the lathe."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lathesim.conformance import check_component
from lathesim.engine.run import run
from lathesim.engine.wiring import wire
from lathesim.errors import PluginError
from lathesim.lessons.assemble import assemble
from lathesim.lessons.lesson import load_lesson
from lathesim.plugins import Registry, load_registry
from lathesim.record import Record

PLUGINS = Path(__file__).parents[2] / "plugins"
PLACES = {
    "BeltSpindle": "spindle",
    "FeedforwardSpindleController": "spindle_controller",
    "SlantBedAxis": "x_axis",
    "SecondOrderAxis": "z_axis",
    "VelocityFeedforwardController": "x_controller",
    "LeadController": "z_controller",
    "SandovalForce": "cutting_force",
    "FixedGainProcessController": "process_controller",
    "ExtendedTaylorWear": "tool_wear",
}
WEAR_WIRES = "wires: {tool_wear.feed: cutting.feed, tool_wear.depth_of_cut: cutting.depth_of_cut}"
PROGRAM = """N10 G90 G94 G71
N20 M03 G00 X16.0 Z14.5 S1000
N30 G01 Z19.0 F240
"""


@pytest.fixture(scope="module")
def registry() -> Registry:
    return load_registry([PLUGINS])


def lathe_with(registry: Registry, folder: Path, replace: str = "", more: str = "") -> Record:
    """Run a cut of 4 mm length on the lathe with a part replaced."""
    (folder / "cut.nc").write_text(PROGRAM)
    lesson = folder / "lesson.yaml"
    lesson.write_text(f"lesson: A short cut\nmachine: two_axis_lathe\nprogram: cut.nc\n{replace}\n{more}\n")
    return run(wire(assemble(load_lesson(lesson), registry)), engine="plain")


def test_there_is_an_example_of_each_kind(registry: Registry) -> None:
    assert not registry.problems
    assert set(PLACES) <= set(registry.components)


@pytest.mark.parametrize("name", PLACES)
def test_an_example_keeps_the_contract(registry: Registry, name: str) -> None:
    assert check_component(registry.components[name]) == []


@pytest.mark.parametrize(("name", "place"), PLACES.items())
def test_an_example_takes_its_place(registry: Registry, tmp_path: Path, name: str, place: str) -> None:
    record = lathe_with(registry, tmp_path, f"replace: {{{place}: {name}}}", WEAR_WIRES if place == "tool_wear" else "")
    assert record.meta["status"] == "complete"
    assert record["cutting.engaged"].max() == 1.0
    assert record["cutting_force.cutting_force"].max() > 100.0
    assert record["tool_wear.flank_wear"][-1] > 0.0
    assert np.abs(record["contour.contour_error"][-20:]).max() < 1e-3


def test_a_slide_on_a_slanted_bed_hangs_lower(registry: Registry, tmp_path: Path) -> None:
    level = lathe_with(registry, tmp_path)["x_axis.position"][-1]
    replace = "replace: {x_axis: SlantBedAxis}"
    hanging = lathe_with(registry, tmp_path, replace, "set: {x_axis.disturbance_gain: 3 um/(s*N)}")["x_axis.position"][-1]
    sag = 3e-6 * 80.0 * 9.80665 * np.sin(np.pi / 4) / (0.01878 * 224.5)
    assert level - hanging == pytest.approx(sag, rel=0.5)  # the converter's levels blur it


def test_feedforward_takes_the_lag_away(registry: Registry, tmp_path: Path) -> None:
    plain = lathe_with(registry, tmp_path, "replace: {z_controller: PositionController}")
    ahead = lathe_with(registry, tmp_path, "replace: {z_controller: VelocityFeedforwardController}")
    errors = [np.abs(record["z_controller.error"][180:250]).mean() for record in (plain, ahead)]
    assert errors[1] < 0.2 * errors[0]


def test_the_force_of_example_2(registry: Registry) -> None:
    force, longitudinal, radial = registry.components["SandovalForce"].laws["output"](0.002, 0.12e-3, 94.0 / 60, 1.0, 1.0)
    assert force == pytest.approx(2864.63 * 2**0.69 * 0.12**0.75 - 4.28 * 94)
    assert longitudinal == pytest.approx(1907.00 * 2**0.74 * 0.12**0.79 - 3.08 * 94)
    assert radial == pytest.approx(1464.28 * 2**0.08 * 0.12**1.09 + 0.02 * 94)
    assert registry.components["SandovalForce"].laws["output"](0.0003, 0.12e-3, 94.0 / 60, 1.0, 1.0)[0] == 0.0


@pytest.mark.parametrize("name", PLACES)
def test_a_shipped_example_is_found_by_name_from_any_folder(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    registry = load_registry(installed=False)
    assert name not in registry.components
    assert registry.component(name).__name__ == name
    assert registry.problems == []
    with pytest.raises(PluginError, match="there is no component 'SandovalForc'"):
        registry.component("SandovalForc")


def test_an_own_part_of_the_name_comes_before_the_shipped_example(tmp_path: Path) -> None:
    text = (PLUGINS / "sandoval_force.py").read_text(encoding="utf-8").replace("2864.63", "1000.0")
    (tmp_path / "mine.py").write_text(text, encoding="utf-8")
    registry = load_registry([tmp_path], installed=False)
    force = registry.component("SandovalForce").laws["output"](0.001, 1e-3, 0.0, 1.0, 1.0)[0]
    assert force == pytest.approx(1000.0)
