"""What a channel cannot resolve: rounding and white noise, and nothing of the motion."""

import math

import numpy as np
import pytest

from lathesim.identification.signal import channel_floor, smallest_step

TIME = np.arange(4000) * 1e-3
MOTION = 0.05 * np.sin(2.0 * math.pi * 0.7 * TIME)


@pytest.mark.parametrize("step", [1e-3, 1e-6, 0.25])
def test_rounding_has_a_floor_of_the_step_over_the_root_of_twelve(step: float) -> None:
    ramp = np.round(np.linspace(0.0, 200.0, 4000)) * step
    assert channel_floor(ramp) == pytest.approx(step / math.sqrt(12.0))
    assert channel_floor(ramp, step) == pytest.approx(step / math.sqrt(12.0))


def test_counts_are_seen_in_a_motion_that_hardly_ever_stands_on_one() -> None:
    """Constant speeds are whole counts a sample: the differences of a position are then nothing, and all of it lies on a grid."""
    steps = np.repeat([5, 8, -13, 21, 3], 800)
    place = np.cumsum(steps) * 0.2e-6
    assert channel_floor(place) == pytest.approx(0.2e-6 / math.sqrt(12.0), rel=1e-6)


def test_a_declared_resolution_counts_where_the_levels_do_not_show_it() -> None:
    assert channel_floor(MOTION, 1e-6) == pytest.approx(1e-6 / math.sqrt(12.0))


def test_white_noise_on_a_motion_is_measured() -> None:
    noise = 3e-6 * np.random.default_rng(0).standard_normal(len(TIME))
    assert channel_floor(MOTION + noise) == pytest.approx(3e-6, rel=0.05)


def test_a_smooth_motion_has_next_to_no_floor() -> None:
    assert channel_floor(MOTION) < 1e-6 * np.max(MOTION)


def test_a_slow_drift_is_no_floor() -> None:
    drift = np.cumsum(np.random.default_rng(1).standard_normal(len(TIME))) * 1e-7
    noise = 3e-6 * np.random.default_rng(0).standard_normal(len(TIME))
    assert channel_floor(MOTION + drift + noise) == pytest.approx(3e-6, rel=0.1)


def test_values_that_are_missing_do_not_count() -> None:
    ramp = np.round(np.linspace(0.0, 200.0, 4000))
    ramp[100:200] = np.nan
    assert channel_floor(ramp) == pytest.approx(1.0 / math.sqrt(12.0))


def test_a_floor_is_never_nothing() -> None:
    assert channel_floor(np.zeros(1000)) > 0.0
    assert channel_floor(np.full(1000, np.nan)) > 0.0
    assert channel_floor(np.full(3, np.nan), 2.0) == pytest.approx(2.0 / math.sqrt(12.0))


def test_the_smallest_step_is_seen_where_levels_repeat() -> None:
    assert smallest_step(np.array([0.0, 0.5, 0.5, 2.0, 2.0, 0.0])) == 0.5
    assert smallest_step(np.linspace(0.0, 1.0, 50)) == 0.0
    assert smallest_step(np.zeros(50)) == 0.0
