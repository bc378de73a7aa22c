"""Controllers that use what comes next on the path or a model of the loop: feedforward, prediction, a trained network."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from lathesim.component import ON, Component, DiscreteState, Input, Memory, Output, Parameter, Table
from lathesim.components.servo_controllers import HeldVoltage, limited_pid
from lathesim.elementary import within

_TWO = 1.5
"""More samples than this are two, as a change of a rate needs."""
_SATURATED = 20.0
"""Argument from which on the last bit of tanh is 1."""

MEASURE_FROM_REFERENCE = 1.0e300
"""Value of an input that means "nothing is wired here": the rate is then taken from the reference itself."""


class FeedforwardController(HeldVoltage, Component):
    """Gives the voltage of an axis, once a sample:  V = Kp e + Ki sum(e T) + Kd de/dt + Kv r' + Ka r'' + Kf sgn(r') + u_c.

    e = reference - measured; r' and r'' are wired, or else the backward differences of the reference. For an axis
    tau dv/dt + v = K V the velocity and acceleration that it needs are Kv = 1/K and Ka = tau/K. The friction term rises linearly up to
    ``friction_speed``. V is kept within the converter's range, and the integral stops while it is not.

    Source: M. Tomizuka, Zero Phase Error Tracking Algorithm, J. Dyn. Syst. Meas. Control 109 (1987), introduction; Y. Altintas,
    Manufacturing Automation, 2nd ed. 2012, chapter 5. Left out: a filter on the derivative.
    """

    group = "controllers"

    reference = Input("m", doc="reference position")
    measured = Input("m", doc="measured position")
    reference_velocity = Input("m/s", default=MEASURE_FROM_REFERENCE, doc="reference velocity", shown=False)
    reference_acceleration = Input("m/s^2", default=MEASURE_FROM_REFERENCE, doc="reference acceleration", shown=False)
    correction = Input("V", default=0.0, doc="voltage added by a contour controller, before saturation")

    proportional = Parameter("V/m", 224.5, doc="proportional gain")
    integral = Parameter("V/(m*s)", 0.0, doc="integral gain")
    derivative_gain = Parameter("V*s/m", 0.0, doc="derivative gain")
    velocity_feedforward = Parameter("V*s/m", 0.0, doc="voltage per reference velocity")
    acceleration_feedforward = Parameter("V*s^2/m", 0.0, doc="voltage per reference acceleration")
    friction_feedforward = Parameter("V", 0.0, doc="voltage in the direction of the reference velocity")
    friction_speed = Parameter("m/s", 1e-6, low=1e-9, doc="reference speed up to which it rises")
    smallest_voltage = Parameter("V", -10.0, doc="lower end of the converter's range")
    largest_voltage = Parameter("V", 10.0, doc="upper end of the converter's range")

    held_error = DiscreteState("m", doc="error of this sample")
    error_sum = DiscreteState("m*s", doc="sum of errors times sample period")
    held_reference = DiscreteState("m", doc="reference of this sample")
    held_rate = DiscreteState("m/s", doc="reference velocity of this sample")
    samples = DiscreteState("1", doc="samples so far, at most two")

    error = Output("m", doc="measured position error")

    @staticmethod
    def update(
        reference: float, measured: float, reference_velocity: float, reference_acceleration: float, correction: float, proportional: float,
        integral: float, derivative_gain: float, velocity_feedforward: float, acceleration_feedforward: float, friction_feedforward: float,
        friction_speed: float, smallest_voltage: float, largest_voltage: float, held_error: float, error_sum: float, held_reference: float,
        held_rate: float, samples: float, sample_period: float,
    ) -> tuple[float, float, float, float, float, float]:  # fmt: skip
        error = reference - measured
        slope = (error - held_error) / sample_period if samples >= 1.0 else 0.0
        rate = reference_velocity
        if rate >= MEASURE_FROM_REFERENCE:
            rate = (reference - held_reference) / sample_period if samples >= 1.0 else 0.0
        change = reference_acceleration
        if change >= MEASURE_FROM_REFERENCE:
            change = (rate - held_rate) / sample_period if samples > _TWO else 0.0
        direction = within(rate / friction_speed, -1.0, 1.0)
        ahead = velocity_feedforward * rate + acceleration_feedforward * change + friction_feedforward * direction + correction
        voltage, total = limited_pid(
            proportional * error, derivative_gain * slope, ahead, integral, error_sum, error * sample_period, smallest_voltage,
            largest_voltage,
        )  # fmt: skip
        return voltage, error, total, reference, rate, samples + 1.0 if samples < _TWO else 2.0


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
        reference: float, axis_gain: float, time_constant: float, proportional: float, share: float, newest: float, second: float,
        third: float, started: float, sample_period: float,
    ) -> tuple[float, float, float, float, float, float]:  # fmt: skip
        if started < ON:
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
        return filtered


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
            wanted = within(plan[place] + change, -limit, limit)
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
        reference: float, measured: float, correction: float, axis_gain: float, time_constant: float, effort: float, observer: float,
        largest_voltage: float, plan: list[float], track: list[float], held_voltage: float, before: float, asked: float, asked_rate: float,
        speed: float, disturbance: float, samples: float, sample_period: float,
    ) -> tuple[float, float, float, float, float, float, float]:  # fmt: skip
        length = len(plan)
        a = math.exp(-sample_period / time_constant)
        b_v = axis_gain * (1.0 - a)
        b_x = axis_gain * (sample_period - time_constant * (1.0 - a))
        c = time_constant * (1.0 - a)
        if samples < 1.0:
            speed = 0.0
            before = measured
            asked = reference
        acting = held_voltage - disturbance
        predicted = before + c * speed + b_x * acting
        rate = (reference - asked) / sample_period
        bend = (rate - asked_rate) / sample_period if samples > _TWO else 0.0
        if samples >= 1.0:
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
        planned = _plan(plan, track, a, b_v, b_x, c, effort, largest_voltage)
        voltage = within(planned + correction, -largest_voltage, largest_voltage)
        return voltage, measured, reference, rate, now, disturbance, samples + 1.0 if samples < _TWO else 2.0

    @staticmethod
    def output(held_voltage: float, asked: float, before: float) -> tuple[float, float]:
        return held_voltage, asked - before


OUTPUTS = 2


def _squashed(value: float) -> float:
    """Return tanh, whose argument is kept where its last bit is 1 anyway."""
    if value > _SATURATED:
        return 1.0
    if value < -_SATURATED:
        return -1.0
    return math.tanh(value)


def regulated(weights: Any, first: float, second: float, third: float, place: int) -> float:
    """Return one output of the network: rows of kind 0 are hidden neurons, those of kind 1 the outputs, in this order.

    A row holds kind, bias, and the weights of what enters; that of a hidden neuron those with which it enters the outputs.
    """
    rows = len(weights)
    hidden = rows - OUTPUTS
    row = hidden + place
    total = weights[row][1] * 1.0
    if hidden == 0:
        return _squashed(total + weights[row][2] * first + weights[row][3] * second + weights[row][4] * third)
    for neuron in range(hidden):
        inside = weights[neuron][1] + weights[neuron][2] * first + weights[neuron][3] * second + weights[neuron][4] * third
        total = total + weights[neuron][5 + place] * _squashed(inside)
    return _squashed(total)


class NeuralRegulator(Component):
    """Gives two numbers in -1 .. 1 from a position and a contour error: a network with no or one hidden layer of tanh neurons.

        a = (x/s, z/s, E_k/e),   u = tanh(W a + b),   or   u = tanh(W2 tanh(W1 a + b1) + b2)

    The table ``weights`` is data that a lesson names under ``tables:``. A row is a neuron: kind (0 hidden, 1 output), bias, three
    weights of a, and for a hidden neuron the two weights W2 with which it enters the outputs. The last two rows are the outputs.

    Source: V. Lyubich, V. Frolov, V. Beliaev, Synthesis of the neural coordinated control algorithm for the model of CNC machine, figure 4;
    the tanh and the scales are assumed.
    """

    group = "controllers"

    example_tables: ClassVar[dict[str, list[list[float]]]] = {
        "weights": [[0.0, 0.1, 0.2, -0.1, 0.3, 0.5, -0.4], [1.0, 0.05, 0.0, 0.0, 0.0, 0.0, 0.0], [1.0, -0.05, 0.0, 0.0, 0.0, 0.0, 0.0]]
    }

    weights = Table("1", ("kind", "bias", "of_x", "of_z", "of_error", "to_x", "to_z"), doc="one row a neuron, the two outputs last")

    x_position = Input("m", doc="x position of the tool")
    z_position = Input("m", doc="z position of the tool")
    contour_error = Input("m", doc="contour error")

    position_scale = Parameter("m", 10.0, low=1e-9, doc="s: what counts as 1 of a position")
    error_scale = Parameter("m", 1.0, low=1e-12, doc="e: what counts as 1 of a contour error")
    share = Parameter("1", 1.0, low=0.0, high=10.0, doc="how much of the regulator acts; 0 leaves it out")

    x_regulator = Output("1", doc="u of the x axis")
    z_regulator = Output("1", doc="u of the z axis")

    @staticmethod
    def output(
        weights: Any, x_position: float, z_position: float, contour_error: float, position_scale: float, error_scale: float, share: float,
    ) -> tuple[float, float]:  # fmt: skip
        if share == 0.0 or len(weights) < OUTPUTS:
            return 0.0, 0.0
        first = x_position / position_scale
        second = z_position / position_scale
        third = contour_error / error_scale
        return share * regulated(weights, first, second, third, 0), share * regulated(weights, first, second, third, 1)
