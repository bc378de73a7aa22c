"""The position controller of an axis: PID, saturated at the converter's range."""

from __future__ import annotations

from lathesim.component import Component, DiscreteState, Input, Output, Parameter


class PositionController(Component):
    """Gives the voltage of an axis from its position error, once a sample:  V = Kp e + Ki sum(e T) + Kd (e - e_before)/T + u_c.

    e = reference - measured; u_c is the offset of a cross-coupling controller. V is kept within the range of the D/A converter, and while
    it is not, a sample that would push it further out is not added to the integral (conditional integration). The error that is
    recorded is the one of this sample, before the axis moves.

    Source: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004), equation (5) and section Axes; Kp fitted to its Table 1. Conditional
    integration: K. J. Astrom, T. Hagglund, PID Controllers (1995), section 3.5. Left out: a filter on the derivative, feed forward.
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

    reference = Input("m", doc="reference position")
    measured = Input("m", doc="measured position")
    correction = Input("V", default=0.0, doc="voltage added by a cross-coupling controller, before saturation")

    proportional = Parameter("V/m", 224.5, doc="proportional gain")
    integral = Parameter("V/(m*s)", 0.0, doc="integral gain")
    derivative_gain = Parameter("V*s/m", 0.0, doc="derivative gain")
    smallest_voltage = Parameter("V", -10.0, doc="lower end of the converter's range")
    largest_voltage = Parameter("V", 10.0, doc="upper end of the converter's range")

    held_voltage = DiscreteState("V", doc="voltage of this sample")
    held_error = DiscreteState("m", doc="error of this sample")
    error_sum = DiscreteState("m*s", doc="sum of errors times sample period")
    started = DiscreteState("1", doc="1 after the first sample")

    voltage = Output("V", doc="command voltage")
    error = Output("m", doc="measured position error")

    @staticmethod
    def update(
        reference: float,
        measured: float,
        correction: float,
        proportional: float,
        integral: float,
        derivative_gain: float,
        smallest_voltage: float,
        largest_voltage: float,
        held_error: float,
        error_sum: float,
        started: float,
        sample_period: float,
    ) -> tuple[float, float, float, float]:
        """Equation (5) in discrete time, with conditional integration."""
        error = reference - measured
        slope = (error - held_error) / sample_period if started > 0.5 else 0.0
        total = error_sum + error * sample_period
        voltage = proportional * error + integral * total + derivative_gain * slope + correction
        growth = integral * error
        if (voltage > largest_voltage and growth > 0.0) or (voltage < smallest_voltage and growth < 0.0):
            total = error_sum
            voltage = proportional * error + integral * total + derivative_gain * slope + correction
        if voltage > largest_voltage:
            voltage = largest_voltage
        if voltage < smallest_voltage:
            voltage = smallest_voltage
        return voltage, error, total, 1.0

    @staticmethod
    def output(held_voltage: float, held_error: float) -> tuple[float, float]:
        """What was computed at the last sample."""
        return held_voltage, held_error
