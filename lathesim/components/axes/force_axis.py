"""A table pushed by a force."""

from __future__ import annotations

from lathesim.component import Component, Input, Output, Parameter, State


class ForceAxis(Component):
    """Gives speed and position of a mass pushed against viscous friction:  m dv/dt = F_drive - b v - F.

    Source: Y. Koren, Computer Control of Manufacturing Systems, McGraw-Hill (1983), chapter 4 (load of a feed drive); mass and friction
    are assumed, of the size of a small lathe's cross slide. Left out: dry friction, elasticity, the drive's own dynamics.
    """

    group = "axes"

    ports = {
        "effort": "disturbance",
        "flow": "velocity",
        "displacement": "position",
        "drive": "force",
        "applied": "force",
        "inertia": "mass",
        "resistance": "viscous",
    }

    force = Input("N", doc="force of the drive on the table")
    disturbance = Input("N", default=0.0, doc="force on the table, positive against positive motion")

    mass = Parameter("kg", 95.0, low=1e-9, doc="moving mass")
    viscous = Parameter("N*s/m", 200.0, low=0.0, doc="viscous friction")

    speed = State("m/s", doc="table speed")
    travel = State("m", doc="table position")

    position = Output("m", doc="actual position of the table")
    velocity = Output("m/s", doc="actual speed of the table")

    @staticmethod
    def derivative(speed: float, force: float, disturbance: float, mass: float, viscous: float) -> tuple[float, float]:
        """Newton's law."""
        return (force - viscous * speed - disturbance) / mass, speed

    @staticmethod
    def output(travel: float, speed: float) -> tuple[float, float]:
        """The states as they are."""
        return travel, speed
