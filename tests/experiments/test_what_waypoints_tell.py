"""What way-points of the published programs tell of the 26 parameters of a closed controller, against computed numbers."""

import numpy as np
import pytest

from lathesim.experiments.free_values import Telling, free_values, telling, values_of
from lathesim.experiments.replica import Replica, Setting
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare
from lathesim.plugins import Registry

LESSON = "27_a_controller_that_tells_nothing"
NOISE = 10e-6


def told_by(registry: Registry, variant: str, seconds: float) -> Telling:
    """Return what even way-points at 10 Hz with 10 um of noise tell."""
    lesson = load_lesson(LESSON)
    prepared = prepare(lesson, registry, variant)
    free = free_values(lesson, prepared.plan, (), 2.0)
    times = np.arange(0.0, seconds + 1e-9, 0.1)
    replica = Replica([Setting(prepared.machinery, ("x_axis.position", "y_axis.position"), times)], [item.name for item in free])

    def read(points: np.ndarray) -> np.ndarray:
        return replica.readings(values_of(free, points))[0].reshape(len(points), -1) / NOISE

    steps = 1e-3 * np.eye(len(free))
    moved, here = read(np.vstack([steps, -steps])), read(np.zeros((1, len(free))))
    slopes = (moved[: len(free)] - moved[len(free) :]).T / 2e-3
    return telling([item.name for item in free], slopes, lambda points: np.abs(read(points) - here).max(axis=1))


@pytest.mark.parametrize(("variant", "seconds", "information"), [("staircase", 25.0, 28.6), ("three_speeds", 28.0, 41.5)])
def test_published_programs_tell_two_combinations(registry: Registry, variant: str, seconds: float, information: float) -> None:
    found = told_by(registry, variant, seconds)
    assert found.known == 2
    assert found.information == pytest.approx(information, rel=0.02)
    before = [item.sentence.split(" with each of ")[0] for item in found.hidden]
    gains = ("x_controller.loop_gain", "x_speed_controller.gain", "x_power_controller.gain")
    assert sorted(before) == sorted(f"Only the products of {gain}" for gain in gains)
