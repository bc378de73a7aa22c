"""The speed controller of the spindle: PID, saturated at the converter's range."""

from __future__ import annotations

from lathesim.component import DiscreteState, Input, Output, Parameter
from lathesim.components.servo_control.position_controller import PositionController


class SpindleController(PositionController):
    """Gives the voltage of the spindle from its speed error, once a sample:  V = Kp e + Ki sum(e T) + Kd (e - e_before)/T.

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
    smallest_voltage = Parameter("V", -10.0, doc="lower end of the converter's range")
    largest_voltage = Parameter("V", 10.0, doc="upper end of the converter's range")

    held_voltage = DiscreteState("V", doc="voltage of this sample")
    held_error = DiscreteState("rad/s", doc="error of this sample")
    error_sum = DiscreteState("rad", doc="sum of errors times sample period")
    started = DiscreteState("1", doc="1 after the first sample")

    voltage = Output("V", doc="command voltage")
    error = Output("rad/s", doc="measured speed error")
