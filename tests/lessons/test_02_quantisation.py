"""Lesson 2: limit cycles of coarse converters, its goals and golden channels."""

import numpy as np
import pytest

from tests.lessons.lesson_runs import Runs

STEP = 20.0 / 255.0
"""One step of the 8-bit converter [V]."""

GOALS = {
    "8_bits": "--",
    "10_bits": "--",
    "12_bits": "--",
    "gain": "--",
    "range": "--",
    "coarse_encoder": "--",
}
"""Case -> whether each goal is met (+) or missed (-), in the order of the lesson."""

AT = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 6.8)
GOLDEN = {
    "x_axis.position": (2e-06, (0.0160007, 0.0160003, 0.0160004, 0.0160008, 0.0160984, 0.0162974, 0.0164574)),
    "z_axis.position": (8e-06, (0.0109218, 0.0149218, 0.0189218, 0.0229218, 0.0269174, 0.0309095, 0.0341033)),
    "contour.contour_error": (3e-06, (-7e-07, -3e-07, -4e-07, -8e-07, -2.5e-06, -1.9e-06, -2.2e-06)),
    "x_dac.voltage": (0.0049, (-0.0024, 0.0024, 0.0024, -0.0024, 0.0122, 0.0122, 0.0122)),
    "z_dac.voltage": (0.0049, (0.2125, 0.2125, 0.2125, 0.2125, 0.2125, 0.2125, 0.2125)),
    "spindle.speed": (0.5, (104.85, 104.83, 104.54, 104.83, 104.85, 104.85, 104.85)),
}
"""Golden channels of case ``12_bits``: tolerance and values at the times of ``AT`` [SI]."""


@pytest.fixture(scope="module")
def runs() -> Runs:
    return Runs("02_quantisation")


def test_the_goals_and_the_golden_channels_are_as_stated(runs: Runs) -> None:
    runs.check_goals(GOALS)
    runs.check_golden(GOLDEN, AT, "12_bits")


def on_the_cylinder(runs: Runs, channel: str, variant: str) -> np.ndarray:
    """Return a channel between 2.5 s and 4 s, where the x axis should stand still."""
    return runs.record(variant)[channel][500:800]


def test_zero_is_not_a_level_and_the_voltage_never_rests(runs: Runs) -> None:
    voltage = on_the_cylinder(runs, "x_dac.voltage", "8_bits")
    assert set(np.round(np.abs(voltage), 9)) == {round(STEP / 2.0, 9)}
    assert np.count_nonzero(np.diff(voltage)) > 20


def test_the_axis_swings_and_goes_on_swinging(runs: Runs) -> None:
    position = on_the_cylinder(runs, "x_axis.position", "8_bits")
    early, late = np.ptp(position[:100]), np.ptp(position[-100:])
    assert early == pytest.approx(late, rel=0.3)
    assert 1e-6 < late < 2e-5


def test_smaller_steps_make_a_smaller_swing_and_a_higher_gain_does_not_calm_the_voltage(runs: Runs) -> None:
    swing = {variant: np.ptp(on_the_cylinder(runs, "x_axis.position", variant)) for variant in ("8_bits", "10_bits", "12_bits")}
    assert swing["12_bits"] < swing["10_bits"] < swing["8_bits"]
    assert runs.value("rms_contour_error", "gain") < 0.6 * runs.value("rms_contour_error", "8_bits")
    assert runs.value("x_voltage_unrest", "gain") == pytest.approx(runs.value("x_voltage_unrest", "8_bits"), rel=0.1)


def test_a_quarter_of_the_range_is_worth_two_bits_and_saturates_in_rapid_moves(runs: Runs) -> None:
    assert runs.value("rms_contour_error", "range") == pytest.approx(runs.value("rms_contour_error", "10_bits"), rel=0.2)
    assert runs.value("max_x_voltage", "range") == 2.5
    assert runs.value("max_x_voltage", "10_bits") > 3.0
