"""A shift in time is sought over half a period of the motion at most."""

import numpy as np
import pytest

from lathesim.recordings.faults.time_shift import motion_shift

SAMPLES = np.arange(4000.0)


@pytest.mark.parametrize("period", [20.5, 72.5, 190.5])
def test_a_period_of_a_sine_is_no_late_channel(period: float) -> None:
    """Half a sample late, it is a whole number of samples late a period later, and more like itself at that one."""

    def place(sample: np.ndarray) -> np.ndarray:
        return np.sin(2.0 * np.pi * sample / period)

    assert motion_shift(place(SAMPLES), place(SAMPLES - 2.5)) == pytest.approx(2.5, abs=0.1)


def test_a_motion_that_does_not_repeat_may_be_late_by_more() -> None:
    rng = np.random.default_rng(2)
    walk = np.cumsum(np.convolve(rng.standard_normal(4000), np.ones(200) / 200, mode="same"))
    assert motion_shift(walk[100:], walk[:-100]) == pytest.approx(100.0, abs=0.5)
