"""The one descent, and fits of recordings by it: values come back with intervals that hold the truth, within bounds and prior."""

import numpy as np
import pytest

from lathesim.engine.assembly import FloatArray
from lathesim.identification.estimation.fit import Descent, Fit, Problem, Weighting, fit_linear
from lathesim.identification.estimation.fit import fit as descend
from lathesim.identification.estimation.least_squares import Begun, fit, fit_each
from lathesim.identification.records import Free, with_start
from tests.diagnosis.pushed_table import MASS, VISCOUS, Hidden, baseline, experiments, machine, pair, recording

TIME = np.linspace(0.0, 3.0, 60)
FREE = (Free("size", 1.0, 1.0), Free("rate", 1.0, 1.0, 0.0, 5.0))
DECAY = np.array([2.0, 0.7])


class Decay:
    """What is left of y = 2 exp(-0.7 t) by rows of size and rate, with a note of how many rows each call had."""

    def __init__(self) -> None:
        self.calls: list[int] = []

    def __call__(self, rows: FloatArray) -> list[FloatArray]:
        self.calls.append(len(rows))
        size, rate = rows.T
        return list(DECAY[0] * np.exp(-DECAY[1] * TIME) - size[:, None] * np.exp(-rate[:, None] * TIME))


def test_values_come_back_from_afar() -> None:
    found = descend(Descent(Problem(Decay(), FREE), least=0.0), np.array([0.3, 4.0]), 30)
    assert found.values == pytest.approx(DECAY, rel=1e-4)
    assert found.cost < 1e-8


def test_the_start_and_its_jacobian_are_one_call() -> None:
    decay = Decay()
    start = Problem(decay, FREE).begin(np.array([1.9, 0.8]))
    assert decay.calls == [3]
    descend(Descent(Problem(decay, FREE), least=0.0), start, 1)
    assert decay.calls == [3, 2]


def test_slopes_of_a_place_that_is_not_left_are_those_of_the_end() -> None:
    decay = Decay()
    found = descend(Descent(Problem(decay, FREE)), np.array(DECAY))
    assert found.fresh
    assert decay.calls[0] == 3, "the start and its slopes are one call"
    assert found.values == pytest.approx(DECAY)


def test_a_slope_beside_values_whose_run_grows_is_that_of_the_other_side() -> None:
    """With less than 1 the steps are too long for the rate: the run grows, and no interval is as narrow as that makes it."""
    free = [Free("rate", 1.0, 1.0)]

    def left(rows: FloatArray) -> list[FloatArray]:
        return [rate * TIME - 3.0 if rate >= 1.0 else 1e12 * np.ones_like(TIME) for (rate,) in rows]

    problem = Problem(left, free)
    here = np.array([1.001])
    slopes = problem.answered(problem.central(here, left(here[None])[0]))
    assert slopes[0] == pytest.approx(-TIME)


def test_slopes_that_predict_well_are_kept_by_the_next_fit() -> None:
    linear = [Free("height", 0.0, 1.0), Free("slope", 0.0, 1.0)]
    calls: list[int] = []

    def left(rows: FloatArray) -> list[FloatArray]:
        calls.append(len(rows))
        return [1.0 + 2.0 * TIME - height - slope * TIME for height, slope in rows]

    how = Descent(Problem(left, linear), least=1e-9)
    first = descend(how, np.zeros(2), 1)
    assert first.slopes is not None
    again = descend(how, first)
    assert again.values == pytest.approx([1.0, 2.0], rel=1e-4)
    assert 2 not in calls[2:], "no further Jacobian"


def test_corrected_slopes_save_runs_where_each_step_bends_them() -> None:
    free = [Free(f"bend {number}", 0.0, 1.0) for number in range(8)]
    made: dict[bool, int] = {}
    for corrects in (False, True):
        calls: list[int] = []

        def left(rows: FloatArray, calls: list[int] = calls) -> list[FloatArray]:
            calls.append(len(rows))
            return list(1.0 - rows - 0.6 * np.roll(rows, 1, axis=1) * rows - 0.3 * rows**3)

        found = descend(Descent(Problem(left, free), corrects=corrects), np.linspace(-0.5, 2.0, 8), 30)
        assert found.cost < 0.05
        made[corrects] = sum(calls)
    assert made[True] < 0.8 * made[False]


