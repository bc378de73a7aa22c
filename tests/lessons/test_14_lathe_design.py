"""Lesson 14: the price list against Example 3 of Liu and Landers (2004), its goals, the design of the notes, and golden channels."""

import importlib.util
import sys
from types import ModuleType

import pytest

from lathesim.analysis.turning_metrics import weighed
from lathesim.components.economy import BASE_COST, axis_cost, encoder_cost, spindle_cost, tachometer_cost
from lathesim.lessons.simulate import prepare, run_prepared
from lathesim.shipped import shipped_folder
from tests.lessons.lesson_runs import Runs

PUBLISHED = {
    "I": (109350.0, 24.0, "6.987"),
    "II": (105437.0, 6.85, "3.479"),
    "III": (46191.0, 10.79, "3.082"),
    "IV": (72747.0, 7.64, "2.983"),
}
"""Group -> cost [dollar], cycle time [s] and index as printed in Table 3."""
RPM = 2.0 * 3.141592653589793 / 60.0

GOALS = {
    "": "---++++++++++",
}
"""Case -> whether each goal is met (+) or missed (-), in the order of the lesson."""

AT = (2.0, 6.0, 10.0, 12.0, 14.0, 16.0, 18.0)
GOLDEN = {
    "x_axis.position": (8e-06, (0.0150008, 0.0150008, 0.0150008, 0.0160806, 0.0170001, 0.0169993, 0.0195729)),
    "z_axis.position": (8e-06, (0.0132691, 0.0213371, 0.0293371, 0.0347304, 0.040639, 0.0466346, 0.0482341)),
    "design.machine_cost": (1.0, (130926.5, 130926.5, 130926.5, 130926.5, 130926.5, 130926.5, 130926.5)),
    "design.x_price": (1.0, (40981.0, 40981.0, 40981.0, 40981.0, 40981.0, 40981.0, 40981.0)),
    "design.spindle_price": (1.0, (23964.5, 23964.5, 23964.5, 23964.5, 23964.5, 23964.5, 23964.5)),
    "z_dac.voltage": (0.0785, (0.118, 0.118, 0.118, 0.118, 0.118, 0.118, -2.549)),
    "cutting_force.longitudinal_force": (30.0, (0.0, 395.0, 398.0, 450.0, 249.0, 234.0, 0.0)),
    "spindle.speed": (3.0, (103.9, 105.7, 102.4, 104.9, 104.1, 106.8, 106.1)),
}
"""Golden channels of the lesson as it stands: tolerance and values at the times of ``AT`` [SI]."""


@pytest.fixture(scope="module")
def runs() -> Runs:
    return Runs("14_lathe_design")


def test_the_goals_and_the_golden_channels_are_as_stated(runs: Runs) -> None:
    runs.check_goals(GOALS)
    runs.check_golden(GOLDEN, AT, "")


@pytest.mark.parametrize("group", PUBLISHED)
def test_the_published_rows_give_the_published_index_to_the_printed_digit(group: str) -> None:
    cost, time, index = PUBLISHED[group]
    assert f"{weighed(cost, time):.3f}" == index


def test_the_worked_check() -> None:
    spindle = spindle_cost(2000.0 * RPM, 20.0 * 2.0 * 3.141592653589793, 24.0, 0.5)
    axis = axis_cost(0.2, 2.0, 12.0, 1e-6)
    assert (spindle, axis) == (pytest.approx(5700.0), pytest.approx(12600.0))
    cost = BASE_COST + spindle + 2.0 * axis
    assert cost == pytest.approx(55900.0)
    assert f"{weighed(cost, 10.0):.3f}" == "3.118"


def test_the_price_list() -> None:
    prices = {20e-6: 500.0, 10e-6: 500.0, 5.5e-6: 750.0, 1e-6: 1000.0, 0.5e-6: 1500.0, 0.1e-6: 1900.0}
    assert {resolution: encoder_cost(resolution) for resolution in prices} == pytest.approx(prices)
    assert [tachometer_cost(noise) for noise in (0.0, 0.5, 1.0, 2.0)] == pytest.approx([1000.0, 500.0, 0.0, 0.0])


def test_an_encoder_finer_than_a_tenth_of_a_micrometre_is_refused(runs: Runs) -> None:
    from lathesim.errors import LessonError

    with pytest.raises(LessonError, match=r"design.x_resolution is 5e-08 m, outside 1e-07 to inf m"):
        prepare(runs.lesson, runs.registry, overrides={"design.x_resolution": "50 nm"})


def test_what_is_paid_for_is_what_is_simulated(runs: Runs) -> None:
    plan = prepare(runs.lesson, runs.registry).plan
    fed = {name: source for name, (_, source) in plan.feeds.items() if source.startswith("design.")}
    assert fed == {target: source for target, source in runs.lesson.settings.wires.items() if source.startswith("design.")}
    assert len(fed) == 13


def test_the_table_of_limits_says_which_is_broken_and_by_how_much(runs: Runs) -> None:
    from lathesim.cli.lessons.run_tables import goals_text

    table = goals_text(runs.goals())
    assert "max contour error      at most 0.5 mm   0.68508 mm  missed by 0.185 mm (37 %)" in table
    assert "max surface roughness  at most 1 um     1.2656 um   missed by 0.266 um (27 %)" in table
    assert "max z force            at most 2400 N   836.85 N    met" in table


@pytest.fixture(scope="module")
def search() -> ModuleType:
    path = shipped_folder("lesson_configs") / "14_lathe_design_search.py"
    specification = importlib.util.spec_from_file_location("lathe_design_search", path)
    assert specification is not None and specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    sys.modules[specification.name] = module
    specification.loader.exec_module(module)
    return module


@pytest.mark.parametrize("seed", [7, 8, 9])
def test_the_design_of_the_notes_beats_the_best_published_one_within_all_limits(seed: int, search: ModuleType, runs: Runs) -> None:
    from lathesim.analysis.metric import measure
    from lathesim.lessons.grading import judge
    from lathesim.lessons.lesson import find_program

    program = find_program(search.PROGRAM, shipped_folder("part_programs"))
    record = run_prepared(prepare(runs.lesson, runs.registry, overrides=search.NOTED, program=program), engine="plain", seed=seed)
    found = measure(record, runs.registry.metrics)
    assert all(goal.met for goal in judge(runs.lesson.settings.goals, found.values))
    assert found.values["performance_index"].value == pytest.approx(2.341, abs=0.005)
    assert found.values["machine_cost"].value == pytest.approx(56364.0, abs=1.0)


@pytest.mark.slow
def test_the_search_finds_a_design_that_beats_the_best_published_one(search: ModuleType) -> None:
    project = search.Project()
    found = project.measured(search.search(project, rounds=12))
    assert found["performance_index"].value < 2.983
    assert found["max_contour_error"].value <= 0.5e-3
    assert found["max_surface_roughness"].value <= 1e-6
