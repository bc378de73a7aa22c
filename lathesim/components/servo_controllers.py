"""Servo controllers: the loops of position and speed that drive one axis or the spindle."""

from __future__ import annotations

from typing import ClassVar

from lathesim.component import ON, Component, DiscreteState, Input, Output, Parameter
from lathesim.elementary import within


def limited_pid(
    of_error: float, of_slope: float, ahead: float, integral: float, error_sum: float, added: float, smallest: float, largest: float
) -> tuple[float, float]:
    """Return the voltage of a PID law between two limits, and the sum of errors times sample period, to which this sample's is ``added``.

    Error and slope have their gains already; ``ahead`` is what is fed forward. A sample that would push a voltage further beyond a limit is
    not added to the sum (conditional integration).
    """
    total = error_sum + added
    voltage = of_error + integral * total + of_slope + ahead
    growth = integral * added
    if (voltage > largest and growth > 0.0) or (voltage < smallest and growth < 0.0):
        total = error_sum
        voltage = of_error + integral * total + of_slope + ahead
    return within(voltage, smallest, largest), total


class HeldVoltage:
    """What the controllers share that give a voltage and their error once a sample; each declares its error, whose unit is its own."""

    ports: ClassVar[dict[str, str]] = {
        "measured": "measured", "drive": "reference", "reading": "voltage", "loop_gain": "proportional", "integral_gain": "integral",
        "error": "error",
    }  # fmt: skip

    held_voltage = DiscreteState("V", doc="voltage of this sample")

    voltage = Output("V", doc="command voltage")

    @staticmethod
    def output(held_voltage: float, held_error: float) -> tuple[float, float]:
        return held_voltage, held_error


class PositionController(HeldVoltage, Component):
    """Gives the voltage of an axis from its position error, once a sample:  V = Kp e + Ki sum(e T) + Kd d + u_c.

        d = (Tf d_before + e - e_before)/(Tf + T),   e = reference - measured

    d is the slope of the error, filtered with a lag of Tf; with Tf = 0 it is the slope over the last sample. u_c is the offset of a
    cross-coupling controller. V is kept within the range of the D/A converter, and while it is not, a sample that would push it further
    out is not added to the integral (conditional integration). The error that is recorded is the one of this sample, before the axis
    moves. A filter of unknown lag is a value like any other: uncertain: {x_controller.derivative_filter: 2 ms}.

    Source: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004), equation (5) and section Axes; Kp fitted to its Table 1. Filter and
    conditional integration: K. J. Astrom, T. Hagglund, PID Controllers (1995), sections 3.4 and 3.5. Left out: feed forward.
    """

    group = "controllers"

    reference = Input("m", doc="reference position")
    measured = Input("m", doc="measured position")
    correction = Input("V", default=0.0, doc="voltage added by a cross-coupling controller, before saturation")

    proportional = Parameter("V/m", 224.5, doc="proportional gain")
    integral = Parameter("V/(m*s)", 0.0, doc="integral gain")
    derivative_gain = Parameter("V*s/m", 0.0, doc="derivative gain")
    derivative_filter = Parameter("s", 0.0, low=0.0, doc="lag of the derivative")
    smallest_voltage = Parameter("V", -10.0, doc="lower end of the converter's range")
    largest_voltage = Parameter("V", 10.0, doc="upper end of the converter's range")

    held_error = DiscreteState("m", doc="error of this sample")
    error_sum = DiscreteState("m*s", doc="sum of errors times sample period")
    slope = DiscreteState("m/s", doc="filtered slope of the error")
    started = DiscreteState("1", doc="1 after the first sample")

    error = Output("m", doc="measured position error")

    @staticmethod
    def update(
        reference: float, measured: float, correction: float, proportional: float, integral: float, derivative_gain: float,
        derivative_filter: float, smallest_voltage: float, largest_voltage: float, held_error: float, error_sum: float, slope: float,
        started: float, sample_period: float,
    ) -> tuple[float, float, float, float, float]:  # fmt: skip
        """Equation (5) in discrete time, with conditional integration."""
        error = reference - measured
        change = error - held_error if started > ON else 0.0
        filtered = (derivative_filter * slope + change) / (derivative_filter + sample_period)
        voltage, total = limited_pid(
            proportional * error, derivative_gain * filtered, correction, integral, error_sum, error * sample_period, smallest_voltage,
            largest_voltage,
        )  # fmt: skip
        return voltage, error, total, filtered, 1.0


class AngularPositionController(HeldVoltage, Component):
    """Gives the voltage of a rotary axis from its error, once a sample:  V = Kp e + Ki sum(e T) + Kd d.

        d = (Tf d_before + e - e_before)/(Tf + T),   e = reference - measured

    d is the slope of the error, filtered with a lag of Tf; with Tf = 0 it is the slope over the last sample. V is limited to the range of
    the converter. While it is limited, the integral leaves out errors that would push it further out (conditional integration).

    Source: K. J. Astrom, T. Hagglund, PID Controllers (1995), sections 3.4 (filtered derivative, backward difference) and 3.5; the gain is
    assumed. Left out: feed forward, weights of the reference.
    """

    group = "controllers"

    reference = Input("rad", doc="reference angle")
    measured = Input("rad", doc="measured angle")

    proportional = Parameter("V/rad", 10.0, doc="proportional gain")
    integral = Parameter("V/(rad*s)", 0.0, doc="integral gain")
    derivative_gain = Parameter("V*s/rad", 0.0, doc="derivative gain")
    derivative_filter = Parameter("s", 0.0, low=0.0, doc="lag of the derivative")
    smallest_voltage = Parameter("V", -10.0, doc="lower end of the converter's range")
    largest_voltage = Parameter("V", 10.0, doc="upper end of the converter's range")

    held_error = DiscreteState("rad", doc="error of this sample")
    error_sum = DiscreteState("rad*s", doc="sum of errors times sample period")
    slope = DiscreteState("rad/s", doc="filtered slope of the error")
    started = DiscreteState("1", doc="1 after the first sample")

    error = Output("rad", doc="measured error")

    @staticmethod
    def update(
        reference: float, measured: float, proportional: float, integral: float, derivative_gain: float, derivative_filter: float,
        smallest_voltage: float, largest_voltage: float, held_error: float, error_sum: float, slope: float, started: float,
        sample_period: float,
    ) -> tuple[float, float, float, float, float]:  # fmt: skip
        """The law in discrete time, with conditional integration."""
        error = reference - measured
        change = error - held_error if started > ON else 0.0
        filtered = (derivative_filter * slope + change) / (derivative_filter + sample_period)
        voltage, total = limited_pid(
            proportional * error, derivative_gain * filtered, 0.0, integral, error_sum, error * sample_period, smallest_voltage,
            largest_voltage,
        )  # fmt: skip
        return voltage, error, total, filtered, 1.0


