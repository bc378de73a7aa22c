"""What swings in a narrow band of frequencies and belongs to nothing of the machine is told, and nothing else is."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from scipy.signal import lfilter

from lathesim.diagnosis.location.narrow_band import band_strengths, in_octave, narrow_bands
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.noise.noise_model import NoiseModel
from lathesim.identification.records.fit import Fitted
from lathesim.identification.replay.experiment import Experiment
from tests.diagnosis.pushed_table import FORCE, PERIOD, Hidden, baseline, baselines, experiments, pair, recording

SQUEAL = Hidden(law=lambda v, q, t: 6.0 * math.sin(2.0 * math.pi * 55.0 * t) if 0.05 < abs(v) < 0.2 else 0.0)


def fitted_to(hidden: Hidden) -> tuple[Experiment, Fitted]:
    (experiment,) = experiments(recording(hidden, count=4000))
    return experiment, fit(experiment.sensed, baseline(experiment))


def test_a_squeal_is_told_with_its_frequency() -> None:
    (band,) = narrow_bands(*fitted_to(SQUEAL))
    assert band.channel == "x_encoder.position"
    assert band.frequency == pytest.approx(55.0, abs=1.0)
    assert band.share > 0.3
    assert "55" in str(band)
    assert " m (rms)" in str(band)
    assert 45.0 < band.low < 55.0 < band.high < 65.0


@pytest.mark.parametrize("hidden", [Hidden(), Hidden(dry=8.0)], ids=["sound", "dry friction"])
def test_the_rhythm_of_a_motion_is_no_squeal(hidden: Hidden) -> None:
    assert narrow_bands(*fitted_to(hidden)) == []


def test_a_short_recording_tells_nothing() -> None:
    (experiment,) = experiments(recording(SQUEAL, count=400))
    assert narrow_bands(experiment, fit(experiment.sensed, baseline(experiment))) == []


def test_noise_alone_has_no_bands() -> None:
    experiment, fitted = pair(Hidden())[0], baselines(Hidden())[0]
    noise = np.random.default_rng(3).standard_normal(fitted.residual.shape) * 1e-6
    assert narrow_bands(experiment, Fitted(**{**fitted.__dict__, "residual": noise})) == []


def residual_of(signal: np.ndarray) -> tuple[Experiment, Fitted]:
    """Return a rig, and a fit to it that leaves a signal with the sensor's white noise model."""
    experiment, fitted = pair(Hidden())[0], baselines(Hidden())[0]
    white = NoiseModel(np.full(experiment.sensed.samples // 2 + 1, 1e-12), experiment.sensed.samples)
    return experiment, Fitted(**{**fitted.__dict__, "residual": signal[None], "noise": (white,)})


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("corner", [15.0, 30.0, 60.0])
def test_noise_that_is_slow_is_no_swing(corner: float, seed: int) -> None:
    """Forces of a chip go up and down within some time; that makes a hump from zero on."""
    count = baselines(Hidden())[0].residual.shape[1]
    noise = np.random.default_rng(seed).standard_normal((2, count)) * 1e-6
    fading = math.exp(-2.0 * math.pi * corner * PERIOD)
    assert narrow_bands(*residual_of(noise[0] + 8.0 * np.asarray(lfilter([1.0 - fading], [1.0, -fading], noise[1])))) == []


def test_a_hum_that_drifts_is_told_with_where_it_begins_and_ends() -> None:
    count = baselines(Hidden())[0].residual.shape[1]
    time = np.arange(count) * PERIOD
    noise = 1e-6 * np.random.default_rng(3).standard_normal(count)
    (band,) = narrow_bands(*residual_of(noise + 5e-6 * np.sin(2.0 * math.pi * (40.0 + 5.0 * time) * time)))
    assert band.low == pytest.approx(40.0, abs=5.0)
    assert band.high == pytest.approx(80.0, abs=5.0)
    assert f"swings between {band.low:.3g} and {band.high:.3g} Hz" in str(band)


def taken_for_noise(hum: float) -> tuple[Experiment, Fitted]:
    """Return a rig and a fit that leaves white noise and a hum [Hz], which its noise model takes for noise of all frequencies near."""
    experiment, fitted = residual_of(np.zeros(baselines(Hidden())[0].residual.shape[1]))
    time = np.arange(experiment.sensed.samples) * PERIOD
    signal = 1e-6 * np.random.default_rng(3).standard_normal(len(time)) + 5.2e-6 * np.sin(2.0 * math.pi * hum * time)
    near = np.abs(np.arange(len(time) // 2 + 1) / (len(time) * PERIOD) - hum) < 35.0
    model = NoiseModel(np.where(near, 1e-10, 1e-12), experiment.sensed.samples)
    return experiment, Fitted(**{**fitted.__dict__, "residual": signal[None], "noise": (model,)})


def test_a_strong_hum_is_told_though_the_noise_model_has_it() -> None:
    experiment, fitted = taken_for_noise(40.0)
    (band,) = narrow_bands(experiment, fitted)
    assert band.frequency == pytest.approx(40.0, abs=0.5)
    assert band.share < 0.2


def test_what_the_machine_is_asked_to_do_is_no_hum() -> None:
    experiment, fitted = taken_for_noise(40.0)
    time = np.arange(experiment.sensed.samples) * PERIOD
    asked = experiment.record.with_channel(FORCE, "N", experiment.record[FORCE] + 5.0 * np.sin(2.0 * math.pi * 40.0 * time))
    assert narrow_bands(experiment, fitted) != []
    assert narrow_bands(dataclasses.replace(experiment, record=asked), fitted) == []


def test_a_staircase_that_is_climbed_steadily_is_no_hum() -> None:
    """Its counts come at one rate; the swing is smaller than what the sensor resolves."""
    experiment, fitted = residual_of(1e-9 * np.random.default_rng(3).standard_normal(baselines(Hidden())[0].residual.shape[1]))
    time = np.arange(experiment.sensed.samples) * PERIOD
    swings = fitted.residual + 0.1e-6 * np.sin(2.0 * math.pi * 40.0 * time)
    assert narrow_bands(experiment, Fitted(**{**fitted.__dict__, "residual": swings})) == []


def test_what_swings_stands_out_in_its_own_octave_alone() -> None:
    """A loop that swings at 56 Hz by itself says nothing of a squeal at 180 Hz."""
    seconds, samples = 8.0, 8000
    time = np.arange(samples) * seconds / samples
    noise = np.random.default_rng(2).standard_normal(samples)
    white = NoiseModel(np.ones(samples // 2 + 1), samples)
    swing = noise + 2.0 * np.sin(2.0 * np.pi * 180.0 * time)
    quiet, loud = (band_strengths("a", values, white, seconds) for values in (noise, swing))
    assert quiet.keys() == loud.keys()
    assert loud[in_octave("a", 180.0)] > 5.0 > 1.0 > max(quiet.values())
    others = {name: strength for name, strength in loud.items() if name != in_octave("a", 180.0)}
    assert max(others.values()) < 1.0
    assert in_octave("a", 130.0) == in_octave("a", 250.0) != in_octave("a", 260.0)
