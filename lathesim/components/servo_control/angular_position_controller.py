"""The position controller of a rotary axis: PID with a filtered derivative, saturated at the converter's range."""

from __future__ import annotations

from lathesim.component import Component, DiscreteState, Input, Output, Parameter


class AngularPositionController(Component):
    """Gives the voltage of a rotary axis from its error, once a sample:  V = Kp e + Ki sum(e T) + Kd d.

        d = (Tf d_before + e - e_before)/(Tf + T),   e = reference - measured

    d is the slope of the error, filtered with a lag of Tf; with Tf = 0 it is the slope over the last sample. V is limited to the range of
    the converter. While it is limited, the integral leaves out errors that would push it further out (conditional integration).

    Source: K. J. Astrom, T. Hagglund, PID Controllers (1995), sections 3.4 (filtered derivative, backward difference) and 3.5; the gain is
    assumed. Left out: feed forward, weights of the reference.
    """

    group = "controllers"

    ports = {
        "measured": "measured",
        "drive": "reference",
        "reading": "voltage",
        "loop_gain": "proportional",
        "integral_gain": "integral",
        "error": "error",
    }

    reference = Input("rad", doc="reference angle")
    measured = Input("rad", doc="measured angle")

    proportional = Parameter("V/rad", 10.0, doc="proportional gain")
    integral = Parameter("V/(rad*s)", 0.0, doc="integral gain")
    derivative_gain = Parameter("V*s/rad", 0.0, doc="derivative gain")
    derivative_filter = Parameter("s", 0.0, low=0.0, doc="lag of the derivative")
    smallest_voltage = Parameter("V", -10.0, doc="lower end of the converter's range")
    largest_voltage = Parameter("V", 10.0, doc="upper end of the converter's range")

    held_voltage = DiscreteState("V", doc="voltage of this sample")
    held_error = DiscreteState("rad", doc="error of this sample")
    error_sum = DiscreteState("rad*s", doc="sum of errors times sample period")
    slope = DiscreteState("rad/s", doc="filtered slope of the error")
    started = DiscreteState("1", doc="1 after the first sample")

    voltage = Output("V", doc="command voltage")
    error = Output("rad", doc="measured error")

    @staticmethod
    def update(
        reference: float,
        measured: float,
        proportional: float,
        integral: float,
        derivative_gain: float,
        derivative_filter: float,
        smallest_voltage: float,
        largest_voltage: float,
        held_error: float,
        error_sum: float,
        slope: float,
        started: float,
        sample_period: float,
    ) -> tuple[float, float, float, float, float]:
        """The law in discrete time, with conditional integration."""
        error = reference - measured
        change = error - held_error if started > 0.5 else 0.0
        filtered = (derivative_filter * slope + change) / (derivative_filter + sample_period)
        total = error_sum + error * sample_period
        voltage = proportional * error + integral * total + derivative_gain * filtered
        growth = integral * error
        if (voltage > largest_voltage and growth > 0.0) or (voltage < smallest_voltage and growth < 0.0):
            total = error_sum
            voltage = proportional * error + integral * total + derivative_gain * filtered
        if voltage > largest_voltage:
            voltage = largest_voltage
        if voltage < smallest_voltage:
            voltage = smallest_voltage
        return voltage, error, total, filtered, 1.0

    @staticmethod
    def output(held_voltage: float, held_error: float) -> tuple[float, float]:
        """Return the voltage and the error of the last sample."""
        return held_voltage, held_error
