"""Kind 5 of the user-written parts: a controller of the x axis. Proportional, with the voltage that the reference speed needs."""

from __future__ import annotations

from lathesim.component import Component, DiscreteState, Input, Output, Parameter
from lathesim.hookspecs import hookimpl


class VelocityFeedforwardController(Component):
    """Gives an axis' voltage:  V = Kp e + share (r_k - r_{k-1})/(T K) + u_c,  e = r - x, kept within the converter's range.

    With share 1 and the true speed per volt K the lag of a proportional loop vanishes at constant speed. It takes the place of the
    x controller of a lathe.
    Source: Y. Koren, C. C. Lo, Advanced Controllers for Feed Drives, Annals of the CIRP 41 (1992), feedforward controllers.
    Left out: the acceleration the lag of the drive needs.
    """

    ports = {"measured": "measured", "drive": "reference", "reading": "voltage", "loop_gain": "proportional", "error": "error"}

    reference = Input("m", doc="reference position")
    measured = Input("m", doc="measured position")
    correction = Input("V", default=0.0, doc="voltage added by a cross-coupling controller")

    proportional = Parameter("V/m", 224.5, low=0.0, doc="proportional gain")
    speed_per_volt = Parameter("m/(s*V)", 0.01878, low=1e-6, doc="believed table speed per volt")
    share = Parameter("1", 1.0, low=0.0, high=2.0, doc="share of the feedforward")
    smallest_voltage = Parameter("V", -10.0, doc="lower end of the converter's range")
    largest_voltage = Parameter("V", 10.0, doc="upper end of the converter's range")

    held_voltage = DiscreteState("V", doc="voltage of this sample")
    held_error = DiscreteState("m", doc="error of this sample")
    reference_before = DiscreteState("m", doc="reference a sample ago")
    started = DiscreteState("1", doc="1 after the first sample")

    voltage = Output("V", doc="command voltage")
    error = Output("m", doc="measured position error")

    @staticmethod
    def update(
        reference: float,
        measured: float,
        correction: float,
        proportional: float,
        speed_per_volt: float,
        share: float,
        smallest_voltage: float,
        largest_voltage: float,
        reference_before: float,
        started: float,
        sample_period: float,
    ) -> tuple[float, float, float, float]:
        """One sample."""
        error = reference - measured
        speed = (reference - reference_before) / sample_period if started > 0.5 else 0.0
        voltage = proportional * error + share * speed / speed_per_volt + correction
        if voltage > largest_voltage:
            voltage = largest_voltage
        if voltage < smallest_voltage:
            voltage = smallest_voltage
        return voltage, error, reference, 1.0

    @staticmethod
    def output(held_voltage: float, held_error: float) -> tuple[float, float]:
        """Hold over the sample."""
        return held_voltage, held_error


@hookimpl
def register_components() -> list[type[Component]]:
    """Hand the part to the simulator."""
    return [VelocityFeedforwardController]
