"""How sure each effect is, what it is tied with, and how much of the error a model removes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from lathesim.diagnosis.explaining.chance import unresolved
from lathesim.diagnosis.explaining.study import Study
from lathesim.diagnosis.records.ranked_effect import RankedEffect
from lathesim.diagnosis.records.search import Found
from lathesim.engine.assembly import FloatArray
from lathesim.identification.noise.noise_model import NoiseModel, carried_over, white_noise
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.records.fit import Fitted
from lathesim.identification.replay.experiment import Experiment


def ranked(study: Study, found: Found) -> list[RankedEffect]:
    """Return how sure each effect is: the probability of its explanation among its rivals, and those that predict as well."""
    result = []
    for candidate in (one for one in found.model.candidates if one.part not in found.there_before):
        worth, rivals = found.worth.get(candidate.part), found.rivals.get(candidate.part, ())
        if worth is None:
            result.append(RankedEffect(candidate, 0.5, (), math.nan))
            continue
        behind = [max(0.0, worth.predicted.nats - one.predicted.nats) for one in rivals]
        scale = unresolved(worth.predicted, 0.0, study.method)
        probability = 1.0 / (1.0 + sum(math.exp(-one / scale) for one in behind))
        tied = tuple(one.candidate for one in rivals)
        tied += tuple(one for one in study.estimation.one_sided if one.at == candidate.at and is_told_by_direction(candidate, one))
        result.append(RankedEffect(candidate, float(probability), tied, worth.predicted.share))
    return sorted(result, key=lambda one: -found.worth[one.candidate.part].predicted.nats if one.candidate.part in found.worth else np.inf)


def is_told_by_direction(candidate: Candidate, other: Candidate) -> bool:
    """Return whether a candidate is told from another only by how both act in two directions: it is refined by that, or repeats like it
    and acts at the same port."""
    alike = (candidate.effect.family, candidate.effect.site) == (other.effect.family, other.effect.site)
    return candidate.name in other.effect.identification.generalises or (alike and candidate.effect.identification.periodic is True)


def removed_share(experiment: Experiment, before: Fitted, after: Fitted) -> float:
    """Return the share of a recording's error, above its floor and in the band of the motion, that one fit removes of another's.

    It is weighed as forces and sensor noise of the size of the first are, as in the search: what loads add up to over a recording, a metre
    or a turn that no model could know, does not outweigh what an effect does. White noise of a sensor beyond its floor, as it is left
    after, is nothing that a model could remove.
    """
    weighing = Weighing(before.noise)
    shapes = experiment.sensed.noise_shapes(after.by_name)
    white = np.array([white_noise(row, shape) for row, shape in zip(after.residual, shapes, strict=True)])
    error, left = (float(weighing.error(experiment, fitted, white).sum()) for fitted in (before, after))
    return 1.0 - left / error if error > 0.0 else 0.0


@dataclass(frozen=True)
class Weighing:
    """How much of an error counts: weighed as forces and sensor noise of a fit's size are, one noise model a channel."""

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
