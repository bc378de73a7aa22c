"""The weights of a small network: the table of a NeuralRegulator, and the vector a search moves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lathesim.engine.assembly import FloatArray
from lathesim.errors import LessonError

INPUTS, OUTPUTS, COLUMNS = 3, 2, 7
FIRST_RANGE = 0.1
"""Weights and biases begin evenly within this much of zero (as published)."""
MOST_HIDDEN = 64
"""Hidden neurons of a network that a control computes within a sample, and whose weights a search can find (assumed)."""


@dataclass(frozen=True)
class Shape:
    """A network with no or one hidden layer: ``hidden`` neurons, 0 for none."""

    hidden: int

    def __post_init__(self) -> None:
        if not 0 <= self.hidden <= MOST_HIDDEN:
            weights = self.hidden * (INPUTS + 1 + OUTPUTS) + OUTPUTS
            fact = f"a network with {self.hidden} hidden neurons has {weights} weights, too many to be found or computed in a sample."
            raise LessonError(fact, remedy=f"Use 0 to {MOST_HIDDEN} hidden neurons.")

    @property
    def weights(self) -> int:
        """How many numbers a search moves."""
        return self.hidden * (INPUTS + 1 + OUTPUTS) + OUTPUTS if self.hidden else OUTPUTS * (INPUTS + 1)

    def table(self, vector: FloatArray) -> FloatArray:
        """Return the table of a NeuralRegulator for a vector of weights."""
        rows = np.zeros((self.hidden + OUTPUTS, COLUMNS))
        rows[self.hidden :, 0] = 1.0
        if self.hidden:
            rows[: self.hidden, 1:] = vector[:-OUTPUTS].reshape(self.hidden, -1)
            rows[self.hidden :, 1] = vector[-OUTPUTS:]
        else:
            rows[:, 1 : 2 + INPUTS] = vector.reshape(OUTPUTS, -1)
        return rows

    def start(self, rng: np.random.Generator) -> FloatArray:
        """Return weights to begin with."""
        return rng.uniform(-FIRST_RANGE, FIRST_RANGE, self.weights)
