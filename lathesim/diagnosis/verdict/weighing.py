"""How much of an error counts: weighed as forces and sensor noise of a fit's size are, above the floors of the sensors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lathesim.engine.assembly import FloatArray
from lathesim.identification.noise.noise_model import NoiseModel, carried_over
from lathesim.identification.records.fit import Fitted
from lathesim.identification.replay.experiment import Experiment


@dataclass(frozen=True)
class Weighing:
    """The noise models that weigh errors, one a channel: an error of force counts alike in every model."""

    noise: tuple[NoiseModel, ...]

    def error(self, experiment: Experiment, fitted: Fitted, white: FloatArray | None = None) -> FloatArray:
        """Return for each channel the squared error of a fit above the floor, in the band of the motion.

        ``white`` (channels,) is the power of what the sensors add to their floors, which is no error.
        """
        shapes = experiment.sensed.noise_shapes(fitted.by_name)
        added = np.zeros(len(shapes)) if white is None else white
        errors = []
        for row, shape, base, more in zip(fitted.residual, shapes, self.noise, added, strict=True):
            weight = carried_over(base, shape)
            whitened = weight.whiten(row)
            kept = slice(0, min(weight.band, len(weight.power)))
            floor = float(np.sum(2.0 * (shape.floor**2 + more) * shape.shapes[0][kept] / weight.power[kept]))
            errors.append(max(float(np.sum(whitened * whitened)) - floor, 1e-9))
        return np.array(errors)
