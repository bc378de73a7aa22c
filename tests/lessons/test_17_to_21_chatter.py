"""Lessons 17 to 21 on chatter: waves on the part, the keyed shaft, tap and predict, the next best cut; goals as stated."""

from __future__ import annotations

from dataclasses import replace

import pytest

from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.program_path import run_warnings
from lathesim.lessons.simulate import prepare, simulate
from lathesim.plugins import load_registry
from lathesim.stability.lesson_settings import cut_of
from lathesim.stability.lobes import stability_map
from tests.lessons.lesson_runs import Runs

SWING = {
    ("17_waves_on_the_part", "stable"): (0.0, 1e-6),
    ("17_waves_on_the_part", "chatter"): (1e-4, 3e-4),
    ("17_waves_on_the_part", "good_speed"): (0.0, 1e-6),
    ("17_waves_on_the_part", "at_rest"): (0.0, 2e-6),
    ("17_waves_on_the_part", "begun"): (1e-4, 3e-4),
    ("19_the_keyed_shaft", "stable"): (0.0, 3e-5),
    ("19_the_keyed_shaft", "hopf"): (2e-4, 1e-3),
    ("19_the_keyed_shaft", "good_speed"): (0.0, 6e-5),
    ("19_the_keyed_shaft", "flip"): (1.5e-4, 1e-3),
}
"""Case -> between which amplitudes [m] it swings at the end, peak to peak."""


class CompiledRuns(Runs):
    """The cases of a lesson, compiled: they have a sample each 50 us."""

    def swing(self, variant: str) -> float:
        """Return the vibration at the end of a case [m]."""
        record = simulate(self.lesson, self.registry, variant, engine="compiled")
        values = record["mode.displacement"]
        last = values[-len(values) // 4 :]
        return float(last.max() - last.min())


@pytest.fixture(scope="module")
def lessons() -> dict[str, CompiledRuns]:
    return {name: CompiledRuns(name) for name in ("17_waves_on_the_part", "19_the_keyed_shaft")}


@pytest.mark.parametrize(("lesson", "variant"), SWING)
def test_each_case_swings_as_its_map_says(lesson: str, variant: str, lessons: dict[str, CompiledRuns]) -> None:
    low, high = SWING[lesson, variant]
    assert low <= lessons[lesson].swing(variant) <= high


def test_a_speed_that_varies_enough_keeps_the_cut_quiet(lessons: dict[str, CompiledRuns]) -> None:
    runs = lessons["17_waves_on_the_part"]
    record = simulate(runs.lesson, runs.registry, "speed_variation", {"spindle.variation": "0.2"}, engine="compiled")
    last = record["mode.displacement"][-10000:]
    assert last.max() - last.min() < 1e-6


def test_process_damping_that_no_wire_takes_to_a_mode_is_told(lessons: dict[str, CompiledRuns]) -> None:
    runs = lessons["17_waves_on_the_part"]
    prepared = prepare(runs.lesson, runs.registry, "stable", {"cut.process_damping": "1e5 N/m"})
    assert run_warnings(prepared.case, prepared.plan) == ()
    mode = prepared.plan.parts["mode"].name
    cut_off = replace(prepared.plan, feeds={name: source for name, source in prepared.plan.feeds.items() if name != f"{mode}.drag"})
    assert run_warnings(prepared.case, cut_off) == ("cut: its process damping acts on nothing. Wire the drag of a mode to cut.drag.",)


def test_the_map_of_the_waves_lesson_belongs_to_its_machine() -> None:
    cut = cut_of(load_lesson("17_waves_on_the_part"))
    (point,) = stability_map(cut, [2000.0], "frequency").points
    assert point.limit.width == pytest.approx(1.2291e-3, rel=1e-4)
    assert cut.chosen == pytest.approx((2000.0, 1e-3))


def test_the_goals_of_the_next_best_cut_can_be_met() -> None:
    lesson, registry = load_lesson("21_the_next_best_cut"), load_registry(installed=False)
    record = simulate(lesson, registry, None, {"spindle.target": "3300 rpm"}, engine="compiled")
    assert record["cut.removal_rate"][-1] > 0.0


def test_milling_runs_as_a_template() -> None:
    from lathesim.lessons.lesson import load_machine
    from lathesim.lessons.simulate import check_machine
    from lathesim.shipped import shipped_folder

    plan = check_machine(
        load_machine(shipped_folder("lesson_configs") / "machines" / "milling_process.yaml"), load_registry(installed=False)
    )
    assert "cut.force" in plan.channels
