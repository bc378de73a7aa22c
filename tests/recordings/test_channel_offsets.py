"""A shift in time is sought over half a period of the motion at most."""

from dataclasses import replace

import numpy as np
import pytest

from lathesim.recordings.channel_faults import motion_shift, shifted_channels
from lathesim.recordings.recorded_channel import RecordedChannel, pairs

SAMPLES = np.arange(4000.0)


@pytest.mark.parametrize("period", [20.5, 72.5, 190.5])
def test_a_period_of_a_sine_is_no_late_channel(period: float) -> None:
    """Half a sample late, it is a whole number of samples late a period later, and more like itself at that one."""

    def place(sample: np.ndarray) -> np.ndarray:
        return np.sin(2.0 * np.pi * sample / period)

    assert motion_shift(place(SAMPLES), place(SAMPLES - 2.5)) == pytest.approx(2.5, abs=0.1)


@pytest.mark.parametrize(("step", "noise", "told"), [(20.0 / 2**24, 0.0, False), (20.0 / 2**24, 2e-6, True), (0.0, 2e-6, True)])
def test_the_rounding_of_a_converter_is_no_noise_that_a_place_hands_on(step: float, noise: float, told: bool) -> None:
    """A smooth voltage behind a converter of 24 bits, 1.2 uV, was said to come 33 ms before its place, and nothing was named."""
    rng, time = np.random.default_rng(1), np.arange(6000) * 1e-3
    # ramps with rounded corners, as an interpolator with a limited acceleration makes them, and a command that follows their error
    speed = np.clip(np.cumsum(np.repeat(rng.choice((-1.0, 0.0, 1.0), 60), 100)) * 1e-3, -0.1, 0.1)
    place = np.cumsum(speed) * 1e-3 + noise * rng.standard_normal(len(time))
    wanted = np.roll(place, 40) if told else place
    voltage = 50.0 * np.gradient(np.cumsum(speed) * 1e-3, 1e-3) + 200.0 * (wanted if told else 0.0)
    voltage = np.round(voltage / step) * step if step else voltage
    channels = [RecordedChannel("x_encoder.position", "m", place, False), RecordedChannel("x_dac.voltage", "V", voltage, False)]
    found = [finding for finding in shifted_channels(channels, [], 1e-3) if "its noise comes" in finding.fact]
    assert bool(found) == told


def test_a_motion_that_does_not_repeat_may_be_late_by_more() -> None:
    rng = np.random.default_rng(2)
    walk = np.cumsum(np.convolve(rng.standard_normal(4000), np.ones(200) / 200, mode="same"))
    assert motion_shift(walk[100:], walk[:-100]) == pytest.approx(100.0, abs=0.5)


@pytest.mark.parametrize("strokes", [1, 12])
def test_a_speed_is_late_only_where_its_motion_shows_that(strokes: int) -> None:
    """An angle in whole degrees and a speed in turns a minute, 16 ms late. One start of a motor is as like itself 7 ms earlier or later."""
    period, late = 4e-3, 4
    time = np.arange(236 * strokes) * period
    wanted = np.repeat(np.random.default_rng(4).uniform(-13.0, 13.0, strokes), 236)
    wanted[:236] = 13.0
    speed = np.zeros(len(time))
    for now in range(len(time) - 1):
        speed[now + 1] = speed[now] + period / 0.08 * (wanted[now] - speed[now])
    angle = np.round(np.degrees(np.cumsum(speed) * period)) * np.pi / 180.0
    shown = np.round(np.concatenate([np.zeros(late), speed[:-late]]) / 0.105) * 0.105
    channels = [RecordedChannel("s_encoder.angle", "rad", angle, False), RecordedChannel("s_axis.speed", "rad/s", shown, False)]
    found = shifted_channels(channels, [replace(pair, correlation=1.0) for pair in pairs(channels, period)], period)
    assert [finding.kind for finding in found] == (["shift"] if strokes > 1 else [])
