"""The values a diagnosis reports, their standard errors, how far a replay draws them, and what is fitted anew on another recording."""

import functools
import math
from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from lathesim.cli.main import run_command_line
from lathesim.cli.options import open_registry
from lathesim.diagnosis.explaining.starts import candidate_free
from lathesim.diagnosis.explaining.trial import modelled
from lathesim.effects.friction import ViscousWarmUp
from lathesim.engine.assembly import FloatArray
from lathesim.identification.estimation import estimates as parameters
from lathesim.identification.estimation.covariance import covariance_and_misfit, covariance_of
from lathesim.identification.estimation.estimates import (
    CONFIDENCE,
    Estimate,
    Estimates,
    as_simulated,
    estimates,
    interval_includes_neutral,
    joint_covariance,
    replay_bias,
    start_bias,
)
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.estimation.transfer import begun_anew, transferred
from lathesim.identification.records import Fitted, Free, Model, with_start
from lathesim.identification.replay.experiment import Experiment, baseline_free, build_experiments
from lathesim.identification.replay.loading import load_case
from lathesim.identification.replay.simulator import Simulator
from lathesim.lessons.lesson import load_lesson
from tests.diagnosis.pushed_table import MASS, PERIOD, VISCOUS, Hidden, Law, baseline, baselines, experiments, pair, recording, study
from tests.diagnosis.small_case import write_lesson

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


def test_values_are_those_of_one_recording_where_these_simulate_both_better() -> None:
    """A wave of force that nobody measured draws the values of the short recording, whose equations seem to be sure of them."""
    shaken = Hidden(law=lambda speed, place, time: 5.0 * math.sin(2.0 * math.pi * 7.3 * time))
    experiment, validation = experiments(recording(shaken, size=200.0), recording(shaken, size=200.0, seed=2, count=500))
    model = model_of(experiment, validation)
    mean = estimates(model, experiment, validation, None)
    found = as_simulated(mean, model, experiment, validation)
    assert found.values() == {name: model.fitted.by_name[name] for name in TRUE}
    viscous, before = (one.by_name["x_axis.viscous"] for one in (found, mean))
    assert viscous.value == pytest.approx(VISCOUS, abs=0.1)
    assert before.value == pytest.approx(199.44, abs=0.05)
    assert as_simulated(mean, model, validation, validation) is mean  # as where both were fitted together
    assert CONFIDENCE * viscous.error == pytest.approx(abs(viscous.value - before.value) + CONFIDENCE * before.error)


@pytest.mark.parametrize("second", [Hidden(mass=1.02 * MASS), Hidden(dry=5.0)])
def test_values_stay_the_mean_where_those_of_one_recording_simulate_the_other_worse(second: Hidden) -> None:
    """A heavier table has other values, and those of a table that rubs would spoil what is known of one that does not."""
    experiment, validation = experiments(recording(Hidden(), seed=1), recording(second, seed=2))
    assert as_simulated(estimated(second), model_of(experiment, validation), experiment, validation) is estimated(second)


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
    values = Estimates({name: Estimate(8.0, error)}, 1.0)
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
    with_simulated_motion = Estimates({"level": Estimate(24.4, 0.002), "lead": Estimate(1.0, 0.1)}, 1.0)
    sensed = Estimates({"level": Estimate(23.1, 0.35), "lead": Estimate(1.1, 0.05)}, 1.2)
    found = parameters._no_surer(with_simulated_motion, sensed)
    assert found.by_name == {"level": Estimate(24.4, 0.35), "lead": Estimate(1.0, 0.1)}
    assert found.inflation == 1.0


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


HIDDEN_MASS = 95.159
"""The mass that a recording of seed 3 is made with [kg], within 1 g."""
RUBBING = "insert: [{effect: CoulombFriction, at: x_axis, level: 20 N}]\n"


def replayed(folder: Path, noise: str) -> tuple[Experiment, Fitted]:
    """Return a controlled axis that rubs, with a recording of it, and its values fitted to that."""
    case = folder / f"case_{noise}"
    asked = ["--effect", "none", "--seed", "3", "--noise", noise, "--out", str(case)]
    assert run_command_line(["conceal", str(write_lesson(folder, extra=RUBBING)), *asked]) == 0
    loaded = load_case(load_lesson(case / "lesson.yaml"), [case / "recording.csv"], open_registry(()))
    recorded = loaded.recordings[0]
    experiment = build_experiments(loaded.machine, [(recorded.name, recorded.record)], ())[0]
    free = [*baseline_free(experiment.machine), *experiment.start_states(experiment.sensed.plan)]
    return experiment, fit(experiment.sensed, free, rounds=2, coloured=True)


