"""Process controllers on the process they are designed for, in the air, and at their limits; the sensor before them."""

from __future__ import annotations

import math

import pytest

from lathesim.component import Component
from lathesim.components.process_control import (
    AdaptiveProcessController,
    LinearizationProcessController,
    LogTransformProcessController,
    NonlinearProcessController,
    ProgrammedFeed,
    process_gain,
)
from lathesim.components.sensors import AnalogSensor
from tests.components.paths import SAMPLE_PERIOD, Walk

THETA = process_gain(7705.0, 0.877, -0.273, 0.002, math.pi / 2)
MODEL_BASED = [NonlinearProcessController, LinearizationProcessController, LogTransformProcessController]
ALL = [*MODEL_BASED, AdaptiveProcessController]


def cut(
    component: type[Component], seconds: float, gain: float = THETA, exponent: float = 0.891, start: float = 0.05e-3, **values: float
) -> list[float]:
    """Return the force sample by sample while the controller moves the feed of a process F = gain f^exponent."""
    bench = Walk(component, programmed_feed=start, cutting_block=1.0, measured=0.0, **values)
    feed, forces = start, []
    for _ in range(round(seconds / SAMPLE_PERIOD)):
        forces.append(gain * math.pow(feed * 1000.0, exponent))
        feed = bench.sample(measured=forces[-1])["feed_command"]
    return forces


def test_gain_of_the_process_in_example_2() -> None:
    assert pytest.approx(2.70e4, rel=2e-3) == THETA  # K d^beta V^gamma at 2 mm and r = 15 mm


def test_the_nonlinear_loop_has_the_time_constant_asked_for() -> None:
    forces = cut(NonlinearProcessController, 2.0, start=0.005e-3)
    after = forces[round(0.4 / SAMPLE_PERIOD) + 1]
    assert (500.0 - after) / (500.0 - forces[0]) == pytest.approx(math.exp(-1.0), rel=0.02)


@pytest.mark.parametrize("component", ALL)
@pytest.mark.parametrize("gain", [THETA, 0.5 * THETA, 2.0 * THETA])
def test_every_controller_reaches_the_reference(component: type[Component], gain: float) -> None:
    assert cut(component, 10.0, gain=gain)[-1] == pytest.approx(500.0, rel=0.02)


def test_the_log_transform_is_as_fast_for_every_gain() -> None:
    fractions = []
    for gain in (0.3 * THETA, THETA, 2.0 * THETA):
        forces = cut(LogTransformProcessController, 2.0, gain=gain, start=0.02e-3)
        fractions.append(math.log(forces[100] / 500.0) / math.log(forces[0] / 500.0))
    assert fractions == pytest.approx([fractions[0]] * 3, rel=1e-9)


@pytest.mark.parametrize("component", ALL)
def test_feed_stays_within_its_limits(component: type[Component]) -> None:
    bench = Walk(component, programmed_feed=0.12e-3, cutting_block=1.0, measured=60.0)
    feeds = [bench.sample()["feed_command"] for _ in range(4000)]
    assert feeds[0] == 0.12e-3
    assert max(feeds) == 5e-4
    feeds = [bench.sample(measured=5e4)["feed_command"] for _ in range(4000)]
    assert min(feeds) >= 1e-7
    assert feeds[-1] < 1e-5


@pytest.mark.parametrize("component", [*ALL, ProgrammedFeed])
def test_nothing_is_commanded_outside_feed_blocks(component: type[Component]) -> None:
    bench = Walk(component, programmed_feed=0.12e-3, cutting_block=0.0, measured=100.0)
    assert bench.sample()["feed_command"] < 0.0
    if component is not ProgrammedFeed:
        assert bench.sample(cutting_block=1.0)["feed_command"] == 0.12e-3
        bench.sample()
        bench.sample(cutting_block=0.0)
        assert bench.sample(cutting_block=1.0, programmed_feed=0.2e-3)["feed_command"] == 0.2e-3  # begins anew


def test_log_transform_breaks_without_a_force_unless_it_has_a_floor() -> None:
    values = {"programmed_feed": 0.12e-3, "cutting_block": 1.0, "measured": 0.0}
    bench = Walk(LogTransformProcessController, **values)
    bench.sample()
    assert math.isnan(bench.sample()["feed_command"])
    floored = Walk(LogTransformProcessController, smallest_measured=20.0, **values)
    floored.sample()
    assert floored.sample()["feed_command"] > 0.12e-3


def test_adaptive_controller_rests_in_the_air() -> None:
    bench = Walk(AdaptiveProcessController, programmed_feed=0.12e-3, cutting_block=1.0, measured=0.0)
    for _ in range(500):
        sample = bench.sample()
    assert (sample["feed_command"], sample["estimate"], sample["covariance"]) == (0.12e-3, 1000.0, 10.0)


def test_least_squares_find_the_gain_of_the_process() -> None:
    bench = Walk(AdaptiveProcessController, programmed_feed=0.12e-3, cutting_block=1.0, measured=0.0, smallest_covariance=0.0)
    feed = bench.sample()["feed_command"]
    for _ in range(600):
        sample = bench.sample(measured=4200.0 * feed * 1000.0)
        feed = sample["feed_command"]
    assert sample["estimate"] == pytest.approx(4200.0, rel=0.06)
    assert sample["covariance"] < 10.0  # forgets nothing, so it learns less and less


def test_covariance_is_reset_and_the_estimate_has_a_floor() -> None:
    bench = Walk(AdaptiveProcessController, programmed_feed=0.4e-3, cutting_block=1.0, measured=60.0, reset_covariance=50.0)
    covariances = [bench.sample() for _ in range(50)]
    assert all(10.0 <= sample["covariance"] <= 50.0 for sample in covariances)
    assert covariances[-1]["estimate"] == 1000.0


def test_sensor_gives_volts_with_its_noises() -> None:
    bench = Walk(AnalogSensor, gain=0.002, bias=0.1, noise=0.05, chance=2.0)
    assert bench.sample(measured=500.0)["voltage"] == pytest.approx(1.0 + 0.1 + 0.1)
