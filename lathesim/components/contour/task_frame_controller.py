"""Both axes controlled in the frame of the task: along the path and across it."""

from __future__ import annotations

from lathesim.component import Component, DiscreteState, Input, Output, Parameter


class TaskFrameController(Component):
    """Gives the voltages of two like axes from the errors along and across the path, once a sample:

        u_t = K_t lag + Kv v + Ka v',   u_n = K_n eps + K_i sum(eps T) + K_d d eps/dt + Ka v^2 kappa,   V = u_t t + u_n n

    lag and eps are the errors along the tangent t and the normal n = (t_z, -t_x), v the path speed and kappa its curvature. A gain across
    the path may be far higher than one along it, which no pair of axis gains can do.

    Source: G. T.-C. Chiu, M. Tomizuka, Contouring control of machine tool feed drive systems: a task coordinate frame approach, IEEE
    Trans. Control Systems Technology 9 (2001). Left out: axes of different dynamics.
    """

    group = "controllers"

    ports = {"reading": "x_voltage"}

    deviation = Input("m", doc="contour error, made good along the normal")
    lag = Input("m", doc="how far the tool is behind the reference along the tangent")
    normal_x = Input("1", doc="x part of the normal")
    normal_z = Input("1", doc="z part of the normal")
    tangent_x = Input("1", doc="x part of the tangent")
    tangent_z = Input("1", doc="z part of the tangent")
    feed_speed = Input("m/s", default=0.0, doc="path speed of the reference")
    curvature = Input("1/m", default=0.0, doc="signed curvature of the path")

    along = Parameter("V/m", 224.5, doc="gain along the path")
    across = Parameter("V/m", 449.0, doc="gain across the path")
    across_integral = Parameter("V/(m*s)", 0.0, doc="integral gain across the path")
    across_derivative = Parameter("V*s/m", 0.0, doc="derivative gain across the path")
    velocity_feedforward = Parameter("V*s/m", 0.0, doc="voltage per path speed")
    acceleration_feedforward = Parameter("V*s^2/m", 0.0, doc="voltage per path acceleration")
    largest_voltage = Parameter("V", 10.0, low=0.0, doc="largest voltage of an axis")

    held_deviation = DiscreteState("m", doc="contour error of this sample")
    total = DiscreteState("m*s", doc="sum of contour errors times sample period")
    held_speed = DiscreteState("m/s", doc="path speed of this sample")
    started = DiscreteState("1", doc="1 after the first sample")
    x_held = DiscreteState("V", doc="voltage of the x axis")
    z_held = DiscreteState("V", doc="voltage of the z axis")

    x_voltage = Output("V", doc="command voltage of the x axis")
    z_voltage = Output("V", doc="command voltage of the z axis")

    @staticmethod
    def update(
        deviation: float,
        lag: float,
        normal_x: float,
        normal_z: float,
        tangent_x: float,
        tangent_z: float,
        feed_speed: float,
        curvature: float,
        along: float,
        across: float,
        across_integral: float,
        across_derivative: float,
        velocity_feedforward: float,
        acceleration_feedforward: float,
        largest_voltage: float,
        held_deviation: float,
        total: float,
        held_speed: float,
        started: float,
        sample_period: float,
    ) -> tuple[float, float, float, float, float, float]:
        """Both laws, turned back to the axes."""
        slope = (deviation - held_deviation) / sample_period if started > 0.5 else 0.0
        rise = (feed_speed - held_speed) / sample_period if started > 0.5 else 0.0
        summed = total + deviation * sample_period
        tangential = along * lag + velocity_feedforward * feed_speed + acceleration_feedforward * rise
        inward = acceleration_feedforward * feed_speed * feed_speed * curvature
        normal = across * deviation + across_integral * summed + across_derivative * slope + inward
        x = tangential * tangent_x + normal * normal_x
        z = tangential * tangent_z + normal * normal_z
        if x > largest_voltage:
            x = largest_voltage
        if x < -largest_voltage:
            x = -largest_voltage
        if z > largest_voltage:
            z = largest_voltage
        if z < -largest_voltage:
            z = -largest_voltage
        return deviation, summed, feed_speed, 1.0, x, z

    @staticmethod
    def output(x_held: float, z_held: float) -> tuple[float, float]:
        """Hold over the sample."""
        return x_held, z_held