@pytest.fixture(scope="module")
def quiet_and_noisy(tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, float]]:
    folder = tmp_path_factory.mktemp("replayed")
    return [dict(replay_bias(*replayed(folder, noise), full_band=False)) for noise in ("0.5", "200")]


def test_the_systematic_error_of_a_quiet_recording_is_small_and_told(quiet_and_noisy: list[dict[str, float]]) -> None:
    quiet, _ = quiet_and_noisy
    assert 0.0 < quiet["x_axis.mass"] < 0.5
    assert all(np.isfinite(list(quiet.values())))


def test_a_command_acts_as_it_was_recorded(tmp_path: Path) -> None:
    """Its noise has passed through the machine: taken for that of a reading, it would hide how far off the mass is."""
    experiment, fitted = replayed(tmp_path, "5")
    off = fitted.by_name["x_axis.mass"] - HIDDEN_MASS
    assert replay_bias(experiment, fitted, full_band=False)["x_axis.mass"] == pytest.approx(off, rel=0.1)


def test_what_noise_alone_may_have_made_is_not_told(quiet_and_noisy: list[dict[str, float]]) -> None:
    _, noisy = quiet_and_noisy
    assert set(noisy.values()) == {0.0}


def test_a_machine_that_nothing_feeds_back_has_no_bias() -> None:
    assert replay_bias(pair(Hidden())[0], baselines(Hidden())[0], full_band=False) == {}


class Valleys(Simulator):
    """A machine whose mass acts as one that goes up and down with it, as a friction that holds or slides makes a cost do."""

    def residuals(self, names: Sequence[str], values: FloatArray) -> list[FloatArray]:
        """Return the residuals with a mass between two that are the same distance from the true one."""
        column, mass = names.index("x_axis.mass"), values[:, names.index("x_axis.mass")]
        acting = np.array(values)
        acting[:, column] = MASS + 0.4 * np.sin(5.0 * np.pi * (mass - MASS))
        return super().residuals(names, acting)


def test_a_cost_of_many_valleys_leaves_open_how_far_they_reach() -> None:
    """Each is steep: its slopes tell a value far more surely than it is known."""
    experiment = experiments(recording(noise=1e-5))[0]
    fitted = fit(experiment.sensed, baseline(experiment), rounds=2, coloured=True)
    assert start_bias(experiment, Model((), fitted, fitted), fitted) == {}
    rough, sensed = replace(experiment), experiment.sensed
    vars(rough)["sensed"] = Valleys(**{item.name: getattr(sensed, item.name) for item in fields(sensed)})
    in_one = fit(rough.sensed, with_start(fitted), rounds=2, coloured=True)
    assert in_one.error_by_noise("x_axis.mass") < 0.01
    assert start_bias(rough, Model((), in_one, in_one), in_one)["x_axis.mass"] > 0.2


CHANGE, WARMING = -120.0, 2.0


def after(warmed: float) -> Law:
    """Return grease that thins [N], of a table that has been running for some time [s]."""
    return lambda speed, place, time: CHANGE * (1.0 - math.exp(-(time + warmed) / WARMING)) * speed


def test_a_table_that_was_warm_already_is_judged_as_such() -> None:
    cold, warm = experiments(recording(Hidden(law=after(0.0))), recording(Hidden(law=after(3.0)), seed=2), effects=[ViscousWarmUp])
    (candidate,) = cold.candidates
    start = np.array([CHANGE if name.endswith("change") else WARMING for name in candidate.parameters])
    fitted = fit(cold.sensed, [*baseline(cold), *candidate_free(study(cold, warm), candidate, start)])
    judged = transferred(warm, fitted, [candidate])
    assert candidate.remembered == (f"{candidate.part}.warmed_before",)
    assert judged.by_name[candidate.remembered[0]] == pytest.approx(3.0, rel=0.25)
    as_if_cold = fit(warm.sensed, warm.start_states(warm.sensed.plan), {**fitted.by_name, candidate.remembered[0]: 0.0})
    assert np.std(judged.residual) < 0.3 * np.std(as_if_cold.residual)


def test_the_time_before_a_recording_goes_back_a_hundred_times_as_long_as_it_lasts() -> None:
    experiment, _ = experiments(recording(), recording(seed=2), effects=[ViscousWarmUp])
    before = begun_anew(experiment, experiment.candidates)[-1]
    assert (before.start, before.low) == (0.0, 0.0)
    assert before.high == pytest.approx(100.0 * len(experiment.record) * PERIOD)