class SpindleController(PositionController):
    """Gives the voltage of the spindle from its speed error, once a sample:  V = Kp e + Ki sum(e T) + Kd d.

    The same law as PositionController, of speeds; its integral, too, stops at the ends of the converter's range. The gains are assumed:
    with the default spindle (26.1 rad/s/V, 0.21 s) the closed loop has its pole near 10 rad/s. Source: J. Liu,
    R. G. Landers, Int. J. Eng. Educ. 20 (2004), equation (5).
    """

    reference = Input("rad/s", doc="reference spindle speed")
    measured = Input("rad/s", doc="measured spindle speed")
    correction = Input("V", default=0.0, doc="voltage added before saturation")

    proportional = Parameter("V*s/rad", 0.08, doc="proportional gain")
    integral = Parameter("V/rad", 0.4, doc="integral gain")
    derivative_gain = Parameter("V*s^2/rad", 0.0, doc="derivative gain")
    derivative_filter = Parameter("s", 0.0, low=0.0, doc="lag of the derivative")
    smallest_voltage = Parameter("V", -10.0, doc="lower end of the converter's range")
    largest_voltage = Parameter("V", 10.0, doc="upper end of the converter's range")

    held_error = DiscreteState("rad/s", doc="error of this sample")
    error_sum = DiscreteState("rad", doc="sum of errors times sample period")
    slope = DiscreteState("rad/s^2", doc="filtered slope of the error")
    started = DiscreteState("1", doc="1 after the first sample")

    error = Output("rad/s", doc="measured speed error")


class CascadeController(Component):
    """Gives the drive command of a P position loop around a P or PI velocity loop, once a sample.

        w = kp (reference - measured),   u = kv (w - dq/dt) + kv/Ti integral (w - dq/dt),   |u| <= limit
        dq/dt = (f_k - f_{k-1})/T,   f_k = (1 - s) measured_k + s measured_{k-1}

    The speed is the backward difference of a two-point mean (s = 1/2), or of the measured position itself (s = 0). At the start the loop
    takes the axis to have been moving with ``start_speed``. The integral takes in the present sample, and stops while the command is at its
    limit.

    Source: A. Janot, M. Gautier, M. Brunot, Data Set and Reference Models of EMPS (2019), whose gains are the defaults and whose recorded
    command it gives to 0.24 % without the integral. Left out: feed-forward, notch filters.
    """

    group = "controllers"

    ports = {
        "measured": "measured",
        "drive": "reference",
        "reading": "voltage",
        "loop_gain": "position_gain",
        "inner_gain": "velocity_gain",
    }

    reference = Input("m", doc="commanded position")
    measured = Input("m", doc="measured position")

    position_gain = Parameter("1/s", 160.18, low=0.0, doc="kp: commanded speed per position error")
    velocity_gain = Parameter("V*s/m", 243.45, low=0.0, doc="kv: volts per speed error")
    integral_rate = Parameter("1/s", 0.0, low=0.0, doc="1/Ti of the velocity loop; 0 for a P loop")
    mean_share = Parameter("1", 0.5, low=0.0, high=1.0, doc="s: weight of the sample before in the position that is differentiated")
    limit = Parameter("V", 10.0, low=0.0, doc="largest command")
    start_speed = Parameter("m/s", 0.0, doc="speed before the first sample")

    filtered = DiscreteState("m", doc="f of this sample")
    before = DiscreteState("m", doc="measured position of this sample")
    integral = DiscreteState("V", doc="command of the integral part")
    command = DiscreteState("V", doc="command of this sample")

    voltage = Output("V", doc="command to the drive")

    @staticmethod
    def update(
        reference: float, measured: float, filtered: float, before: float, integral: float, position_gain: float, velocity_gain: float,
        integral_rate: float, mean_share: float, limit: float, start_speed: float, sample_period: float, time: float,
    ) -> tuple[float, float, float, float]:  # fmt: skip
        if time <= 0.0:
            before = measured - start_speed * sample_period
            filtered = before - mean_share * start_speed * sample_period
        mean = (1.0 - mean_share) * measured + mean_share * before
        speed_error = position_gain * (reference - measured) - (mean - filtered) / sample_period
        summed = integral + velocity_gain * integral_rate * sample_period * speed_error
        command = velocity_gain * speed_error + summed
        if command > limit:
            return mean, measured, integral, limit
        if command < -limit:
            return mean, measured, integral, -limit
        return mean, measured, summed, command

    @staticmethod
    def output(command: float) -> float:
        return command
