"""Kind 2 of the user-written parts: a spindle controller. PI with the voltage that the reference needs anyway."""

from __future__ import annotations

from lathesim.component import Component, DiscreteState, Input, Output, Parameter
from lathesim.hookspecs import hookimpl


class FeedforwardSpindleController(Component):
    """Gives the spindle's voltage:  V = w_r/K + Kp e + Ki sum(e T),  e = w_r - w.

    K is the speed per volt the drive is believed to have; what is believed wrongly is left to the integral, which stops while V is out of
    range and would be pushed further out. It takes the place of the spindle controller of a lathe.
    Source: K. J. Astrom, T. Hagglund, PID Controllers (1995), section 7.2. Left out: limits of the acceleration.
    """

    ports = {
        "measured": "measured",
        "drive": "reference",
        "reading": "voltage",
        "loop_gain": "proportional",
        "integral_gain": "integral",
        "error": "error",
    }

    reference = Input("rad/s", doc="reference spindle speed")
    measured = Input("rad/s", doc="measured spindle speed")

    speed_per_volt = Parameter("rad/(s*V)", 26.09, low=0.1, doc="believed spindle speed per volt")
    proportional = Parameter("V*s/rad", 0.08, low=0.0, doc="proportional gain")
    integral = Parameter("V/rad", 0.4, low=0.0, doc="integral gain")
    smallest_voltage = Parameter("V", -10.0, doc="lower end of the converter's range")
    largest_voltage = Parameter("V", 10.0, doc="upper end of the converter's range")

    held_voltage = DiscreteState("V", doc="voltage of this sample")
    held_error = DiscreteState("rad/s", doc="error of this sample")
    error_sum = DiscreteState("rad", doc="sum of errors times sample period")

    voltage = Output("V", doc="command voltage")
    error = Output("rad/s", doc="measured speed error")

    @staticmethod
    def update(
        reference: float,
        measured: float,
        speed_per_volt: float,
        proportional: float,
        integral: float,
        smallest_voltage: float,
        largest_voltage: float,
        error_sum: float,
        sample_period: float,
    ) -> tuple[float, float, float]:
        """One sample."""
        error = reference - measured
        total = error_sum + error * sample_period
        voltage = reference / speed_per_volt + proportional * error + integral * total
        if voltage > largest_voltage:
            return largest_voltage, error, total if error < 0.0 else error_sum
        if voltage < smallest_voltage:
            return smallest_voltage, error, total if error > 0.0 else error_sum
        return voltage, error, total

    @staticmethod
    def output(held_voltage: float, held_error: float) -> tuple[float, float]:
        """Hold over the sample."""
        return held_voltage, held_error


@hookimpl
def register_components() -> list[type[Component]]:
    """Hand the part to the simulator."""
    return [FeedforwardSpindleController]
