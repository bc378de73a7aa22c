"""Contour controllers: they couple two axes to keep the tool on its path."""

from __future__ import annotations

import math

from lathesim.component import ON, Component, DiscreteState, Input, Output, Parameter
from lathesim.components.servo_controllers import limited_pid
from lathesim.elementary import within


class CrossCouplingController(Component):
    """Gives the voltages added to both axes from the sensed contour error:  u_c = Kp eps + Ki sum(eps T) + Kd (eps - eps_before)/T.

    V_x gets u_c cos, V_z gets -u_c sin (on arcs: along the radius), before the axes' saturation. All gains 0: no contour control.
    Source: Y. Koren, C. C. Lo, Advanced Controllers for Feed Drives, Annals of the CIRP 41 (1992); J. Liu, R. G. Landers (2004),
    section Contour control. The integral is limited to what ``largest_voltage`` can use. Left out: variable-gain laws.
    """

    group = "controllers"

    ports = {"measured": "deviation"}

    deviation = Input("m", doc="sensed contour error, signed alike on lines and arcs")
    normal_x = Input("1", doc="x part of the direction in which a positive deviation is made good")
    normal_z = Input("1", doc="z part of that direction")

    proportional = Parameter("V/m", 0.0, doc="proportional gain")
    integral = Parameter("V/(m*s)", 0.0, doc="integral gain")
    derivative_gain = Parameter("V*s/m", 0.0, doc="derivative gain")
    largest_voltage = Parameter("V", 10.0, low=0.0, doc="largest amount of the correction")

    held_voltage = DiscreteState("V", doc="correction of this sample")
    held_deviation = DiscreteState("m", doc="deviation of this sample")
    deviation_sum = DiscreteState("m*s", doc="sum of deviations times sample period")
    held_normal_x = DiscreteState("1", doc="x part of the normal of this sample")
    held_normal_z = DiscreteState("1", doc="z part of the normal of this sample")
    started = DiscreteState("1", doc="1 after the first sample")

    voltage = Output("V", doc="command voltage of the cross-coupling controller")
    x_voltage = Output("V", doc="voltage added to the x axis")
    z_voltage = Output("V", doc="voltage added to the z axis")

    @staticmethod
    def update(
        deviation: float, normal_x: float, normal_z: float, proportional: float, integral: float, derivative_gain: float,
        largest_voltage: float, held_deviation: float, deviation_sum: float, started: float, sample_period: float,
    ) -> tuple[float, float, float, float, float, float]:  # fmt: skip
        slope = (deviation - held_deviation) / sample_period if started > ON else 0.0
        voltage, total = limited_pid(
            proportional * deviation, derivative_gain * slope, 0.0, integral, deviation_sum, deviation * sample_period, -largest_voltage,
            largest_voltage,
        )  # fmt: skip
        return voltage, deviation, total, normal_x, normal_z, 1.0

    @staticmethod
    def output(held_voltage: float, held_normal_x: float, held_normal_z: float) -> tuple[float, float, float]:
        return held_voltage, held_voltage * held_normal_x, held_voltage * held_normal_z


