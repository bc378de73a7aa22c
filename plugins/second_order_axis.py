"""Kind 4 of the user-written parts: a model of the z axis. A carriage whose drive overshoots."""

from __future__ import annotations

from lathesim.component import Component, Input, Output, Parameter, State
from lathesim.hookspecs import hookimpl


class SecondOrderAxis(Component):
    """Gives speed and position of a carriage behind a velocity loop of second order:

        d2v/dt2 + 2 zeta w dv/dt + w^2 v = w^2 (K V - Kd F),   dx/dt = v

    It takes the place of the z axis of a lathe; with zeta below 0.7 the speed overshoots, which a first-order model cannot show.
    Source: Y. Koren, Computer Control of Manufacturing Systems, McGraw-Hill (1983), chapter on feed drives; the values are assumed, as
    fast as the first-order axis it replaces. Left out: dry friction, saturation.
    """

    ports = {"effort": "force", "flow": "velocity", "displacement": "position", "drive": "voltage"}

    voltage = Input("V", doc="voltage to the amplifier")
    force = Input("N", default=0.0, doc="force on the carriage, positive against positive motion")

    gain = Parameter("m/(s*V)", 0.01878, low=0.0, doc="speed of the carriage per volt")
    natural_frequency = Parameter("rad/s", 60.0, low=1.0, high=2000.0, doc="natural frequency of the velocity loop")
    damping_ratio = Parameter("1", 0.5, low=0.0, high=5.0, doc="damping ratio of the velocity loop")
    disturbance_gain = Parameter("m/(s*N)", 0.0, low=0.0, doc="speed lost per newton")

    speed = State("m/s", doc="speed of the carriage")
    acceleration = State("m/s^2", doc="acceleration of the carriage")
    travel = State("m", doc="position of the carriage")

    position = Output("m", doc="actual position of the carriage")
    velocity = Output("m/s", doc="actual speed of the carriage")

    @staticmethod
    def derivative(
        speed: float,
        acceleration: float,
        voltage: float,
        force: float,
        gain: float,
        natural_frequency: float,
        damping_ratio: float,
        disturbance_gain: float,
    ) -> tuple[float, float, float]:
        """The velocity loop."""
        wanted = gain * voltage - disturbance_gain * force
        jerk = natural_frequency * (natural_frequency * (wanted - speed) - 2.0 * damping_ratio * acceleration)
        return acceleration, jerk, speed

    @staticmethod
    def output(travel: float, speed: float) -> tuple[float, float]:
        """Position and speed."""
        return travel, speed


@hookimpl
def register_components() -> list[type[Component]]:
    """Hand the part to the simulator."""
    return [SecondOrderAxis]
