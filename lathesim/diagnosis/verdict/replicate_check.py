"""Doubts held against replicates: which of them the fitted model, its converters and its noise make by themselves.

Each statistic of what is left is standardised over the replicates, and the recording's is held against the largest of all statistics in
each replicate, so that many tests raise no more false alarms than one:

    p_k = (1 + number of replicates whose largest statistic reaches that of the recording) / (1 + number of replicates)

Sources: P. H. Westfall, S. S. Young, Resampling-Based Multiple Testing (1993), section 2.3 (single-step maximum); A. Gelman, X.-L. Meng,
H. Stern, Statistica Sinica 6 (1996), 733-807 (the check itself).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from lathesim.diagnosis.location.command_coherence import coherent_share
from lathesim.diagnosis.location.missing_force import missing_signal
from lathesim.diagnosis.location.narrow_band import band_strength
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.engine.assembly import FloatArray
from lathesim.identification.estimation.least_squares import noise_of
from lathesim.identification.machine.roles import decides
from lathesim.identification.records.fit import Fitted
from lathesim.identification.records.model import Model
from lathesim.identification.replay.experiment import Experiment
from lathesim.identification.replay.replicates import Load, Replicates, replicates

BAND, COHERENCE = "narrow band", "coherence with the command"
Statistics = dict[tuple[str, str], float]
"""Kind of test and channel -> its statistic."""


@dataclass(frozen=True)
class CalibratedDoubts:
    """The adjusted probability of each test statistic under the fitted model: (kind, channel) -> p; ``replicates`` that were simulated."""

    probability: Mapping[tuple[str, str], float]
    replicates: int


def calibrated_doubts(experiment: Experiment, validation: Experiment, model: Model, method: Method = STANDARD) -> CalibratedDoubts | None:
    """Return the probabilities of narrow bands and of coherence with the command under a model; none where it cannot be simulated."""
    number = int(method.verdict.replicates)
    fits = ((experiment, model.fitted), (validation, model.validation_fit))
    made = [
        replicates(one, model.candidates, fitted.by_name, _loads(one, fitted), number, seed)
        for seed, (one, fitted) in enumerate(fits)
    ]  # fmt: skip
    count = min(len(one.drawn) for one in made)
    if count < number:
        return None
    recorded = _statistics((made[0].own, made[1].own), made, method)
    drawn = [_statistics((first, second), made, method) for first, second in zip(made[0].drawn, made[1].drawn, strict=True)]
    return CalibratedDoubts(adjusted(recorded, drawn), count)


def adjusted(recorded: Statistics, drawn: list[Statistics]) -> dict[tuple[str, str], float]:
    """Return the adjusted probability of each statistic by the maximum over all of them."""
    names = list(recorded)
    table = np.array([[one[name] for name in names] for one in drawn])
    middle, spread = table.mean(axis=0), np.maximum(table.std(axis=0), 1e-12 + 1e-6 * np.abs(table.mean(axis=0)))
    largest = ((table - middle) / spread).max(axis=1)
    scores = {name: (recorded[name] - middle[place]) / spread[place] for place, name in enumerate(names)}
    return {name: float(1 + np.count_nonzero(largest >= score)) / (1 + len(drawn)) for name, score in scores.items()}


def _statistics(pair: tuple[Experiment, Experiment], made: list[Replicates], method: Method) -> Statistics:
    """Return the statistics of a recording and its validation, or of a replicate of both."""
    found: Statistics = {}
    for one, of in zip(pair, made, strict=True):
        residual = one.sensed.one({name: of.values[name] for name in one.sensed.settable(of.values)})
        noise = noise_of(residual, of.own.sensed.noise_shapes(of.values))
        controllers = {part.name for part in one.machine.assembly.parts if decides(part.component)}
        for row, channel in enumerate(one.machine.compare):
            if channel.partition(".")[0] in controllers:
                continue
            strength = band_strength(residual[row], noise[row], method)
            found[BAND, channel] = max(found.get((BAND, channel), 0.0), strength)
    for channel, share in coherent_share(pair, (made[0].values, made[1].values)).items():
        found[COHERENCE, channel] = share
    return found


def _loads(experiment: Experiment, fitted: Fitted) -> list[Load]:
    """Return what acts beside the drives as far as it is missing: as large, and as slow, as what the fit leaves at each moving part."""
    found: dict[str, Load] = {}
    for row, name in enumerate(experiment.machine.compare):
        missing = missing_signal(experiment, fitted, row)
        if missing.at == name or missing.at in found:
            continue
        values = missing.values - float(np.mean(missing.values))
        found[missing.at] = Load(missing.at, float(np.std(values)), _corner(values, experiment.sensed.period))
    return list(found.values())


def _corner(values: FloatArray, period: float) -> float:
    """Return the corner of first-order noise whose next sample is as alike as that of some values (samples,) [Hz]."""
    power = float(values @ values)
    alike = float(values[1:] @ values[:-1]) / power if power > 0.0 else 0.0
    return float(-np.log(np.clip(alike, 1e-6, 1.0 - 1e-6)) / (2.0 * np.pi * period))
