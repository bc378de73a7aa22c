"""Kind 6 of the user-written parts: a controller of the z axis. A lead compensator, made discrete by Tustin's rule."""

from __future__ import annotations

from lathesim.component import Component, DiscreteState, Input, Output, Parameter
from lathesim.hookspecs import hookimpl


class LeadController(Component):
    """Gives an axis' voltage through a lead:  V(s) = Kp (1 + a tau s)/(1 + tau s) E(s) + u_c, kept within the converter's range.

        u_k = ((2 tau - T) u_{k-1} + Kp ((2 a tau + T) e_k - (2 a tau - T) e_{k-1}))/(2 tau + T)

    The zero at 1/(a tau) takes away the lag of the drive, so the gain may be higher. It takes the place of the z controller of a lathe.
    Source: G. F. Franklin, J. D. Powell, M. L. Workman, Digital Control of Dynamic Systems (1998), emulation with Tustin's method; by
    default the zero lies on the drive's time constant of 24.3 ms. Left out: an integral.
    """

    ports = {"measured": "measured", "drive": "reference", "reading": "voltage", "loop_gain": "proportional", "error": "error"}

    reference = Input("m", doc="reference position")
    measured = Input("m", doc="measured position")
    correction = Input("V", default=0.0, doc="voltage added by a cross-coupling controller")

    proportional = Parameter("V/m", 400.0, low=0.0, doc="gain at standstill")
    pole_time = Parameter("s", 0.0081, low=1e-4, doc="tau: time constant of the pole")
    lead_ratio = Parameter("1", 3.0, low=1.0, high=20.0, doc="a: time constant of the zero over that of the pole")
    smallest_voltage = Parameter("V", -10.0, doc="lower end of the converter's range")
    largest_voltage = Parameter("V", 10.0, doc="upper end of the converter's range")

    held_voltage = DiscreteState("V", doc="voltage of this sample")
    held_error = DiscreteState("m", doc="error of this sample")
    lead = DiscreteState("V", doc="output of the compensator")

    voltage = Output("V", doc="command voltage")
    error = Output("m", doc="measured position error")

    @staticmethod
    def update(
        reference: float,
        measured: float,
        correction: float,
        proportional: float,
        pole_time: float,
        lead_ratio: float,
        smallest_voltage: float,
        largest_voltage: float,
        held_error: float,
        lead: float,
        sample_period: float,
    ) -> tuple[float, float, float]:
        """One sample."""
        error = reference - measured
        zero_time = lead_ratio * pole_time
        lead = (
            (2.0 * pole_time - sample_period) * lead
            + proportional * ((2.0 * zero_time + sample_period) * error - (2.0 * zero_time - sample_period) * held_error)
        ) / (2.0 * pole_time + sample_period)
        voltage = lead + correction
        if voltage > largest_voltage:
            voltage = largest_voltage
        if voltage < smallest_voltage:
            voltage = smallest_voltage
        return voltage, error, lead

    @staticmethod
    def output(held_voltage: float, held_error: float) -> tuple[float, float]:
        """Hold over the sample."""
        return held_voltage, held_error


@hookimpl
def register_components() -> list[type[Component]]:
    """Hand the part to the simulator."""
    return [LeadController]
