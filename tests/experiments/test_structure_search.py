"""A machine that holds all changes does what the machine without them does, until one is chosen."""

from pathlib import Path

import numpy as np
import pytest

from lathesim.experiments.free_values import free_values, values_of
from lathesim.experiments.objective import Objective
from lathesim.experiments.replica import Replica, Setting
from lathesim.experiments.structure_search import StructureSearch, changed, possible_changes
from lathesim.experiments.waypoints import Waypoints
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare
from lathesim.plugins import load_registry

LESSON = "27_a_controller_that_tells_nothing"


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_changes_that_are_not_chosen_are_neutral() -> None:
    registry, lesson = load_registry(installed=False), load_lesson(LESSON)
    prepared = prepare(lesson, registry, "three_speeds")
    free = free_values(lesson, prepared.plan, (), 4.0)
    changes = [change for change in possible_changes(prepared, registry) if change.replace]
    holding = prepare(changed(lesson, changes), registry, "three_speeds")
    brought = [value.name for change in changes for value in change.brings]
    held = list(dict.fromkeys(name for change in changes for name in change.held))
    time = np.linspace(0.0, 4.5, 46)
    channels = ("x_axis.position", "y_axis.position")
    plain = Replica([Setting(prepared.machinery, channels, time)], [item.name for item in free])
    whole = Replica([Setting(holding.machinery, channels, time)], [*(item.name for item in free), *brought, *held])
    still = {name: np.zeros(len(time)) for name in channels}
    recorded = (Waypoints("three speeds", Path("three_speeds.csv"), prepared, time, still, {}, ()),)
    search = StructureSearch(whole, free, changes, Objective(plain, free, recorded, 0.0, 1e-6), print)

    point = np.zeros(len(free))
    expected = plain.readings(values_of(free, point[None, :]))[0]
    assert held == ["interpolator.cycle"]
    assert np.abs(search.objective(()).replica.readings(values_of(free, point[None, :]))[0] - expected).max() < 20e-6
    cycle = next(change for change in changes if change.held.get("interpolator.cycle") == 8e-3)
    place = whole.names.index("interpolator.cycle")
    assert [search.objective(chosen).replica.held[place] for chosen in ((), (cycle,))] == [0.0, 8e-3]