def test_small_valleys_do_not_stop_a_descent() -> None:
    """As a friction that holds or slides makes them: a thousandth further on, each of them falls the other way."""

    def left(rows: FloatArray) -> list[FloatArray]:
        return [TIME * (size - 1.0) + 0.3 * np.abs((200.0 * size + TIME) % 1.0 - 0.5) for (size,) in rows]

    found = descend(Descent(Problem(left, FREE[:1])), np.array([3.0]), 30)
    assert found.rough
    assert found.values[0] == pytest.approx(1.0, abs=0.1)


def test_a_value_stops_at_its_bound_and_the_others_go_where_they_fit_best() -> None:
    bounded = (FREE[0], Free("rate", 2.0, 1.0, 1.0, 5.0))
    found = descend(Descent(Problem(Decay(), bounded), least=0.0), np.array([0.3, 4.0]), 30)
    shape = np.exp(-TIME)
    assert found.values[1] == 1.0
    assert found.values[0] == pytest.approx(shape @ (DECAY[0] * np.exp(-DECAY[1] * TIME)) / (shape @ shape), rel=1e-4)


def test_what_is_known_beforehand_is_weighed_against_the_residual() -> None:
    known = [Free("mean", 0.0, 1.0, uncertainty=0.5, given=3.0)]
    found = descend(Descent(Problem(lambda rows: [np.ones(4) - row for row in rows], known), least=0.0), np.zeros(1))
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

    problem = Problem(lambda rows: [np.array([1.0, 5.0]) - row for row in rows], [Free("mean", 0.0, 1.0)])
    found = descend(Descent(problem, First(), least=0.0), np.zeros(1))
    assert found.values[0] == pytest.approx(1.0, abs=1e-6)


def test_a_lost_run_is_never_the_best_step() -> None:
    """Beyond 1.5 every run is lost; the whole step to 2 leads there."""

    def left(rows: FloatArray) -> list[FloatArray]:
        return [np.array([2.0 - row[0] if row[0] < 1.5 else np.nan]) for row in rows]

    found = descend(Descent(Problem(left, [Free("x", 0.0, 1.0)]), least=0.0), np.zeros(1), 20)
    assert 0.0 < found.values[0] < 1.5
    assert np.isfinite(found.cost)


def test_from_a_lost_run_there_is_no_step() -> None:
    found = descend(Descent(Problem(lambda rows: [np.full(3, np.nan) for _ in rows], FREE)), np.array([1.0, 1.0]))
    assert found.values == pytest.approx([1.0, 1.0])
    assert np.isnan(found.cost)


def test_a_descent_ends_where_slopes_promise_too_little() -> None:
    decay = Decay()
    found = descend(Descent(Problem(decay, FREE), worth=lambda cost: 2.0 * cost), np.array([0.3, 4.0]))
    assert (decay.calls, found.values.tolist()) == ([3], [0.3, 4.0])


def test_known_slopes_need_no_runs() -> None:
    decay = Decay()
    slope = np.exp(-TIME)
    problem = Problem(lambda rows: decay(np.column_stack([rows, np.full(len(rows), 1.0)])), FREE[:1], {0: slope})
    assert isinstance(descend(Descent(problem, least=0.0), np.array([0.0])), Fit)
    assert all(count <= 2 for count in decay.calls)
    assert decay.calls[0] == 1


def test_a_linear_fit_keeps_its_bounds_and_is_the_best_there() -> None:
    slopes, goal = np.column_stack([np.ones(60), TIME]), 1.0 + 2.0 * TIME
    assert fit_linear(slopes, goal, np.full(2, -9.0), np.full(2, 9.0)) == pytest.approx([1.0, 2.0])
    found = fit_linear(slopes, goal, np.full(2, -9.0), np.array([9.0, 1.5]))
    assert found == pytest.approx([float(np.mean(goal - 1.5 * TIME)), 1.5])


TRUE = {"x_axis.mass": MASS, "x_axis.viscous": VISCOUS}


def unknown(low: float = 1.0) -> list[Free]:
    """Mass and friction of which nothing is known beforehand, started far off."""
    return [Free("x_axis.mass", 60.0, 20.0, low), Free("x_axis.viscous", 120.0, 100.0, 0.0)]


