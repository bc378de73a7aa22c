"""The noise of a residual: known shapes, sizes from the residual, and numbers of variance one after whitening."""

from typing import Any

import numpy as np
import pytest

from lathesim.engine.assembly import FloatArray
from lathesim.identification import noise as noise_model
from lathesim.identification.noise import (
    NoiseShapes,
    carried_over,
    differences,
    effective_share,
    fit_noise_model,
    noise_shapes,
    output_error,
    spectrum,
    taper,
    white_noise,
)
from lathesim.identification.signal import channel_floor

SAMPLES, PERIOD = 4000, 2e-3
NO_KICK = np.zeros((1, SAMPLES))
FADING = float(np.exp(-PERIOD / 0.2))
MASS_KICK = (0.2 * (1.0 - FADING ** np.arange(SAMPLES)))[None, :]
"""Response of the place of a braked mass to a kick of its speed: it comes to rest within a fifth of a second or so."""


def shaped(impulse_responses: FloatArray, motion: FloatArray, floor: float, period: float, **kinds: Any) -> NoiseShapes:
    """Return the shapes of a channel that is differenced as often as suits its response."""
    return noise_shapes(impulse_responses, motion, floor, period, differences(impulse_responses, period), **kinds)


def white(size: float, seed: int = 0) -> FloatArray:
    return np.asarray(size * np.random.default_rng(seed).standard_normal(SAMPLES))


def wandering(size: float, seed: int = 0) -> FloatArray:
    """The place of the braked mass when white forces push it."""
    return np.asarray(np.convolve(white(size, seed) * PERIOD, MASS_KICK[0])[:SAMPLES])


def test_white_noise_is_found_with_its_size() -> None:
    shapes = shaped(NO_KICK, NO_KICK[0], 1e-9, PERIOD, coloured=False)
    model = fit_noise_model(white(2e-6), shapes)
    assert np.sqrt(np.mean(model.power)) == pytest.approx(2e-6, rel=0.05)


def test_white_noise_beyond_the_floor_is_told_from_a_line() -> None:
    shapes = shaped(NO_KICK, NO_KICK[0], 1e-6, PERIOD, coloured=False)
    line = 1e-4 * np.sin(2.0 * np.pi * 7.0 * PERIOD * np.arange(SAMPLES))
    assert white_noise(white(3e-6) + line, shapes) == pytest.approx(8e-12, rel=0.1)
    assert white_noise(white(0.5e-6), shapes) == 0.0


def test_counts_that_were_differenced_hide_little_of_what_is_slow() -> None:
    """The rate of an encoder is as rough as its counts allow, and a slow error far below that shows all the same."""
    rate = np.diff(white(1e-6), prepend=0.0)
    floor = channel_floor(rate)
    wave = 0.1 * floor * np.sin(2.0 * np.pi * 0.5 * PERIOD * np.arange(SAMPLES))
    for sensor, hidden in ((noise_model.WHITE, True), (noise_model.DIFFERENCED, False)):
        shapes = shaped(NO_KICK, NO_KICK[0], floor, PERIOD, coloured=False, sensor=sensor)
        power = fit_noise_model(rate, shapes).power
        found = float(np.max(np.abs(spectrum(rate + wave)) ** 2 / power))
        assert (found < 20.0) == hidden


def test_noise_is_never_smaller_than_the_floor() -> None:
    shapes = shaped(NO_KICK, NO_KICK[0], 1e-6, PERIOD, coloured=True)
    model = fit_noise_model(white(1e-9), shapes)
    assert np.min(model.power) >= 1e-12
    assert np.sqrt(np.mean(model.power)) == pytest.approx(1e-6, rel=0.01)


def test_a_load_that_is_slow_is_told_from_a_white_one_and_a_zero_that_drifts_from_noise() -> None:
    """A load of 3 Hz on a mass; the sensor's noise stays white, however slow the residual of a channel is that no state moves."""
    load, rate, place = np.zeros(SAMPLES), 0.0, np.zeros(SAMPLES)
    pushes = white(1.0, 1)
    for now in range(1, SAMPLES):
        load[now] = load[now - 1] * np.exp(-2.0 * np.pi * 3.0 * PERIOD) + pushes[now]
        rate += load[now] * PERIOD
        place[now] = place[now - 1] + rate * PERIOD
    residual = 1e-4 * place + white(1e-7)
    plain, slow = (shaped(MASS_KICK, MASS_KICK[0] ** 2, 1e-9, PERIOD, coloured=coloured) for coloured in (False, True))
    as_white, as_slow = (fit_noise_model(residual, shapes).log_likelihood(residual) for shapes in (plain, slow))
    assert as_slow > as_white + 100.0
    assert len(shaped(NO_KICK, NO_KICK[0], 1e-9, PERIOD, coloured=True).shapes) == 1


def test_forces_on_the_machine_are_told_from_noise_of_the_sensor() -> None:
    shapes = shaped(MASS_KICK, MASS_KICK[0] ** 2, 1e-9, PERIOD, coloured=False)
    quiet, pushed = (fit_noise_model(residual, shapes) for residual in (white(2e-6), white(2e-6) + wandering(0.5)))
    assert quiet.sizes is not None
    assert pushed.sizes is not None
    assert pushed.sizes[-1] > 1e3 * quiet.sizes[-1]


