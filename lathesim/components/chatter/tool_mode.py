"""A mode of the tool point, swung by the cutting force."""

from __future__ import annotations

import math

from lathesim.component import Component, Input, Output, Parameter, State


class ToolMode(Component):
    """Gives the displacement of the tool along the normal of the surface by one of its modes.

        q'' + 2 zeta w q' + w^2 q = (w^2/k) (F cos(beta - alpha) + F_d cos(alpha) + F_a),   x = before + q cos(alpha),   w = 2 pi f

    alpha is the angle of the mode and beta that of the cutting force, both from the normal. Several modes stand in a row: each adds its
    share to the ``before`` of the next. F_d is a force along the normal, as of process damping, and F_a one along the mode, as of a hammer.
    Source: Y. Altintas, Manufacturing Automation (2012), chapter 3. Left out: modes that share their damping.
    """

    group = "tool and part"

    ports = {"effort": "force", "displacement": "displacement", "flow": "velocity"}

    swing = State("m", doc="displacement along the mode")
    swing_rate = State("m/s", doc="its rate")
    force = Input("N", default=0.0, doc="cutting force")
    drag = Input("N", default=0.0, doc="force along the normal of the surface")
    hammer = Input("N", default=0.0, doc="force along the mode")
    before = Input("m", default=0.0, doc="displacement by the modes before, along the normal")
    before_rate = Input("m/s", default=0.0, doc="its rate")
    before_acceleration = Input("m/s^2", default=0.0, doc="acceleration by the modes before, along the normal")

    frequency = Parameter("Hz", 100.0, low=0.1, high=1e5, doc="natural frequency")
    damping = Parameter("1", 0.03, low=0.0, high=0.999, doc="damping ratio")
    stiffness = Parameter("N/m", 1e7, low=1.0, doc="modal stiffness")
    direction = Parameter("rad", 0.0, doc="angle of the mode from the normal of the surface")
    force_angle = Parameter("rad", 0.0, doc="angle of the cutting force from the normal of the surface")

    displacement = Output("m", doc="displacement out of the part, along the normal")
    velocity = Output("m/s", doc="its rate")
    acceleration = Output("m/s^2", doc="acceleration along the normal")

    @staticmethod
    def derivative(
        swing: float, swing_rate: float, force: float, drag: float, hammer: float, frequency: float, damping: float, stiffness: float,
        direction: float, force_angle: float,
    ) -> tuple[float, float]:  # fmt: skip
        w = 2.0 * math.pi * frequency
        pushed = force * math.cos(force_angle - direction) + drag * math.cos(direction) + hammer
        return swing_rate, w * (w * (pushed / stiffness - swing) - 2.0 * damping * swing_rate)

    @staticmethod
    def output_displacement(swing: float, before: float, direction: float) -> float:
        return before + swing * math.cos(direction)

    @staticmethod
    def output_velocity(swing_rate: float, before_rate: float, direction: float) -> float:
        return before_rate + swing_rate * math.cos(direction)

    @staticmethod
    def output_acceleration(
        swing: float, swing_rate: float, force: float, drag: float, hammer: float, before_acceleration: float, frequency: float,
        damping: float, stiffness: float, direction: float, force_angle: float,
    ) -> float:  # fmt: skip
        w = 2.0 * math.pi * frequency
        pushed = force * math.cos(force_angle - direction) + drag * math.cos(direction) + hammer
        return before_acceleration + math.cos(direction) * w * (w * (pushed / stiffness - swing) - 2.0 * damping * swing_rate)
