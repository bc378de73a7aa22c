"""A predictive controller of one axis, with limits."""

from __future__ import annotations

import math

from lathesim.component import Component, DiscreteState, Input, Memory, Output, Parameter

_ROUNDS = 6
"""Rounds of coordinate descent of a sample; each begins from the plan of the sample before."""


def _plan(plan: list[float], track: list[float], a: float, b_v: float, b_x: float, c: float, weight: float, limit: float) -> float:
    """Improve the plan of voltages in place so that the predicted positions follow ``track``, and return the first voltage.

    One voltage after the other is set to the best value within its limits while the others stay, with the positions worked out along
    the way (coordinate descent on a convex quadratic with box limits, which converges to its optimum).
    """
    length = len(plan)
    for _ in range(_ROUNDS):
        for place in range(length):
            slope = 0.0
            bend = weight
            x = b_x
            v = b_v
            for later in range(place, length):
                bend = bend + x * x
                slope = slope + x * track[later]
                x = x + c * v
                v = a * v
            change = slope / bend if bend > 0.0 else 0.0
            wanted = plan[place] + change
            if wanted > limit:
                wanted = limit
            if wanted < -limit:
                wanted = -limit
            change = wanted - plan[place]
            plan[place] = wanted
            x = b_x
            v = b_v
            for later in range(place, length):
                track[later] = track[later] - x * change
                x = x + c * v
                v = a * v
    return plan[0]


class PredictiveController(Component):
    """Gives the voltage of an axis tau dv/dt + v = K V by predicting it over a horizon, once a sample:

        min over V_0 .. V_N-1  of  sum (r_j - x_j)^2 + w sum dV_j^2,   |V_j| <= largest_voltage

    The velocity is the difference of the measured positions, the reference goes on with its present velocity and acceleration. The problem
    is a quadratic one with box limits; a few rounds of coordinate descent from the plan of the sample before solve it. The first voltage
    is applied, the rest is the next start. A constant disturbance is estimated from what the last prediction was off.

    Source: E. F. Camacho, C. Bordons, Model Predictive Control, 2nd ed. 2007, chapter 7 (constraints). Left out: limits of speed.
    """

    group = "controllers"

    ports = {"measured": "measured", "drive": "reference", "reading": "voltage", "error": "error"}

    reference = Input("m", doc="reference position")
    measured = Input("m", doc="measured position")
    correction = Input("V", default=0.0, doc="voltage added by a contour controller")

    axis_gain = Parameter("m/(s*V)", 0.01878, low=1e-9, doc="K of the axis")
    time_constant = Parameter("s", 0.0243, low=1e-6, doc="tau of the axis")
    effort = Parameter("m^2/V^2", 1e-12, low=0.0, doc="w: weight of a voltage's change beside the squared position errors")
    observer = Parameter("1", 0.1, low=0.0, high=1.0, doc="share of a prediction's error that is taken for a disturbance")
    largest_voltage = Parameter("V", 10.0, low=0.0, doc="largest voltage")

    plan = Memory("V", 12, doc="voltages to come")
    track = Memory("m", 12, doc="what the predicted positions are off")
    held_voltage = DiscreteState("V", doc="voltage of this sample")
    before = DiscreteState("m", doc="measured position of this sample")
    asked = DiscreteState("m", doc="reference of this sample")
    asked_rate = DiscreteState("m/s", doc="velocity of the reference at this sample")
    speed = DiscreteState("m/s", doc="speed of the axis at this sample")
    disturbance = DiscreteState("V", doc="voltage that a disturbance takes up")
    samples = DiscreteState("1", doc="samples so far, at most two")

    voltage = Output("V", doc="command voltage")
    error = Output("m", doc="measured position error")

    @staticmethod
    def update(
        reference: float,
        measured: float,
        correction: float,
        axis_gain: float,
        time_constant: float,
        effort: float,
        observer: float,
        largest_voltage: float,
        plan: list[float],
        track: list[float],
        held_voltage: float,
        before: float,
        asked: float,
        asked_rate: float,
        speed: float,
        disturbance: float,
        samples: float,
        sample_period: float,
    ) -> tuple[float, float, float, float, float, float, float]:
        """Predict, plan, apply the first."""
        length = len(plan)
        a = math.exp(-sample_period / time_constant)
        b_v = axis_gain * (1.0 - a)
        b_x = axis_gain * (sample_period - time_constant * (1.0 - a))
        c = time_constant * (1.0 - a)
        if samples < 0.5:
            speed = 0.0
            before = measured
            asked = reference
        acting = held_voltage - disturbance
        predicted = before + c * speed + b_x * acting
        rate = (reference - asked) / sample_period
        bend = (rate - asked_rate) / sample_period if samples > 1.5 else 0.0
        if samples > 0.5:
            disturbance = disturbance - observer * (measured - predicted) / b_x
            now = a * speed + b_v * acting + (measured - predicted) / sample_period
        else:
            now = 0.0
        for place in range(length - 1):
            plan[place] = plan[place + 1]
        x = measured
        v = now
        ahead = reference
        ahead_rate = rate
        for place in range(length):
            x = x + c * v + b_x * (plan[place] - disturbance)
            v = a * v + b_v * (plan[place] - disturbance)
            ahead_rate = ahead_rate + bend * sample_period
            ahead = ahead + ahead_rate * sample_period
            track[place] = ahead - x
        voltage = _plan(plan, track, a, b_v, b_x, c, effort, largest_voltage) + correction
        if voltage > largest_voltage:
            voltage = largest_voltage
        if voltage < -largest_voltage:
            voltage = -largest_voltage
        return voltage, measured, reference, rate, now, disturbance, samples + 1.0 if samples < 1.5 else 2.0

    @staticmethod
    def output(held_voltage: float, asked: float, before: float) -> tuple[float, float]:
        """What was computed at the last sample."""
        return held_voltage, asked - before
