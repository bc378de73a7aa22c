"""A position controller that is told where the axis is going: velocity, acceleration and friction fed forward."""

from __future__ import annotations

from lathesim.component import Component, DiscreteState, Input, Output, Parameter

MEASURE_FROM_REFERENCE = 1.0e300
"""Value of an input that means "nothing is wired here": the rate is then taken from the reference itself."""


class FeedforwardController(Component):
    """Gives the voltage of an axis, once a sample:  V = Kp e + Ki sum(e T) + Kd de/dt + Kv r' + Ka r'' + Kf sgn(r') + u_c.

    e = reference - measured; r' and r'' are wired, or else the backward differences of the reference. For an axis
    tau dv/dt + v = K V the velocity and acceleration that it needs are Kv = 1/K and Ka = tau/K. The friction term rises linearly up to
    ``friction_speed``. V is kept within the converter's range, and the integral stops while it is not.

    Source: M. Tomizuka, Zero Phase Error Tracking Algorithm, J. Dyn. Syst. Meas. Control 109 (1987), introduction; Y. Altintas,
    Manufacturing Automation, 2nd ed. 2012, chapter 5. Left out: a filter on the derivative.
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
    reference_velocity = Input("m/s", default=MEASURE_FROM_REFERENCE, doc="reference velocity", shown=False)
    reference_acceleration = Input("m/s^2", default=MEASURE_FROM_REFERENCE, doc="reference acceleration", shown=False)
    correction = Input("V", default=0.0, doc="voltage added by a contour controller, before saturation")

    proportional = Parameter("V/m", 224.5, doc="proportional gain")
    integral = Parameter("V/(m*s)", 0.0, doc="integral gain")
    derivative_gain = Parameter("V*s/m", 0.0, doc="derivative gain")
    velocity_feedforward = Parameter("V*s/m", 0.0, doc="voltage per reference velocity")
    acceleration_feedforward = Parameter("V*s^2/m", 0.0, doc="voltage per reference acceleration")
    friction_feedforward = Parameter("V", 0.0, doc="voltage in the direction of the reference velocity")
    friction_speed = Parameter("m/s", 1e-6, low=1e-9, doc="reference speed up to which it rises")
    smallest_voltage = Parameter("V", -10.0, doc="lower end of the converter's range")
    largest_voltage = Parameter("V", 10.0, doc="upper end of the converter's range")

    held_voltage = DiscreteState("V", doc="voltage of this sample")
    held_error = DiscreteState("m", doc="error of this sample")
    error_sum = DiscreteState("m*s", doc="sum of errors times sample period")
    held_reference = DiscreteState("m", doc="reference of this sample")
    held_rate = DiscreteState("m/s", doc="reference velocity of this sample")
    samples = DiscreteState("1", doc="samples so far, at most two")

    voltage = Output("V", doc="command voltage")
    error = Output("m", doc="measured position error")

    @staticmethod
    def update(
        reference: float,
        measured: float,
        reference_velocity: float,
        reference_acceleration: float,
        correction: float,
        proportional: float,
        integral: float,
        derivative_gain: float,
        velocity_feedforward: float,
        acceleration_feedforward: float,
        friction_feedforward: float,
        friction_speed: float,
        smallest_voltage: float,
        largest_voltage: float,
        held_error: float,
        error_sum: float,
        held_reference: float,
        held_rate: float,
        samples: float,
        sample_period: float,
    ) -> tuple[float, float, float, float, float, float]:
        """The PID law and what is fed forward."""
        error = reference - measured
        slope = (error - held_error) / sample_period if samples > 0.5 else 0.0
        rate = reference_velocity
        if rate >= MEASURE_FROM_REFERENCE:
            rate = (reference - held_reference) / sample_period if samples > 0.5 else 0.0
        change = reference_acceleration
        if change >= MEASURE_FROM_REFERENCE:
            change = (rate - held_rate) / sample_period if samples > 1.5 else 0.0
        direction = rate / friction_speed
        if direction > 1.0:
            direction = 1.0
        if direction < -1.0:
            direction = -1.0
        ahead = velocity_feedforward * rate + acceleration_feedforward * change + friction_feedforward * direction + correction
        total = error_sum + error * sample_period
        voltage = proportional * error + integral * total + derivative_gain * slope + ahead
        growth = integral * error
        if (voltage > largest_voltage and growth > 0.0) or (voltage < smallest_voltage and growth < 0.0):
            total = error_sum
            voltage = proportional * error + integral * total + derivative_gain * slope + ahead
        if voltage > largest_voltage:
            voltage = largest_voltage
        if voltage < smallest_voltage:
            voltage = smallest_voltage
        return voltage, error, total, reference, rate, samples + 1.0 if samples < 1.5 else 2.0

    @staticmethod
    def output(held_voltage: float, held_error: float) -> tuple[float, float]:
        """What was computed at the last sample."""
        return held_voltage, held_error
