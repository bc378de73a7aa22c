"""A column that tells when something was on."""

import numpy as np
import pytest

from lathesim.recordings.sample_grid import Threshold, switched

PERIOD = 1e-3
TIME = np.arange(1000) * PERIOD
CUT = np.where((TIME >= 0.2) & (TIME < 0.7), 100.0, 0.0)


def stretches(column: np.ndarray, above: float = 50.0, until_below: float = 50.0, lasting: float = 0.01) -> list[tuple[int, int]]:
    on = switched(column, Threshold(above, until_below, lasting, 1.0), PERIOD)
    edges = np.diff(np.concatenate([[0], on.astype(int), [0]]))
    return list(zip(np.flatnonzero(edges == 1).tolist(), np.flatnonzero(edges == -1).tolist(), strict=True))


def test_on_while_the_column_is_above() -> None:
    assert stretches(CUT) == [(200, 700)]


def test_noise_and_single_spikes_do_not_switch() -> None:
    noisy = CUT + np.random.default_rng(0).normal(0.0, 20.0, len(CUT))
    noisy[[50, 400, 401, 900]] = [200.0, -200.0, -200.0, 200.0]
    assert stretches(noisy, lasting=0.02) == [(pytest.approx(200, abs=3), pytest.approx(700, abs=3))]


def test_two_levels_do_not_chatter_between_them() -> None:
    waves = 50.0 + 20.0 * np.sin(2.0 * np.pi * 5.0 * TIME) * (TIME > 0.2) * (TIME < 0.7) + 40.0 * ((TIME > 0.2) & (TIME < 0.7)) - 45.0
    assert len(stretches(waves, above=50.0, lasting=0.0)) > 1
    assert len(stretches(waves, above=50.0, until_below=10.0, lasting=0.0)) == 1


def test_a_fall_may_count_at_a_higher_level_than_the_rise() -> None:
    """A force that climbs slowly and falls slowly: on at the first touch, off as soon as it gives way."""
    slow = np.interp(TIME, [0.0, 0.2, 0.4, 0.6, 0.8, 1.0], [0.0, 0.0, 100.0, 100.0, 0.0, 0.0])
    assert stretches(slow, above=10.0, until_below=90.0) == [(221, 621)]


@pytest.mark.parametrize(("samples", "found"), [(10, [(300, 310)]), (9, [])])
def test_a_crossing_counts_from_the_time_it_has_to_last_on(samples: int, found: list[tuple[int, int]]) -> None:
    short = np.zeros(len(TIME))
    short[300 : 300 + samples] = 100.0
    assert stretches(short, lasting=0.01) == found


def test_on_from_the_start_and_until_the_end() -> None:
    assert stretches(100.0 - CUT) == [(0, 200), (700, 1000)]


def test_several_times_and_never() -> None:
    assert len(stretches(np.where(np.sin(2.0 * np.pi * 4.0 * TIME) > 0.0, 100.0, 0.0))) == 4
    assert stretches(CUT, above=200.0, until_below=200.0) == []
