"""Where a machine part starts: as its recorded motion shows it, in its own unit or in that of its motor."""

import numpy as np
import pytest

from lathesim.component import Component, Output, State
from lathesim.components.axes import AnalyticalAxis, ForceAxis
from lathesim.engine.assembly import Part
from lathesim.identification.replay.initial_state import start_from

PLACE, SPEED = np.linspace(0.02, 0.05, 100), np.linspace(0.01, 0.03, 100)


def test_a_place_and_a_speed_start_as_they_were_recorded() -> None:
    part, motion = Part("x_axis", ForceAxis), {"x_axis.position": PLACE, "x_axis.velocity": SPEED}
    assert start_from(part, "travel", motion) == (0.02, pytest.approx(0.01 * np.std(PLACE), rel=1e-6))
    assert start_from(part, "speed", motion) == (0.01, pytest.approx(0.01 * np.std(SPEED), rel=1e-6))


def test_the_speed_of_a_table_tells_that_of_its_motor() -> None:
    """A lathe at rest was begun at 5 rad/s, which made up for a drift of the replay."""
    part = Part("x_axis", AnalyticalAxis, {"gear": 0.5, "lead": 8e-4})
    found = start_from(part, "motor_speed", {"x_axis.velocity": SPEED})
    assert found == (pytest.approx(0.01 / 4e-4), pytest.approx(0.01 * np.std(SPEED) / 4e-4, rel=1e-6))


def test_what_no_recorded_output_shows_is_not_told() -> None:
    assert start_from(Part("x_axis", AnalyticalAxis), "motor_speed", {"x_axis.position": PLACE}) is None
    assert start_from(Part("x_axis", AnalyticalAxis), "travel", {}) is None


class SoftTable(Component):
    """A table on a spring behind its motor: its speed tells neither that of the motor nor that of the spring."""

    ports = {"flow": "velocity"}
    motor_speed = State("rad/s", doc="speed of the motor")
    stretch_speed = State("rad/s", doc="speed of the spring")
    velocity = Output("m/s", doc="speed of the table")

    @staticmethod
    def derivative(motor_speed: float) -> tuple[float, float]:
        return -motor_speed, 0.0

    @staticmethod
    def output(motor_speed: float, stretch_speed: float) -> float:
        return 1e-3 * (motor_speed + stretch_speed)


def test_an_output_that_mixes_two_states_tells_neither() -> None:
    assert start_from(Part("table", SoftTable), "motor_speed", {"table.velocity": SPEED}) is None
