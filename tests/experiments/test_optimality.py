"""Optimal designs against published and exact ones."""

import numpy as np
import pytest

from lathesim.experiments.precision import criterion_value, discounted, mean_variance


def friction(speeds: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the information of weighted settings about F = Fc sgn v + Fv v + F0."""
    regressors = np.column_stack([np.sign(speeds), speeds, np.ones_like(speeds)])
    return regressors.T @ (regressors * weights[:, None])


def test_friction_is_told_best_by_the_ends_of_both_directions() -> None:
    speeds = np.r_[-np.linspace(0.01, 0.2, 21), np.linspace(0.01, 0.2, 21)]
    ends = np.isin(np.abs(speeds), (0.01, 0.2)) / 4.0
    assert np.linalg.det(friction(speeds, ends)) == pytest.approx(0.009025, abs=1e-9)
    even = np.r_[-np.linspace(0.01, 0.2, 5), np.linspace(0.01, 0.2, 5)]
    assert np.linalg.det(friction(even, np.full(10, 0.1))) == pytest.approx(0.0045125, abs=1e-9)


def test_one_direction_is_told_to_be_singular() -> None:
    speeds = np.linspace(0.01, 0.2, 5)
    matrix = friction(speeds, np.full(5, 0.2))
    assert criterion_value(matrix, "D") == -np.inf


def test_the_variance_of_a_line_is_least_where_it_was_measured() -> None:
    """Of a line measured at -1 and 1, the variance at x is (1 + x^2) / 2; the mean over [-1, 1] is 2/3."""
    line = np.array([[1.0, -1.0], [1.0, 1.0]])
    places = np.linspace(-1.0, 1.0, 2001)
    aims = np.column_stack([np.ones_like(places), places])
    assert mean_variance(aims[[1000]], line.T @ line) == pytest.approx(0.5)
    assert mean_variance(aims, line.T @ line) == pytest.approx(2.0 / 3.0, abs=1e-3)


def test_a_reading_counts_less_where_the_structure_errs() -> None:
    slopes, spread = np.array([[3.0, 0.0], [0.0, 1e-3]]), np.array([2.0, 1.0])
    assert discounted(slopes, spread, 0.0) == pytest.approx(slopes)
    counted = discounted(slopes, spread, 0.5)
    assert counted[0, 0] == pytest.approx(3.0 / np.sqrt(1.0 + 0.25 * 36.0))
    assert counted[1, 1] == pytest.approx(1e-3, rel=1e-6)
