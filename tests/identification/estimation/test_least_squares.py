"""Fits: values come back from recordings with intervals that hold the truth, within bounds and within what was known beforehand."""

import numpy as np
import pytest

from lathesim.engine.assembly import FloatArray
from lathesim.identification.estimation.least_squares import Begun, fit, fit_each
from lathesim.identification.records.fit import Free, with_start
from lathesim.identification.replay.simulator import Simulator
from tests.diagnosis.pushed_table import MASS, VISCOUS, Hidden, baseline, experiments, machine, pair, recording

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


def test_bounds_are_kept() -> None:
    found = fit(pair(Hidden())[0].sensed, unknown(low=50.0), rounds=2)
    assert found.by_name["x_axis.mass"] == 50.0


def test_beside_a_value_at_its_bound_the_others_go_where_they_fit_best() -> None:
    """A step that ran into a bound and was cut short would leave the friction where it belongs only together with another mass."""
    experiment = pair(Hidden())[0]
    noise = fit(experiment.sensed, unknown(low=50.0), rounds=1).noise
    found = fit(experiment.sensed, unknown(low=50.0), noise=noise, rounds=1)
    alone = fit(experiment.sensed, unknown()[1:], {"x_axis.mass": 50.0}, noise=noise, rounds=1)
    assert found.by_name["x_axis.mass"] == 50.0
    assert found.by_name["x_axis.viscous"] == pytest.approx(alone.by_name["x_axis.viscous"], rel=5e-3)


def test_a_friction_below_zero_is_no_explanation() -> None:
    """A table that pushes itself would fit better than one without friction; it is not offered."""
    (experiment,) = experiments(recording(Hidden(law=lambda v, q, t: -40.0 * v, viscous=0.0), count=1000))
    found = fit(experiment.sensed, unknown(), rounds=2)
    assert found.by_name["x_axis.viscous"] == 0.0


def test_constant_values_stay() -> None:
    found = fit(pair(Hidden())[0].sensed, unknown()[1:], {"x_axis.mass": 44.0}, rounds=1)
    assert found.by_name["x_axis.mass"] == 44.0
    assert found.names == ["x_axis.viscous"]


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


def test_known_slopes_need_no_runs_of_their_own() -> None:
    sensed = pair(Hidden())[0].sensed
    first = fit(sensed, unknown())
    assert first.sensitivity is not None
    known = dict(zip(first.names, first.sensitivity, strict=True))
    (again,) = fit_each(sensed, [Begun(with_start(first), known=known)], rounds=1)
    assert again.values == pytest.approx(first.values, rel=1e-6)


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


def test_slopes_are_taken_once_where_a_machine_is_nearly_linear(monkeypatch: pytest.MonkeyPatch) -> None:
    """The start of a recording moves what is simulated in proportion: one Jacobian, a step or two, and one more Jacobian for the errors."""
    (experiment,) = experiments(recording(count=500))
    simulated: list[int] = []

    def counted(simulator: Simulator, names: list[str], values: FloatArray) -> list[FloatArray]:
        simulated.append(len(values))
        return simulator.of(names, values)

    monkeypatch.setattr(Simulator, "of", Simulator.residuals, raising=False)
    monkeypatch.setattr(Simulator, "residuals", counted)
    starts = experiment.start_states(experiment.sensed.plan)
    fit(experiment.sensed, starts, {"x_axis.mass": MASS, "x_axis.viscous": VISCOUS}, rounds=3)
    rough = sum(simulated)
    assert rough <= 1 + 2 * len(starts) + 4
    simulated.clear()
    fit(experiment.sensed, starts, {"x_axis.mass": MASS, "x_axis.viscous": VISCOUS}, rounds=3, slopes="kept")
    assert sum(simulated) == rough - len(starts)
