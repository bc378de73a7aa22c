"""The values a diagnosis reports: from both recordings, with intervals that grow where the recordings disagree."""

import functools
from dataclasses import replace

import numpy as np
import pytest

from lathesim.diagnosis.explaining.starts import candidate_free
from lathesim.diagnosis.explaining.trial import modelled
from lathesim.identification.estimation import estimates as parameters
from lathesim.identification.estimation.covariance import covariance_of
from lathesim.identification.estimation.estimates import (
    Estimate,
    Estimates,
    estimates,
    interval_includes_neutral,
    joint_covariance,
)
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.records.fit import Fitted, Free
from lathesim.identification.records.model import Model
from tests.diagnosis.pushed_table import MASS, VISCOUS, Hidden, baseline, experiments, pair, recording, study

TRUE = {"x_axis.mass": MASS, "x_axis.viscous": VISCOUS}


@functools.cache
def estimated(second: Hidden) -> Estimates:
    """Fit a sound table to one recording and ask a recording of another table about it."""
    experiment, validation = experiments(recording(Hidden(), seed=1), recording(second, seed=2))
    return estimates(model_of(experiment, validation), experiment, validation, None)


def model_of(experiment, validation) -> Model:  # type: ignore[no-untyped-def]
    return modelled(study(experiment, validation), (), fit(experiment.sensed, baseline(experiment)))


def test_two_recordings_of_one_machine_agree() -> None:
    found = estimated(Hidden())
    assert set(found.by_name) == set(TRUE)
    assert found.inflation < 3.0
    for name, true in TRUE.items():
        assert found.by_name[name].value == pytest.approx(true, rel=1e-4)


def test_intervals_grow_where_two_recordings_disagree() -> None:
    """A table that became two percent heavier between the recordings has no one mass."""
    same, other = estimated(Hidden()), estimated(Hidden(mass=1.02 * MASS))
    assert other.inflation > 3.0 * same.inflation
    assert other.by_name["x_axis.mass"].error > 3.0 * same.by_name["x_axis.mass"].error


def test_what_belongs_to_one_recording_is_not_reported() -> None:
    assert not any(name.endswith((".speed", ".travel", ".phase")) for name in estimated(Hidden()).by_name)


def test_a_whole_recording_is_fitted_once_more_where_both_are_its_halves() -> None:
    experiment, validation, whole = experiments(recording(seed=1, count=1000), recording(seed=2, count=1000), recording(seed=3))
    found = estimates(model_of(experiment, validation), experiment, validation, whole)
    for name, true in TRUE.items():
        assert found.by_name[name].value == pytest.approx(true, rel=1e-4)
        assert abs(found.by_name[name].value - true) < 4.0 * found.by_name[name].error


def test_what_was_known_beforehand_is_not_made_less_sure() -> None:
    """An inflated error never exceeds the uncertainty that the lesson gives."""
    experiment, validation = experiments(recording(count=300, size=0.0), recording(count=300, size=0.0, seed=2))
    found = estimates(model_of(experiment, validation), experiment, validation, None)
    assert found.by_name["x_axis.mass"].error <= 1.001 * 0.05 * MASS


@pytest.mark.parametrize(("error", "open_"), [(3.0, False), (4.0, True)])
def test_an_effect_is_open_where_its_interval_holds_nothing(error: float, open_: bool) -> None:
    candidate = next(candidate for candidate in pair(Hidden())[0].candidates if candidate.name == "CoulombFriction")
    (name,) = candidate.parameters
    values = Estimates({name: Estimate(8.0, error, 0.1)}, 1.0)
    assert interval_includes_neutral(candidate, values) == open_


def test_a_wave_of_negative_size_is_the_same_wave_half_a_turn_on() -> None:
    """Two recordings whose fits ended on either side agree on its size."""
    hidden = Hidden(law=lambda v, q, t: 8.0 * np.sin(2.0 * np.pi * q / 0.008 + 0.5))
    experiment, validation = experiments(recording(hidden, seed=1), recording(hidden, seed=2))
    asked = study(experiment, validation)
    ripple = next(candidate for candidate in experiment.candidates if candidate.name == "TorqueRipple")
    sizes = {"amplitude": 8.0, "share": 0.0, "period": 0.008, "phase": 0.5}
    start = np.array([sizes[name.partition(".")[2]] for name in ripple.parameters])
    fitted = fit(experiment.sensed, [*baseline(experiment), *candidate_free(asked, ripple, start)])
    model = modelled(asked, (ripple,), fitted)
    size, phase = (fitted.names.index(f"{ripple.part}.{name}") for name in ("amplitude", "phase"))
    turned = np.array(fitted.values)
    turned[size], turned[phase] = -turned[size], turned[phase] + np.pi
    found = estimates(replace(model, fitted=replace(fitted, values=turned)), experiment, validation, None)
    assert abs(found.by_name[f"{ripple.part}.amplitude"].value) == pytest.approx(8.0, rel=0.02)


def told_of_a_product(given: float, uncertainty: float, noise: float) -> Fitted:
    """Return a fit of two values of which a recording tells only the product, both known beforehand."""
    free = tuple(Free(name, given, uncertainty, uncertainty=uncertainty, given=given) for name in ("first", "second"))
    slope = np.array([given, given]) / noise
    information = np.outer(slope, slope) + np.eye(2) / uncertainty**2
    empty = np.zeros((0, 0))
    return Fitted(free, np.array([given, given]), covariance_of(information), empty, (), 0.0, 0.0)


def test_what_only_a_product_tells_is_known_once_however_many_recordings_there_are() -> None:
    """Two values known to 5 %, and their product exactly: each is known to 5 % / sqrt(2), from one recording and from ten."""
    fit_of_one = told_of_a_product(2.0, 0.1, 1e-6)
    for many in (1, 2, 10):
        errors = np.sqrt(np.diag(joint_covariance([fit_of_one] * many, ["first", "second"], 1.0)))
        assert errors == pytest.approx(0.1 / np.sqrt(2.0), rel=1e-3)


def test_what_recordings_tell_by_themselves_is_known_better_by_two_of_them() -> None:
    free = (Free("size", 1.0, 1.0),)
    one = Fitted(free, np.ones(1), np.array([[0.04]]), np.zeros((0, 0)), (), 0.0, 0.0)
    assert np.sqrt(joint_covariance([one, one], ["size"], 1.0)) == pytest.approx(0.2 / np.sqrt(2.0), rel=1e-2)
    assert np.sqrt(joint_covariance([one, one], ["size"], 3.0)) == pytest.approx(0.6 / np.sqrt(2.0), rel=1e-2)


def test_a_friction_that_feels_its_own_motion_makes_no_value_surer() -> None:
    """Where a table sticks, a replay jumps with each value: a level that only the known mass tells was sure to a part in ten thousand."""
    with_simulated_motion = Estimates({"level": Estimate(24.4, 0.002, 0.002), "lead": Estimate(1.0, 0.1, 0.1)}, 1.0)
    sensed = Estimates({"level": Estimate(23.1, 0.35, 0.3), "lead": Estimate(1.1, 0.05, 0.05)}, 1.2)
    found = parameters._no_surer(with_simulated_motion, sensed)
    assert found.by_name == {"level": Estimate(24.4, 0.35, 0.3), "lead": Estimate(1.0, 0.1, 0.1)}
    assert found.inflation == 1.0
