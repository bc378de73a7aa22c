"""A reference filter that takes away the lag of a loop: zero-phase error tracking."""

from __future__ import annotations

import math

from lathesim.component import Component, DiscreteState, Input, Output, Parameter


class ZeroPhasePrefilter(Component):
    """Gives the reference of a P loop around tau dv/dt + v = K V so that the axis follows without phase error, two samples late:

        P(z) = K (b1 z + b0)/((z - 1)(z - p)),  p = exp(-T/tau),  b1 = T - tau (1 - p),  b0 = tau (1 - p) - p T
        A(z) = (z - 1)(z - p) + K Kp (b1 z + b0),   r'(k) = A(z) (b1 z^-1 + b0) / (K Kp (b1 + b0)^2) r(k)

    The closed loop's zero at -b0/b1 is close to -1, so it is not cancelled: its phase is, which leaves a gain near one. What is needed
    ahead, two samples, is gained by letting the whole reference come two samples late, on both axes alike.

    Source: M. Tomizuka, Zero Phase Error Tracking Algorithm for Digital Control, J. Dyn. Syst. Meas. Control 109 (1987), equation (9).
    Left out: extra delays, other controllers than P.
    """

    group = "controllers"

    reference = Input("m", doc="reference position")

    axis_gain = Parameter("m/(s*V)", 0.01878, low=1e-9, doc="K of the axis")
    time_constant = Parameter("s", 0.0243, low=1e-6, doc="tau of the axis")
    proportional = Parameter("V/m", 224.5, low=1e-9, doc="Kp of the position loop")
    share = Parameter("1", 1.0, low=0.0, high=1.0, doc="how much of the filter acts; 0 passes the reference on")

    newest = DiscreteState("m", doc="reference of this sample")
    second = DiscreteState("m", doc="reference a sample before")
    third = DiscreteState("m", doc="reference two samples before")
    fourth = DiscreteState("m", doc="reference three samples before")
    filtered = DiscreteState("m", doc="filtered reference of this sample")
    started = DiscreteState("1", doc="1 after the first sample")

    shaped = Output("m", doc="reference for the position loop")

    @staticmethod
    def update(
        reference: float,
        axis_gain: float,
        time_constant: float,
        proportional: float,
        share: float,
        newest: float,
        second: float,
        third: float,
        started: float,
        sample_period: float,
    ) -> tuple[float, float, float, float, float, float]:
        """Four samples of the reference, weighted."""
        if started < 0.5:
            return reference, reference, reference, reference, reference, 1.0
        p = math.exp(-sample_period / time_constant)
        b1 = sample_period - time_constant * (1.0 - p)
        b0 = time_constant * (1.0 - p) - p * sample_period
        gain = axis_gain * proportional
        a1 = -1.0 - p + gain * b1
        a0 = p + gain * b0
        scale = gain * (b1 + b0) * (b1 + b0)
        ahead = b0
        now = b1 + a1 * b0
        behind = a1 * b1 + a0 * b0
        last = a0 * b1
        value = (ahead * reference + now * newest + behind * second + last * third) / scale
        return reference, newest, second, third, reference + share * (value - reference), 1.0

    @staticmethod
    def output(filtered: float) -> float:
        """Hold over the sample."""
        return filtered