@pytest.mark.parametrize("seed", range(3))
def test_whitened_noise_has_variance_one(seed: int) -> None:
    shapes = shaped(MASS_KICK, MASS_KICK[0] ** 2, 1e-7, PERIOD, coloured=True)
    residual = white(2e-6, seed) + wandering(0.5, seed + 10)
    model = fit_noise_model(residual, shapes)
    whitened = model.whiten(residual, full_band=True)
    # the taper makes neighbours alike: the sum of squares counts the independent ones
    assert np.mean(whitened**2) / effective_share(SAMPLES) == pytest.approx(1.0, abs=0.1)
    other = model.whiten(white(2e-6, seed + 100) + wandering(0.5, seed + 110), full_band=True)
    assert np.mean(other**2) / effective_share(SAMPLES) == pytest.approx(1.0, abs=0.15)


def test_only_the_band_of_the_motion_counts_unless_asked_otherwise() -> None:
    time = np.arange(SAMPLES) * PERIOD
    motion = 0.05 * np.sin(2.0 * np.pi * 2.0 * time)
    shapes = shaped(MASS_KICK, motion, 1e-7, PERIOD, coloured=False)
    frequencies = np.arange(SAMPLES // 2 + 1) / (SAMPLES * PERIOD)
    assert 2.0 < frequencies[shapes.band] < 4.0
    model = fit_noise_model(white(2e-6), shapes)
    kept = model.whiten(white(2e-6))
    assert np.count_nonzero(kept) <= 2 * shapes.band
    assert np.count_nonzero(model.whiten(white(2e-6), full_band=True)) > 0.9 * len(kept)


DIFFERENCED = shaped(np.gradient(MASS_KICK, axis=1), MASS_KICK[0], 1e-9, PERIOD, coloured=False)
"""A channel that is held against forces by its differences, and shows more of its sensor than of them."""


def test_a_constant_counts_where_the_differences_do_not_show_it() -> None:
    assert DIFFERENCED.differences > 0
    model = fit_noise_model(white(2e-6), DIFFERENCED)
    off = white(2e-6) + 1e-6
    spread = 2e-6 / np.sqrt(SAMPLES)
    told = model.log_likelihood(white(2e-6)) - model.log_likelihood(off)
    # less than of white noise that is counted in full: the taper, and what forces may do there
    assert 0.5 < told / (0.5 * (1e-6 / spread) ** 2) < 1.1
    power = float(np.sum(model.whiten(off, full_band=True) ** 2) - np.sum(model.whiten(white(2e-6), full_band=True) ** 2))
    assert power == pytest.approx(2.0 * told, rel=0.01)


def test_a_constant_tells_nothing_where_forces_make_a_channel_wander() -> None:
    shapes = shaped(MASS_KICK, MASS_KICK[0] ** 2, 1e-9, PERIOD, coloured=False)
    model = fit_noise_model(white(1e-9) + wandering(0.5), shapes)
    assert shapes.differences > 0
    assert model.mean_spread == np.inf
    assert model.log_likelihood(wandering(0.5)) == pytest.approx(model.log_likelihood(wandering(0.5) + 1.0), rel=1e-9)


def test_a_response_that_is_nothing_at_some_frequency_has_no_say_there() -> None:
    """A jolt forth and back has no mean."""
    jolt = np.zeros_like(NO_KICK)
    jolt[0, :2] = 1.0, -1.0
    shapes = shaped(jolt, jolt[0], 1e-9, PERIOD, coloured=False)
    assert shapes.differences == 0
    assert np.isfinite(shapes.shapes).all()


def test_the_likelihood_is_greatest_at_the_size_that_is_there() -> None:
    shapes = shaped(NO_KICK, NO_KICK[0], 1e-9, PERIOD, coloured=False)
    residual = white(2e-6)
    sizes = [0.5e-6, 1e-6, 2e-6, 4e-6, 8e-6]
    likelihoods = [fit_noise_model(white(size, 5), shapes).log_likelihood(residual) for size in sizes]
    assert int(np.argmax(likelihoods)) == 2


def test_the_noise_of_another_machine_keeps_sensor_and_forces() -> None:
    shapes = shaped(MASS_KICK, MASS_KICK[0] ** 2, 1e-9, PERIOD, coloured=False)
    heavier = shaped(0.5 * MASS_KICK, MASS_KICK[0] ** 2, 1e-9, PERIOD, coloured=False)
    model = fit_noise_model(white(1e-9) + wandering(0.5), shapes)
    moved = carried_over(model, heavier)
    assert moved.sizes is model.sizes
    middle = slice(10, 200)
    assert moved.power[middle] == pytest.approx(0.25 * model.power[middle], rel=0.05)


def test_the_taper_keeps_the_power_of_noise() -> None:
    assert np.mean(taper(SAMPLES) ** 2) == pytest.approx(1.0)
    assert 0.85 < effective_share(SAMPLES) < 1.0
    power = np.abs(spectrum(white(3.0))) ** 2
    assert power.mean() == pytest.approx(9.0, rel=0.06)


def test_the_error_of_a_simulation_counts_alike_within_the_band_of_the_motion_and_nowhere_else() -> None:
    time = PERIOD * np.arange(SAMPLES)
    motion = np.sin(2.0 * np.pi * 3.0 * time)
    model = fit_noise_model(0.1 * motion + white(1e-3), output_error(motion, 1e-6, 1, None))
    counted = model.bins(full_band=True)
    assert 3.0 < counted / (SAMPLES * PERIOD) < 6.0
    assert np.ptp(model.power) == 0.0
    assert not model.gain[counted:].any()
    beyond = model.whiten(np.sin(2.0 * np.pi * 60.0 * time), full_band=True)
    assert np.abs(beyond).max() < 1e-2 * np.abs(model.whiten(0.1 * motion, full_band=True)).max()