def test_mass_and_friction_come_back_with_honest_errors() -> None:
    pulls = []
    for seed in range(8):
        (experiment,) = experiments(recording(seed=seed, count=1000))
        found = fit(experiment.sensed, [*unknown(), *experiment.start_states(experiment.sensed.plan)])
        for name, true in TRUE.items():
            assert found.by_name[name] == pytest.approx(true, rel=1e-4)
            pulls.append((found.by_name[name] - true) / found.error(name))
    assert np.sqrt(np.mean(np.square(pulls))) < 1.6
    assert np.mean(np.abs(pulls) < 1.96) >= 0.8


def test_what_is_known_beforehand_holds_what_the_recording_cannot_tell() -> None:
    (experiment,) = experiments(recording(count=500, size=0.0))
    held = [item for item in baseline(experiment) if item.name in TRUE]
    found = fit(experiment.sensed, held, rounds=1)
    assert found.by_name["x_axis.mass"] == pytest.approx(MASS)
    assert found.error("x_axis.mass") == pytest.approx(0.05 * MASS, rel=1e-3)


def test_what_is_known_beforehand_yields_to_a_good_recording() -> None:
    (experiment,) = experiments(recording(), of=machine(mass=1.05 * MASS, viscous=0.9 * VISCOUS))
    found = fit(experiment.sensed, baseline(experiment))
    assert found.by_name["x_axis.mass"] == pytest.approx(MASS, rel=1e-4)
    # a little over one standard deviation off each, and the start of the recording besides
    paid = (0.05 / (0.05 * 1.05)) ** 2 + (0.1 / (0.1 * 0.9)) ** 2
    assert paid < found.penalty < paid + 4.0
    assert found.score == found.log_likelihood - 0.5 * found.penalty


def test_a_fit_with_nothing_free_is_a_look_at_the_residual() -> None:
    found = fit(pair(Hidden())[0].sensed, [], TRUE)
    assert found.residual.shape == (1, 2000)
    assert found.covariance.shape == (0, 0)
    assert found.by_name == TRUE


def test_going_on_from_a_fit_changes_nothing() -> None:
    sensed = pair(Hidden())[0].sensed
    first = fit(sensed, unknown())
    again = fit(sensed, with_start(first), rounds=1)
    for name in TRUE:
        assert again.by_name[name] == pytest.approx(first.by_name[name], abs=first.error(name))


def test_fits_side_by_side_end_where_each_ends_alone() -> None:
    sensed = pair(Hidden())[0].sensed
    starts = [Begun(unknown()), Begun([unknown()[0]], {"x_axis.viscous": VISCOUS}), Begun(with_start(fit(sensed, unknown())))]
    alone = [fit(sensed, one.free, one.constant, rounds=2) for one in starts]
    assert [one.values.tolist() for one in fit_each(sensed, starts, rounds=2)] == [one.values.tolist() for one in alone]


def test_a_force_that_is_left_out_is_absorbed_and_the_errors_say_so() -> None:
    """Left-out Coulomb friction doubles the viscous coefficient; the interval must be wide, and the residual is no noise."""
    two = (pair(Hidden())[0], pair(Hidden(dry=20.0))[0])
    clean, rubbing = (fit(experiment.sensed, [*unknown(), *experiment.start_states(experiment.sensed.plan)]) for experiment in two)
    assert rubbing.by_name["x_axis.viscous"] > 1.5 * VISCOUS
    assert rubbing.error("x_axis.viscous") > 100.0 * clean.error("x_axis.viscous")
    assert np.std(rubbing.residual) > 100.0 * np.std(clean.residual)


def test_the_size_of_a_friction_comes_back_when_it_acts_on_simulated_motion() -> None:
    experiment = pair(Hidden(dry=20.0))[0]
    level = next(candidate for candidate in experiment.candidates if candidate.name == "CoulombFriction").parameters[0]
    found = fit(experiment.replayed, [*baseline(experiment), Free(level, 15.0, 10.0, 0.0)])
    assert found.by_name[level] == pytest.approx(20.0, rel=0.02)
    assert found.by_name["x_axis.mass"] == pytest.approx(MASS, rel=0.01)
    assert found.by_name["x_axis.viscous"] == pytest.approx(VISCOUS, rel=0.03)
