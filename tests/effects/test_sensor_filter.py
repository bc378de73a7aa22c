"""The filter of a sensor: exact for what is straight between samples, without a delay of its own."""

from __future__ import annotations

import math

import pytest

from lathesim.effects.sensor_errors import SensorFilter

PERIOD = 1e-3


def filtered(signal: list[float], time_constant: float, stages: float = 1.0, held: float = 0.0) -> list[float]:
    """Return what comes out of the filter at each sample."""
    first = second = third = fourth = before = 0.0
    found = []
    for place, incoming in enumerate(signal):
        first, second, third, fourth, before = SensorFilter.update(
            incoming, first, second, third, fourth, before, time_constant, stages, held, PERIOD, place * PERIOD
        )
        found.append(SensorFilter.output(incoming, fourth, time_constant))
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


def test_it_begins_at_rest_on_the_first_sample() -> None:
    assert filtered([2.0, 2.0, 2.0], 5e-3) == [2.0, 2.0, 2.0]


def test_without_a_time_constant_nothing_is_filtered() -> None:
    signal = [0.0, 1.0, -1.0, 4.0]
    assert filtered(signal, 0.0) == signal


def test_a_signal_that_is_held_is_filtered_as_one() -> None:
    """Steps at the samples: 1 - exp(-t / T) from the sample on at which the signal jumped."""
    out = filtered([0.0, 1.0, 1.0, 1.0], 2e-3, held=1.0)
    assert out == pytest.approx([0.0, 0.0, 1.0 - math.exp(-0.5), 1.0 - math.exp(-1.0)])
