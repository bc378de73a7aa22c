"""Effects that make a signal late: a loop that lags, a command that is delayed, a filter of a sensor."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from lathesim.components.axes import ForceAxis
from lathesim.effects.lag import ServoLag
from lathesim.effects.sensor_errors import SensorFilter
from lathesim.effects.time_shift import TransportDelay
from lathesim.engine.assembly import Assembly, FloatArray, Part, Wire
from lathesim.engine.run import run
from lathesim.engine.wiring import wire
from lathesim.identification.replay.recorded_parts import HeldSignal
from lathesim.lessons.insertion import insert_effect
from lathesim.record import Record
from tests.effects.rigs import led_along, record, rig, with_effect

RATE = 2.0 * math.pi * 5.0
SPAN = 0.2


def loop(lag: float, velocity_lag: float, fine: float = 1e-5) -> tuple[FloatArray, FloatArray]:
    """Return place and speed, each 1 ms, of a loop  T_v dv/dt = (x_ref - x)/T - v  that is led to and fro, 2 mm each way, from rest on."""
    time = np.arange(round(SPAN / fine) + 1) * fine
    reference = 1e-3 * (1.0 - np.cos(RATE * time))
    place, speed = np.zeros(len(time)), np.zeros(len(time))
    for now in range(1, len(time)):
        wanted = (reference[now - 1] - place[now - 1]) / lag
        speed[now] = speed[now - 1] + fine * (wanted - speed[now - 1]) / velocity_lag if velocity_lag else wanted
        place[now] = place[now - 1] + fine * speed[now]
    each = round(1e-3 / fine)
    return place[::each], speed[::each]


@pytest.mark.parametrize("velocity_lag", [0.0, 1e-3, 2e-3, 12e-3], ids=["first order", "overdamped", "critical", "swinging"])
def test_a_table_follows_as_its_position_loop_lets_it(tmp_path: Path, velocity_lag: float) -> None:
    followed = record(with_effect(led_along(tmp_path, SPAN), "ServoLag", "x_axis", lag=8e-3, velocity_lag=velocity_lag), SPAN)
    place, speed = loop(8e-3, velocity_lag)
    # it begins in a steady acceleration, the loop here at rest: that has died out after some lags
    later = slice(120, None)
    # the lesson's samples are 10 ms, and the acceleration goes on between them
    assert followed["x_axis.position"][12:] == pytest.approx(place[::10][12:], abs=2e-5)
    assert np.ptp(place[later]) > 1e-3
    assert followed["x_axis.velocity"][12:] == pytest.approx(speed[::10][12:], abs=2e-3)


def test_the_current_is_late_with_the_motion(tmp_path: Path) -> None:
    plain, late = record(led_along(tmp_path), SPAN), record(with_effect(led_along(tmp_path), "ServoLag", "x_axis", lag=8e-3), SPAN)
    assert np.argmax(late["x_axis.current"][8:]) >= np.argmax(plain["x_axis.current"][8:])
    assert not np.allclose(late["x_axis.current"], plain["x_axis.current"], atol=1e-3)


def test_a_loop_that_settles_within_a_sample_stands_where_rest_is_asked_for(tmp_path: Path) -> None:
    """Sampled each 10 ms: a dry friction is not to push on a table that has come to rest."""
    velocity = np.where(np.arange(201) < 100, 0.02, 0.0)
    drive = {"x_axis.reference": np.cumsum(velocity) * 1e-3, "x_axis.reference_velocity": velocity, "x_axis.acceleration": np.zeros(201)}
    still = {
        lag: record(with_effect(rig("led_axis", tmp_path, drive), "ServoLag", "x_axis", lag=lag), SPAN)["x_axis.velocity"][11]
        for lag in (1e-3, 5e-3)
    }
    assert still[1e-3] == 0.0
    assert still[5e-3] > 0.0


def test_it_says_what_else_a_late_position_may_be() -> None:
    assert any("current is in time" in other for other in ServoLag.confused_with)


MASS, PERIOD, SAMPLES = 2.0, 1e-3, 40
FORCES = np.random.default_rng(4).normal(size=SAMPLES)


def pushed(delay: float, steps: int) -> Record:
    """Return the run of a mass without friction, pushed by forces that are held over a sample and come late."""
    push = Part("push", HeldSignal.with_units({"signal": "N"}), tables={"recorded": FORCES.reshape(-1, 1)})
    parts = (push, Part("x_axis", ForceAxis, {"mass": MASS, "viscous": 0.0}))
    channels = ("late.outgoing", "x_axis.velocity")
    bare = Assembly(parts, (Wire("x_axis.force", "push.value"),), PERIOD, PERIOD / steps, record=channels)
    return run(
        wire(insert_effect(bare, TransportDelay, "x_axis", name="late", parameters={"delay": delay})), duration=(SAMPLES - 1) * PERIOD
    )


def late(delay: float, time: np.ndarray) -> np.ndarray:
    """Return the force that acts at some times: what was held then, so long ago."""
    place = np.floor((time - delay) / PERIOD + 1e-9).astype(int)
    return FORCES[np.maximum(place, 0)]


@pytest.mark.parametrize("steps", [1, 2, 4])
@pytest.mark.parametrize("delay", [0.05e-3, 0.25e-3, 0.731e-3, 1e-3, 2.5e-3, 3.98e-3])
def test_what_acts_at_a_sample_and_the_impulse_between_samples_are_right(delay: float, steps: int) -> None:
    found = pushed(delay, steps)
    assert found["late.outgoing"] == pytest.approx(late(delay, found.time), abs=1e-12)
    fine = np.arange(0.0, found.time[-1], PERIOD / 1000) + PERIOD / 2000
    impulse = np.concatenate([[0.0], np.cumsum(late(delay, fine).reshape(-1, 1000).mean(axis=1)) * PERIOD])
    assert found["x_axis.velocity"] == pytest.approx(impulse / MASS, abs=2e-6)


def filtered(signal: list[float], time_constant: float, stages: float = 1.0, held: float = 0.0, falls: float = 0.0) -> list[float]:
    """Return what comes out of the filter at each sample; what jumps at a sample falls by a share of itself until the next one."""
    state = (0.0,) * 6
    found = []
    for place, incoming in enumerate(signal):
        *stages_before, before, summed_before = state
        summed = summed_before + before * (1.0 - 0.5 * falls) * PERIOD if place else 0.0
        state = SensorFilter.update(
            incoming, *stages_before, before, summed, summed_before, time_constant, stages, held, PERIOD, place * PERIOD
        )
        found.append(SensorFilter.output(incoming, state[3], time_constant))
    return found


@pytest.mark.parametrize("stages", [1.0, 2.0, 2.3, 4.0])
@pytest.mark.parametrize("time_constant", [0.2e-3, 1e-3, 9e-3])
def test_a_ramp_comes_out_late_by_the_time_constants(time_constant: float, stages: float) -> None:
    ramp = [3.0 * place * PERIOD for place in range(400)]
    late = filtered(ramp, time_constant, stages)
    assert late[-1] == pytest.approx(ramp[-1] - 3.0 * stages * time_constant, rel=1e-9)


def test_a_sine_comes_out_as_the_differential_equation_has_it() -> None:
    """Far below the sample rate: amplitude and phase of 1 / (1 + j w T)."""
    time_constant, rate = 4e-3, 2.0 * math.pi * 10.0
    out = filtered([math.sin(rate * place * PERIOD) for place in range(1000)], time_constant)
    size, late = 1.0 / math.hypot(1.0, rate * time_constant), math.atan(rate * time_constant)
    for place in range(900, 1000):
        assert out[place] == pytest.approx(size * math.sin(rate * place * PERIOD - late), abs=5e-4)


def test_a_computed_filter_is_the_recursion_of_a_firmware() -> None:
    signal, share, expected = [0.0, 1.0, 4.0, -2.0, -2.0], 1.0 - math.exp(-PERIOD / 3e-3), [0.0]
    for reading in signal[1:]:
        expected.append(expected[-1] + share * (reading - expected[-1]))
    assert filtered(signal, 3e-3, held=-1.0) == pytest.approx(expected, rel=1e-12)


def test_it_begins_at_rest_on_the_first_sample() -> None:
    assert filtered([2.0, 2.0, 2.0], 5e-3) == [2.0, 2.0, 2.0]


def test_without_a_time_constant_nothing_is_filtered() -> None:
    signal = [0.0, 1.0, -1.0, 4.0]
    assert filtered(signal, 0.0) == signal


def test_a_signal_that_is_held_is_filtered_as_one() -> None:
    """Steps at the samples: 1 - exp(-t / T) from the sample on at which the signal jumped."""
    out = filtered([0.0, 1.0, 1.0, 1.0], 2e-3, held=1.0)
    assert out == pytest.approx([0.0, 0.0, 1.0 - math.exp(-0.5), 1.0 - math.exp(-1.0)])


def test_a_signal_that_jumps_and_falls_until_the_next_sample_is_filtered_as_one() -> None:
    """As the current of a voltage drive does while its motor gains speed; integrated in a thousand steps a sample."""
    time_constant, falls, slow, expected = 2e-3, 0.4, 0.0, [0.0, 0.0]
    signal = [0.0, 1.0, 2.0, -1.0, 0.5]
    for jumped in signal[1:-1]:
        for step in range(1000):
            slow += PERIOD / 1000 / time_constant * (jumped * (1.0 - falls * (step + 0.5) / 1000) - slow)
        expected.append(slow)
    assert filtered(signal, time_constant, held=1.0, falls=falls) == pytest.approx(expected, abs=2e-4)
