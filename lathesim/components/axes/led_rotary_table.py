"""A rotary table that follows its reference exactly, and the motor current that this takes, for slow logs of machine controls."""

from __future__ import annotations

from lathesim.component import Component, Input, Output, Parameter

_WITHOUT_BOUND = 1e12
"""Inertia [kg m^2] that stands for an unlimited one (assumed)."""


class LedRotaryTable(Component):
    """Gives angle and motor current of a table that follows its reference without lag:  a = a_ref,  i = (J da^2/dt^2 + b da/dt + T) / K.

    The rotary counterpart of :class:`LedAxis`, for logs that are too slow to integrate: angular velocity and acceleration are inputs, the
    current follows. Source: Y. Koren, Computer Control of Manufacturing Systems, McGraw-Hill (1983), chapter 4 (load of a feed drive);
    inertia and friction are assumed. Left out: the lag of the servo, dry friction, elasticity, gravity.
    """

    group = "axes"

    ports = {
        "effort": "disturbance",
        "flow": "velocity",
        "reference": "reference",
        "reference_rate": "reference_velocity",
        "reference_acceleration": "acceleration",
        "inertia": "inertia",
        "current": "current",
    }

    reference = Input("rad", doc="commanded angle")
    reference_velocity = Input("rad/s", doc="commanded angular velocity")
    acceleration = Input("rad/s^2", default=0.0, doc="commanded angular acceleration")
    disturbance = Input("N*m", default=0.0, doc="torque on the table, positive against positive motion")

    turned_inertia = Parameter("kg*m^2", 0.5, low=0.0, doc="inertia of all rotating parts, referred to the table")
    viscous = Parameter("N*m*s/rad", 2.0, low=0.0, doc="viscous friction")
    torque_constant = Parameter("N*m/A", 10.0, low=1e-12, doc="torque at the table per current")

    angle = Output("rad", doc="angle of the table")
    velocity = Output("rad/s", doc="angular velocity of the table")
    current = Output("A", doc="current of the motor")
    inertia = Output("kg*m^2", doc="inertia against a torque: without bound, because no torque changes a prescribed motion")

    @staticmethod
    def output_angle(reference: float) -> float:
        return reference

    @staticmethod
    def output_velocity(reference_velocity: float) -> float:
        return reference_velocity

    @staticmethod
    def output_inertia() -> float:
        return _WITHOUT_BOUND

    @staticmethod
    def output_current(
        reference_velocity: float, acceleration: float, disturbance: float, turned_inertia: float, viscous: float, torque_constant: float
    ) -> float:
        """The equation of motion, solved for the drive."""
        return (turned_inertia * acceleration + viscous * reference_velocity + disturbance) / torque_constant
