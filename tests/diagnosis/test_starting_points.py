"""Steps of a residual are found where they are, and a search for lost counts begins there."""

import numpy as np
import pytest

from lathesim.diagnosis.starting_points import instants_of, strongest_jumps


@pytest.mark.parametrize("instant", [0.31, 1.5, 2.9])
def test_a_step_in_noise_is_found_with_its_size(instant: float) -> None:
    time = np.arange(4000) * 1e-3
    signal = np.where(time >= instant, 5e-6, 0.0) + 1e-6 * np.random.default_rng(3).standard_normal(4000)
    found, size = strongest_jumps(signal, 1e-3)[0]
    assert found == pytest.approx(instant, abs=5e-3)
    assert size == pytest.approx(5e-6, rel=0.05)


def test_a_step_on_a_slow_wander_is_among_those_of_a_short_window() -> None:
    time = np.arange(4000) * 1e-3
    signal = np.where(time >= 1.0, 5e-6, 0.0) + 20e-6 * np.sin(1.5 * time)
    assert min(abs(found - 1.0) for found, _ in strongest_jumps(signal, 1e-3)) < 0.01


def test_instants_are_known_by_their_names() -> None:
    assert instants_of(["lost.instant", "lost.jump", "ripple.phase"]) == ["lost.instant"]
