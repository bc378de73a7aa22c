"""A watermark's variances, correlation, delays and price; run lengths of the CUSUM."""

import numpy as np
import pytest

from lathesim.experiments.guard_theory import (
    WatermarkedLoop,
    frontier,
    log_likelihood_ratio,
    simulate_loops,
    watermark_within,
)
from tests.cli.command import refused

LOOP = WatermarkedLoop()


def test_loop_in_numbers() -> None:
    assert LOOP.gain == pytest.approx(0.597407, abs=1e-6)
    assert LOOP.innovation == pytest.approx(0.0248390, abs=1e-7)
    assert LOOP.memory == pytest.approx(0.161037, abs=1e-6)
    assert [LOOP.replayed_variance(size) for size in (0.05, 0.1, 0.2)] == pytest.approx([0.02997, 0.0454, 0.107], rel=1e-3)
    assert [LOOP.cost(size) for size in (0.0, 0.05, 0.1, 0.2)] == pytest.approx([0.0165, 0.0194, 0.0284, 0.0640], rel=6e-3)


def test_simulation_agrees_with_the_formulas() -> None:
    seen = simulate_loops(LOOP, 0.1, 3000, 200, seed=3, replay_from=1500)
    honest, replayed = slice(100, 1500), slice(1600, 3000)
    assert np.var(seen.innovation[:, honest]) == pytest.approx(LOOP.innovation, rel=0.02)
    assert np.mean(np.square(seen.state[:, honest])) == pytest.approx(LOOP.cost(0.1), rel=0.03)
    assert np.var(seen.innovation[:, replayed]) == pytest.approx(LOOP.replayed_variance(0.1), rel=0.02)
    products = seen.innovation * seen.watermark
    assert np.mean(products[:, replayed]) == pytest.approx(LOOP.replayed_correlation(0.1), rel=0.05)
    assert abs(np.mean(products[:, honest])) < 3e-4


def test_information_of_a_replayed_reading_is_the_mean_of_the_likelihood_ratio() -> None:
    seen = simulate_loops(LOOP, 0.1, 3000, 200, seed=3, replay_from=1500)
    assert log_likelihood_ratio(LOOP, 0.1, seen)[:, 1600:].mean() == pytest.approx(LOOP.information(0.1), rel=0.03)
    assert LOOP.information(0.0) == 0.0


def test_watermark_is_chosen_by_its_information() -> None:
    size = watermark_within(LOOP, 30.0, 10_000.0)
    assert LOOP.information(size) * 30.0 == pytest.approx(np.log(10_000.0))
    # the run lengths of the test below: 29 samples at 0.1, so what is chosen for 30 samples is a little larger
    assert 0.1 < size < 0.12


@pytest.mark.slow
def test_delays_at_one_false_alarm_in_ten_thousand_samples() -> None:
    points = frontier(LOOP, (0.0, 0.05, 0.1, 0.2), 10_000.0)
    assert np.isnan(points[0].delay)
    assert [point.delay for point in points[1:]] == pytest.approx([100.0, 29.0, 8.0], rel=0.05)


def test_an_unstable_loop_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    said = refused(capsys, "watermark", "--feedback", "2.5")
    assert said.err == "--feedback: the loop is unstable: a - b L is -1.6. Choose a feedback with which it lies between -1 and 1.\n"
