"""The one descent: it ends where a formula says, in few calls, within bounds, and takes no step from a lost run."""

import numpy as np
import pytest

from lathesim.engine.assembly import FloatArray
from lathesim.identification.estimation.fit import Fit, Problem, Weighting, fit, fit_linear
from lathesim.identification.records.fit import Free

TIME = np.linspace(0.0, 3.0, 60)
FREE = (Free("size", 1.0, 1.0), Free("rate", 1.0, 1.0, 0.0, 5.0))
TRUE = np.array([2.0, 0.7])


class Decay:
    """What is left of y = 2 exp(-0.7 t) by rows of size and rate, with a note of how many rows each call had."""

    def __init__(self) -> None:
        self.calls: list[int] = []

    def __call__(self, rows: FloatArray) -> list[FloatArray]:
        self.calls.append(len(rows))
        size, rate = rows.T
        return list(TRUE[0] * np.exp(-TRUE[1] * TIME) - size[:, None] * np.exp(-rate[:, None] * TIME))


def test_values_come_back_from_afar() -> None:
    found = fit(Decay(), FREE, np.array([0.3, 4.0]), least=0.0, iterations=30)
    assert found.values == pytest.approx(TRUE, rel=1e-4)
    assert found.cost < 1e-8


def test_the_start_and_its_jacobian_are_one_call() -> None:
    decay = Decay()
    start = Problem(decay, FREE).begin(np.array([1.9, 0.8]))
    assert decay.calls == [3]
    fit(decay, FREE, start, least=0.0, iterations=1)
    assert decay.calls == [3, 2]


def test_slopes_that_predict_well_are_kept_by_the_next_fit() -> None:
    linear = [Free("height", 0.0, 1.0), Free("slope", 0.0, 1.0)]
    calls: list[int] = []

    def left(rows: FloatArray) -> list[FloatArray]:
        calls.append(len(rows))
        return [1.0 + 2.0 * TIME - height - slope * TIME for height, slope in rows]

    first = fit(left, linear, np.zeros(2), least=1e-9, iterations=1)
    assert first.slopes is not None
    again = fit(left, linear, first, least=1e-9)
    assert again.values == pytest.approx([1.0, 2.0], rel=1e-4)
    assert 2 not in calls[2:], "no further Jacobian"


def test_a_value_stops_at_its_bound_and_the_others_go_where_they_fit_best() -> None:
    bounded = (FREE[0], Free("rate", 2.0, 1.0, 1.0, 5.0))
    found = fit(Decay(), bounded, np.array([0.3, 4.0]), least=0.0, iterations=30)
    shape = np.exp(-TIME)
    assert found.values[1] == 1.0
    assert found.values[0] == pytest.approx(shape @ (TRUE[0] * np.exp(-TRUE[1] * TIME)) / (shape @ shape), rel=1e-4)


def test_what_is_known_beforehand_is_weighed_against_the_residual() -> None:
    known = [Free("mean", 0.0, 1.0, uncertainty=0.5, given=3.0)]
    found = fit(lambda rows: [np.ones(4) - row for row in rows], known, np.zeros(1), least=0.0)
    assert found.values[0] == pytest.approx((4.0 * 1.0 + 3.0 / 0.25) / (4.0 + 1.0 / 0.25), rel=1e-4)


def test_weights_of_the_residual_decide() -> None:
    class First(Weighting):
        """Only the first number counts."""

        def power(self, residual: FloatArray) -> float:
            return float(residual[0] ** 2)

        def white(self, residual: FloatArray) -> FloatArray:
            return residual[:1]

        def white_slopes(self, slopes: FloatArray, residual: FloatArray) -> FloatArray:
            return slopes[:, :1].T

    found = fit(
        lambda rows: [np.array([1.0, 5.0]) - row for row in rows], [Free("mean", 0.0, 1.0)], np.zeros(1), weighting=First(), least=0.0
    )
    assert found.values[0] == pytest.approx(1.0, abs=1e-6)


def test_a_lost_run_is_never_the_best_step() -> None:
    """Beyond 1.5 every run is lost; the whole step to 2 leads there."""

    def left(rows: FloatArray) -> list[FloatArray]:
        return [np.array([2.0 - row[0] if row[0] < 1.5 else np.nan]) for row in rows]

    found = fit(left, [Free("x", 0.0, 1.0)], np.zeros(1), least=0.0, iterations=20)
    assert 0.0 < found.values[0] < 1.5
    assert np.isfinite(found.cost)


def test_from_a_lost_run_there_is_no_step() -> None:
    found = fit(lambda rows: [np.full(3, np.nan) for _ in rows], FREE, np.array([1.0, 1.0]))
    assert found.values == pytest.approx([1.0, 1.0])
    assert np.isnan(found.cost)


def test_a_descent_ends_where_slopes_promise_too_little() -> None:
    decay = Decay()
    found = fit(decay, FREE, np.array([0.3, 4.0]), worth=lambda cost: 2.0 * cost)
    assert (decay.calls, found.values.tolist()) == ([3], [0.3, 4.0])


def test_known_slopes_need_no_runs() -> None:
    decay = Decay()
    slope = np.exp(-TIME)
    problem = Problem(lambda rows: decay(np.column_stack([rows, np.full(len(rows), 1.0)])), FREE[:1], {0: slope})
    assert isinstance(fit(problem, FREE[:1], np.array([0.0]), least=0.0), Fit)
    assert all(count <= 2 for count in decay.calls)
    assert decay.calls[0] == 1


def test_a_linear_fit_keeps_its_bounds_and_is_the_best_there() -> None:
    slopes, goal = np.column_stack([np.ones(60), TIME]), 1.0 + 2.0 * TIME
    assert fit_linear(slopes, goal, np.full(2, -9.0), np.full(2, 9.0)) == pytest.approx([1.0, 2.0])
    found = fit_linear(slopes, goal, np.full(2, -9.0), np.array([9.0, 1.5]))
    assert found == pytest.approx([float(np.mean(goal - 1.5 * TIME)), 1.5])
