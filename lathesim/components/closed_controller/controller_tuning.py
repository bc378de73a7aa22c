"""The gains of both PI controllers of a closed controller, and how errors of its own identification change them."""

from __future__ import annotations

from lathesim.component import Component, Output, Parameter


class ControllerTuning(Component):
    """Gives p13 to p16, the PI gains, as a control that identifies its drive wrongly would set them.

    Modulus optimum of the current loop, symmetrical optimum of the speed loop, with T = k4 + d and Tc = 2 T:

        p15 = L/(2 T),   p16 = R/(2 T),   p13 = 1/(2 k8 Tc),   p14 = p13/(4 Tc)

    Each of the seven factors p28 to p34 is identified value/true value; with all at 1 the gains are those given. The paper names no
    formula, so this one is assumed; p28 to p34 show only through the four gains.

    Source: A. Voda, I. Landau, A method for the auto-calibration of PID controllers, Automatica 31 (1995); A. Tiwari et al. (2023),
    section 2.1.
    """

    group = "controllers"

    speed_proportional = Parameter("A*s/m", 166.7, low=0.0, doc="p13 of an identification without errors")
    speed_integral = Parameter("A/m", 6944.0, low=0.0, doc="p14 of an identification without errors")
    power_proportional = Parameter("V/A", 0.833, low=0.0, doc="p15 of an identification without errors")
    power_integral = Parameter("V/(A*s)", 166.7, low=0.0, doc="p16 of an identification without errors")
    inductance_error = Parameter("1", 1.0, low=1e-3, doc="p28: factor on L = 1/k6")
    resistance_error = Parameter("1", 1.0, low=1e-3, doc="p29: factor on R = k7/k6")
    lag_error = Parameter("1", 1.0, low=1e-3, doc="p30: factor on k4")
    delay_error = Parameter("1", 1.0, low=1e-3, doc="p31: factor on d")
    acceleration_error = Parameter("1", 1.0, low=1e-3, doc="p32: factor on k8")
    current_loop_error = Parameter("1", 1.0, low=1e-3, doc="p33: factor on Tc")
    symmetry_error = Parameter("1", 1.0, low=1e-3, doc="p34: factor on the 4 of the symmetrical optimum")
    lag = Parameter("s", 0.002, low=1e-6, doc="k4, the lag of the power controller")
    delay = Parameter("s", 1e-3, low=0.0, doc="d, the transport delay")

    speed_controller_proportional = Output("A*s/m", doc="p13 as set")
    speed_controller_integral = Output("A/m", doc="p14 as set")
    power_controller_proportional = Output("V/A", doc="p15 as set")
    power_controller_integral = Output("V/(A*s)", doc="p16 as set")

    @staticmethod
    def output(
        speed_proportional: float, speed_integral: float, power_proportional: float, power_integral: float, inductance_error: float,
        resistance_error: float, lag_error: float, delay_error: float, acceleration_error: float, current_loop_error: float,
        symmetry_error: float, lag: float, delay: float,
    ) -> tuple[float, float, float, float]:  # fmt: skip
        """Scale the gains as the formulas do."""
        slow = (lag * lag_error + delay * delay_error) / (lag + delay)
        loop = slow * current_loop_error
        speed = 1.0 / (acceleration_error * loop)
        return (
            speed_proportional * speed,
            speed_integral * speed / (loop * symmetry_error),
            power_proportional * inductance_error / slow,
            power_integral * resistance_error / slow,
        )
