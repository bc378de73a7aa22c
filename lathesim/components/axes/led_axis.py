"""A table that a good servo leads along its reference, and the current that takes: what the log of a machine control shows of an axis."""

from __future__ import annotations

from lathesim.component import Component, Input, Output, Parameter

_WITHOUT_BOUND = 1e12


class LedAxis(Component):
    """Gives position and motor current of a table that follows its reference at once:  x = x_ref,  i = (m a + b v + F) / K.

    It turns the equation of motion round, for logs that are too slow to integrate (a servo settles within one of their samples): velocity
    and acceleration are given, the current follows. Source: Y. Koren, Computer Control of Manufacturing Systems, McGraw-Hill (1983),
    chapter 4 (load of a feed drive); mass and friction are assumed. Left out: the lag of the servo, dry friction, elasticity.
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

    reference = Input("m", doc="position asked for")
    reference_velocity = Input("m/s", doc="velocity asked for")
    acceleration = Input("m/s^2", default=0.0, doc="acceleration asked for")
    disturbance = Input("N", default=0.0, doc="force on the table, positive against positive motion")

    mass = Parameter("kg", 95.0, low=0.0, doc="moving mass")
    viscous = Parameter("N*s/m", 200.0, low=0.0, doc="viscous friction")
    force_constant = Parameter("N/A", 35.0, low=1e-9, doc="force per current")

    position = Output("m", doc="position of the table")
    velocity = Output("m/s", doc="velocity of the table")
    current = Output("A", doc="current of the motor")
    inertia = Output("kg", doc="inertia that a force meets: without bound, as no force changes a motion that is given")

    @staticmethod
    def output_position(reference: float) -> float:
        return reference

    @staticmethod
    def output_velocity(reference_velocity: float) -> float:
        return reference_velocity

    @staticmethod
    def output_inertia() -> float:
        return _WITHOUT_BOUND

    @staticmethod
    def output_current(
        reference_velocity: float, acceleration: float, disturbance: float, mass: float, viscous: float, force_constant: float
    ) -> float:
        """The equation of motion, solved for the drive."""
        return (mass * acceleration + viscous * reference_velocity + disturbance) / force_constant
