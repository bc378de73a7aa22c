"""Cross-coupling whose gains follow the path."""

from __future__ import annotations

import math

from lathesim.component import Component, DiscreteState, Input, Output, Parameter


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
        x_reference: float,
        z_reference: float,
        x_position: float,
        z_position: float,
        direction_x: float,
        direction_z: float,
        curvature: float,
        proportional: float,
        integral: float,
        largest_voltage: float,
        total: float,
        sample_period: float,
    ) -> tuple[float, float, float, float]:
        """The gains of this sample and the PI law."""
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
        """What was computed at the last sample."""
        return held_deviation, x_held, z_held