class VariableGainCoupling(Component):
    """Gives the voltages added to both axes by a PI law on the contour error, with gains that follow the path:

        eps = e_x C_x + e_z C_z,   C_x = t_z + kappa e_x/2,   C_z = -t_x + kappa e_z/2,   V_x = u C_x,  V_z = u C_z

    e = reference - position, t the unit tangent and kappa the curvature at the reference (positive to the left); the halves of kappa e
    make eps right for a circle to second order. No foot point is needed; what it costs is told by the exact one beside it.

    Source: Y. Koren, C. C. Lo, Variable-gain cross-coupling controller for contouring, Annals of the CIRP 40 (1991), equations of the gains
    C_x and C_y. Left out: the derivative part.
    """

    group = "controllers"

    x_reference = Input("m", doc="reference radius of the tool tip")
    z_reference = Input("m", doc="reference z position of the tool tip")
    x_position = Input("m", doc="measured radius of the tool tip")
    z_position = Input("m", doc="measured z position of the tool tip")
    direction_x = Input("1", doc="x part of the unit tangent at the reference")
    direction_z = Input("1", doc="z part of the unit tangent at the reference")
    curvature = Input("1/m", default=0.0, doc="signed curvature at the reference, positive to the left")

    proportional = Parameter("V/m", 0.0, doc="proportional gain")
    integral = Parameter("V/(m*s)", 0.0, doc="integral gain")
    largest_voltage = Parameter("V", 10.0, low=0.0, doc="largest amount of the correction")

    total = DiscreteState("m*s", doc="sum of contour errors times sample period")
    held_deviation = DiscreteState("m", doc="contour error of this sample")
    x_held = DiscreteState("V", doc="voltage added to the x axis")
    z_held = DiscreteState("V", doc="voltage added to the z axis")

    deviation = Output("m", doc="contour error as the gains see it")
    x_voltage = Output("V", doc="voltage added to the x axis")
    z_voltage = Output("V", doc="voltage added to the z axis")

    @staticmethod
    def update(
        x_reference: float, z_reference: float, x_position: float, z_position: float, direction_x: float, direction_z: float,
        curvature: float, proportional: float, integral: float, largest_voltage: float, total: float, sample_period: float,
    ) -> tuple[float, float, float, float]:  # fmt: skip
        x_error = x_reference - x_position
        z_error = z_reference - z_position
        x_gain = direction_z + 0.5 * curvature * x_error
        z_gain = -direction_x + 0.5 * curvature * z_error
        error = x_error * x_gain + z_error * z_gain
        summed = total + error * sample_period
        voltage = proportional * error + integral * summed
        if abs(voltage) > largest_voltage:
            voltage = math.copysign(largest_voltage, voltage)
            summed = total
        return summed, error, voltage * x_gain, voltage * z_gain

    @staticmethod
    def output(held_deviation: float, x_held: float, z_held: float) -> tuple[float, float, float]:
        return held_deviation, x_held, z_held


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
        deviation: float, lag: float, normal_x: float, normal_z: float, tangent_x: float, tangent_z: float, feed_speed: float,
        curvature: float, along: float, across: float, across_integral: float, across_derivative: float, velocity_feedforward: float,
        acceleration_feedforward: float, largest_voltage: float, held_deviation: float, total: float, held_speed: float, started: float,
        sample_period: float,
    ) -> tuple[float, float, float, float, float, float]:  # fmt: skip
        slope = (deviation - held_deviation) / sample_period if started > ON else 0.0
        rise = (feed_speed - held_speed) / sample_period if started > ON else 0.0
        summed = total + deviation * sample_period
        tangential = along * lag + velocity_feedforward * feed_speed + acceleration_feedforward * rise
        inward = acceleration_feedforward * feed_speed * feed_speed * curvature
        normal = across * deviation + across_integral * summed + across_derivative * slope + inward
        x = within(tangential * tangent_x + normal * normal_x, -largest_voltage, largest_voltage)
        z = within(tangential * tangent_z + normal * normal_z, -largest_voltage, largest_voltage)
        return deviation, summed, feed_speed, 1.0, x, z

    @staticmethod
    def output(x_held: float, z_held: float) -> tuple[float, float]:
        return x_held, z_held


class CoordinatedSpeed(Component):
    """Gives the speed vector of a tool on a circle about the origin, from where it is:

        V = V_k t + K_u u,   t = (-z, x)/r (from +X to +Z),   E_k = r - R,   E_vk = x'^2 + z'^2 - V_k^2

    u is what a regulator makes of the position and the contour error E_k; with u = 0 the tangent speed alone is left. It answers at once,
    as a continuous controller does. ``speed_error`` is a difference of squared speeds, as the paper defines it.

    Source: V. Lyubich, V. Frolov, V. Beliaev, Synthesis of the neural coordinated control algorithm for the model of CNC machine,
    equations (3) to (6).
    """

    group = "controllers"

    x_position = Input("m", doc="x position of the tool")
    z_position = Input("m", doc="z position of the tool")
    x_speed = Input("m/s", doc="x velocity of the tool")
    z_speed = Input("m/s", doc="z velocity of the tool")
    x_regulator = Input("1", default=0.0, doc="u of the x axis")
    z_regulator = Input("1", default=0.0, doc="u of the z axis")

    radius = Parameter("m", 9.0, low=1e-6, doc="radius of the circle")
    contour_speed = Parameter("m/s", 0.4, doc="V_k")
    regulator_gain = Parameter("m/s", 0.8, low=0.0, doc="K_u")
    command_gain = Parameter("V*s/m", 1.0, doc="command per commanded speed; 1/K of the axis")

    contour_error = Output("m", doc="E_k, positive outside")
    speed_error = Output("m^2/s^2", doc="E_vk")
    x_command = Output("V", doc="command to the x axis")
    z_command = Output("V", doc="command to the z axis")

    @staticmethod
    def output_contour_error(x_position: float, z_position: float, radius: float) -> float:
        return math.sqrt(x_position * x_position + z_position * z_position) - radius

    @staticmethod
    def output_speed_error(x_speed: float, z_speed: float, contour_speed: float) -> float:
        return x_speed * x_speed + z_speed * z_speed - contour_speed * contour_speed

    @staticmethod
    def output(
        x_position: float, z_position: float, x_regulator: float, z_regulator: float, contour_speed: float, regulator_gain: float,
        command_gain: float,
    ) -> tuple[float, float]:  # fmt: skip
        """Equations (3) and (4)."""
        distance = max(math.sqrt(x_position * x_position + z_position * z_position), 1e-12)
        along_x = -z_position / distance
        along_z = x_position / distance
        x = contour_speed * along_x + regulator_gain * x_regulator
        z = contour_speed * along_z + regulator_gain * z_regulator
        return command_gain * x, command_gain * z
