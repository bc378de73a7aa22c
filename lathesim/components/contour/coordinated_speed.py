"""Coordinated control of a circle: a tangent speed that moves the tool along, and a normal speed that brings it back."""

from __future__ import annotations

import math

from lathesim.component import Component, Input, Output, Parameter


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
    command_gain = Parameter("V*s/m", 1.0, doc="command per speed asked for; 1/K of the axis")

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
        x_position: float,
        z_position: float,
        x_regulator: float,
        z_regulator: float,
        contour_speed: float,
        regulator_gain: float,
        command_gain: float,
    ) -> tuple[float, float]:
        """Equations (3) and (4)."""
        distance = max(math.sqrt(x_position * x_position + z_position * z_position), 1e-12)
        along_x = -z_position / distance
        along_z = x_position / distance
        x = contour_speed * along_x + regulator_gain * x_regulator
        z = contour_speed * along_z + regulator_gain * z_regulator
        return command_gain * x, command_gain * z
