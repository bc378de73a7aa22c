"""The controller that couples two axes to keep the tool on its contour."""

from __future__ import annotations

from lathesim.component import Component, DiscreteState, Input, Output, Parameter


class CrossCouplingController(Component):
    """Gives the voltages added to both axes from the sensed contour error:  u_c = Kp eps + Ki sum(eps T) + Kd (eps - eps_before)/T.

    V_x gets u_c cos, V_z gets -u_c sin (on arcs: along the radius), before the axes' saturation. All gains 0: no contour control.
    Source: Y. Koren, C. C. Lo, Advanced Controllers for Feed Drives, Annals of the CIRP 41 (1992); J. Liu, R. G. Landers (2004),
    section Contour control. The integral is limited to what ``largest_voltage`` can use. Left out: variable-gain laws.
    """

    group = "controllers"

    ports = {"measured": "deviation"}

    deviation = Input("m", doc="sensed contour error, signed alike on lines and arcs")
    normal_x = Input("1", doc="x part of the direction in which a positive deviation is made good")
    normal_z = Input("1", doc="z part of that direction")

    proportional = Parameter("V/m", 0.0, doc="proportional gain")
    integral = Parameter("V/(m*s)", 0.0, doc="integral gain")
    derivative_gain = Parameter("V*s/m", 0.0, doc="derivative gain")
    largest_voltage = Parameter("V", 10.0, low=0.0, doc="largest amount of the correction")

    held_voltage = DiscreteState("V", doc="correction of this sample")
    held_deviation = DiscreteState("m", doc="deviation of this sample")
    deviation_sum = DiscreteState("m*s", doc="sum of deviations times sample period")
    held_normal_x = DiscreteState("1", doc="x part of the normal of this sample")
    held_normal_z = DiscreteState("1", doc="z part of the normal of this sample")
    started = DiscreteState("1", doc="1 after the first sample")

    voltage = Output("V", doc="command voltage of the cross-coupling controller")
    x_voltage = Output("V", doc="voltage added to the x axis")
    z_voltage = Output("V", doc="voltage added to the z axis")

    @staticmethod
    def update(
        deviation: float,
        normal_x: float,
        normal_z: float,
        proportional: float,
        integral: float,
        derivative_gain: float,
        largest_voltage: float,
        held_deviation: float,
        deviation_sum: float,
        started: float,
        sample_period: float,
    ) -> tuple[float, float, float, float, float, float]:
        """The PID law on the contour error."""
        slope = (deviation - held_deviation) / sample_period if started > 0.5 else 0.0
        total = deviation_sum + deviation * sample_period
        voltage = proportional * deviation + integral * total + derivative_gain * slope
        if abs(voltage) > largest_voltage and voltage * integral * deviation > 0.0:
            total = deviation_sum
            voltage = proportional * deviation + integral * total + derivative_gain * slope
        if voltage > largest_voltage:
            voltage = largest_voltage
        if voltage < -largest_voltage:
            voltage = -largest_voltage
        return voltage, deviation, total, normal_x, normal_z, 1.0

    @staticmethod
    def output(held_voltage: float, held_normal_x: float, held_normal_z: float) -> tuple[float, float, float]:
        """Split the correction onto the axes."""
        return held_voltage, held_voltage * held_normal_x, held_voltage * held_normal_z
