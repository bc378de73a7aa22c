"""Standard errors: as large as the noise makes them, and larger where the form of the model is wrong."""

import numpy as np
import pytest

from lathesim.identification.estimation.covariance import covariance_and_misfit, covariance_of


def test_two_values_of_which_only_the_sum_shows_are_as_unsure_as_beforehand() -> None:
    shown, known = 1e-3, 30.0
    slope = np.array([1.0, 1.0, 0.0])
    covariance = covariance_of(np.outer(slope, slope) / shown**2 + np.diag([1.0, 1.0, 0.0]) / known**2)
    assert np.sqrt(covariance[0, 0]) == pytest.approx(known / np.sqrt(2.0), rel=1e-3)
    assert np.sqrt(slope @ covariance @ slope) == pytest.approx(shown, rel=1e-3)
    assert covariance[2, 2] == 0.0  # nothing shows it, and nobody knew it beforehand


def fitted(misfit: float, seed: int) -> tuple[float, float]:
    """Return error and standard error of a line's size fitted to white noise and a misfit that is slow over the frequencies."""
    random = np.random.default_rng(seed)
    numbers = 4000
    slopes = np.column_stack([np.ones(numbers), np.tile(np.linspace(-1.0, 1.0, numbers // 2), 2)])
    place = np.tile(np.linspace(0.0, 12.0 * np.pi, numbers // 2), 2)
    residual = random.standard_normal(numbers) + misfit * np.sin(place + 2.0 * np.pi * random.random()) * random.standard_normal()
    values = np.linalg.lstsq(slopes, residual, rcond=None)[0]
    covariance, misfit = covariance_and_misfit(slopes, residual - slopes @ values, np.zeros(2), [numbers])
    return float(values[1]), float(misfit[1] * np.sqrt(covariance[1, 1]))


@pytest.mark.parametrize("misfit", [0.0, 0.5, 2.0])
def test_intervals_hold_the_truth_whether_the_form_is_right_or_not(misfit: float) -> None:
    outcomes = np.array([fitted(misfit, seed) for seed in range(200)])
    held = np.abs(outcomes[:, 0]) < 1.96 * outcomes[:, 1]
    assert np.mean(held) > 0.88


def test_of_a_right_model_the_errors_are_those_of_the_noise() -> None:
    errors = np.array([fitted(0.0, seed)[1] for seed in range(100)])
    alone = np.sqrt(3.0 / 4000)
    assert 0.99 * alone < np.median(errors) < 1.2 * alone


def test_a_run_that_was_lost_tells_nothing() -> None:
    slopes = np.column_stack([np.ones(100), np.full(100, np.inf), np.full(100, np.nan)])
    covariance, misfit = covariance_and_misfit(slopes, np.ones(100), np.array([0.0, 0.25, 0.0]), [60, 40])
    assert covariance[0, 0] == pytest.approx(0.01)
    assert (covariance[1, 1], covariance[2, 2]) == (4.0, 0.0)
    assert np.all(np.isfinite(misfit))


def test_a_value_that_a_few_frequencies_tell_is_as_unsure_as_they_are() -> None:
    """A misfit where the value is told is fitted away and pulls at nothing; without those frequencies the value is another one."""
    numbers, told = 4000, 20
    random = np.random.default_rng(1)
    slopes = np.zeros((numbers, 2))
    slopes[:, 0] = 1.0
    slopes[:told, 1] = slopes[numbers // 2 : numbers // 2 + told, 1] = np.linspace(5.0, 10.0, told)
    sound = random.standard_normal(numbers)
    wrong = sound + np.where(slopes[:, 1] > 0.0, 10.0 * np.sign(np.arange(numbers) % 2 - 0.5), 0.0)
    factors = []
    for residual in (sound, wrong):
        values = np.linalg.lstsq(slopes, residual, rcond=None)[0]
        factors.append(covariance_and_misfit(slopes, residual - slopes @ values, np.zeros(2), [numbers])[1])
    assert factors[0][1] < 3.0
    assert factors[1][1] > 5.0
    assert factors[1][0] < 3.0
