"""A position loop around a velocity loop."""

from __future__ import annotations

from lathesim.component import Component, DiscreteState, Input, Output, Parameter


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

    reference = Input("m", doc="position asked for")
    measured = Input("m", doc="measured position")

    position_gain = Parameter("1/s", 160.18, low=0.0, doc="kp: speed asked for per position error")
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
        reference: float,
        measured: float,
        filtered: float,
        before: float,
        integral: float,
        position_gain: float,
        velocity_gain: float,
        integral_rate: float,
        mean_share: float,
        limit: float,
        start_speed: float,
        sample_period: float,
        time: float,
    ) -> tuple[float, float, float, float]:
        """Both loops."""
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
        """Hold over the sample."""
        return command
