"""The one measure: an explanation gains where it predicts better, and how sure that is follows from blocks."""

from __future__ import annotations

import numpy as np

from lathesim.diagnosis.explaining.chance import due, is_clear
from lathesim.diagnosis.explaining.density import Gain, gain
from lathesim.diagnosis.method import STANDARD
from lathesim.identification.noise import NoiseShapes, fit_noise_model
from lathesim.identification.records import Fitted

SAMPLES = 4800


def left(residual: np.ndarray) -> Fitted:
    """Return a fit that leaves a residual, with white noise."""
    shapes = NoiseShapes(np.ones((1, SAMPLES // 2 + 1)), 1e-9, SAMPLES)
    none = np.zeros(0)
    return Fitted((), none, np.zeros((0, 0)), residual[None], (fit_noise_model(residual, shapes),), 0.0, 0.0)


def noise(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(SAMPLES)


def test_half_the_error_gains_the_logarithm_of_two_for_each_independent_sample() -> None:
    half, whole = left(noise(1)), left(2.0 * noise(1))
    found = gain(half, whole, full_band=True)
    independent = SAMPLES * half.noise[0].share
    assert abs(found.nats - independent * np.log(2.0)) < 0.01 * found.nats
    assert abs(found.share - 0.75) < 0.01
    assert abs(gain(whole, half, full_band=True).nats + found.nats) < 1e-6 * found.nats


def test_other_noise_of_the_same_size_is_no_clear_gain() -> None:
    found = [gain(left(noise(seed)), left(noise(seed + 100)), full_band=True) for seed in range(20)]
    assert not any(is_clear(one, STANDARD) for one in found)
    assert np.std([one.nats / one.error for one in found]) < 2.0


def test_what_happens_once_and_neither_explains_counts_little() -> None:
    jump = np.zeros(SAMPLES)
    jump[1000:1010] = 1000.0
    quiet = gain(left(noise(1)), left(1.2 * noise(1)), full_band=True)
    loud = gain(left(noise(1) + jump), left(1.2 * noise(1) + jump), full_band=True)
    assert 0.5 * quiet.nats < loud.nats < quiet.nats


def test_what_acts_in_a_short_part_of_a_recording_is_as_sure_as_what_acts_all_the_time() -> None:
    once, always = np.zeros(SAMPLES), np.sin(np.arange(SAMPLES) / 50.0)
    once[2000:2100] = np.sqrt(0.5 * SAMPLES / 100.0) * np.exp(-np.arange(100) / 30.0)
    found = [gain(left(noise(1)), left(noise(1) + acting), full_band=True) for acting in (once, always)]
    assert all(is_clear(one, STANDARD) for one in found)
    assert found[0].nats > 10.0 * found[0].error


def test_readings_that_agree_by_chance_at_a_standstill_make_no_gain() -> None:
    standing = noise(1)
    standing[2400:] = 0.0
    shapes = NoiseShapes(np.ones((1, SAMPLES // 2 + 1)), 1.0, SAMPLES)
    none = np.zeros(0)
    close, closer = (
        Fitted((), none, np.zeros((0, 0)), (standing + level)[None], (fit_noise_model(standing + level, shapes),), 0.0, 0.0)
        for level in (1e-3, 1e-6)
    )
    assert abs(gain(closer, close, full_band=True).nats) < 1.0


def test_what_was_fitted_to_noise_is_no_gain_on_other_noise() -> None:
    shapes = np.cos(np.outer(np.arange(1, 9), np.arange(SAMPLES)) * np.pi / SAMPLES)
    found = []
    for seed in range(20):
        fitted = np.linalg.lstsq(shapes.T, noise(seed), rcond=None)[0] @ shapes
        found.append(gain(left(noise(seed + 100) - fitted), left(noise(seed + 100)), full_band=True))
    assert not any(is_clear(one, STANDARD) for one in found)


def test_a_gain_has_to_pay_for_its_values_and_be_above_its_error() -> None:
    assert due(STANDARD, 2) > due(STANDARD, 1) > due(STANDARD)
    assert is_clear(Gain(100.0, 10.0), STANDARD, 2)
    assert not is_clear(Gain(100.0, 50.0), STANDARD, 2)
    assert not is_clear(Gain(12.0, 1.0), STANDARD, 2)
