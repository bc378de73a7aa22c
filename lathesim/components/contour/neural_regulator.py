"""A small neural network in the loop, whose weights are data."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from lathesim.component import Component, Input, Output, Parameter, Table

OUTPUTS = 2


def _squashed(value: float) -> float:
    """Return tanh, whose argument is kept where its last bit is 1 anyway."""
    if value > 20.0:
        return 1.0
    if value < -20.0:
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
        weights: Any,
        x_position: float,
        z_position: float,
        contour_error: float,
        position_scale: float,
        error_scale: float,
        share: float,
    ) -> tuple[float, float]:
        """One pass forward."""
        if share == 0.0 or len(weights) < OUTPUTS:
            return 0.0, 0.0
        first = x_position / position_scale
        second = z_position / position_scale
        third = contour_error / error_scale
        return share * regulated(weights, first, second, third, 0), share * regulated(weights, first, second, third, 1)
