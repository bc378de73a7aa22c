"""Doubts held against replicates: which of them the fitted model, its converters and its noise make by themselves.

Each statistic of what is left is standardised over the replicates, and the recording's is held against the largest of all statistics in
each replicate, so that many tests raise no more false alarms than one:

    p_k = (1 + number of replicates whose largest statistic reaches that of the recording) / (1 + number of replicates)

Sources: P. H. Westfall, S. S. Young, Resampling-Based Multiple Testing (1993), section 2.3 (single-step maximum); A. Gelman, X.-L. Meng,
H. Stern, Statistica Sinica 6 (1996), 733-807 (the check itself).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize_scalar

from lathesim.diagnosis.location.command_coherence import coherent_share
from lathesim.diagnosis.location.dependence import bars
from lathesim.diagnosis.location.missing_force import missing_signal
from lathesim.diagnosis.location.missing_share import missing_share
from lathesim.diagnosis.location.narrow_band import band_strengths
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.records.condition import Kind
from lathesim.engine.assembly import FloatArray
from lathesim.identification.estimation.least_squares import noise_of
from lathesim.identification.machine.roles import decides
from lathesim.identification.records.fit import Fitted
from lathesim.identification.records.model import Model
from lathesim.identification.replay.experiment import Experiment
from lathesim.identification.replay.replicates import Load, Replicates, replicates
from lathesim.identification.signal.analysis import root_mean_square

BAND, COHERENCE = "narrow band", "coherence with the command"
DEPENDENCE, SENSORS = "dependence on the motion", "redundant sensors"
Statistics = dict[tuple[str, str], float]
"""Kind of test and channel, of a band with its octave -> its statistic."""


@dataclass(frozen=True)
class CalibratedDoubts:
    """The adjusted probability of each test statistic under the fitted model: (kind, channel) -> p; ``replicates`` that were simulated."""

    probability: Mapping[tuple[str, str], float]
    replicates: int


def calibrated_doubts(experiment: Experiment, validation: Experiment, model: Model, method: Method = STANDARD) -> CalibratedDoubts | None:
    """Return the probabilities under a model of narrow bands, of coherence with the command, of what goes with the motion, and of sensors
    that differ; none where it cannot be simulated, or where the time is over."""
    number, finer = method.verdict.replicates, float(method.verdict.finer_steps)
    fits = ((experiment, model.fitted), (validation, model.validation_fit))
    told = _told_by_motion((experiment, validation), (model.fitted, model.validation_fit), effects=bool(model.candidates), method=method)
    made = [
        replicates(
            one, model.candidates, fitted.by_name, _loads(one, fitted, told), number, seed, _noise(one, fitted), finer,
            _errors(one, model, method),
        )
        for seed, (one, fitted) in enumerate(fits)
    ]  # fmt: skip
    count = min(len(one.drawn) for one in made)
    if count < number:
        return None
    fitted = model.fitted, model.validation_fit
    recorded = _statistics((made[0].own, made[1].own), made, fitted, method)
    drawn = []
    for first, second in zip(made[0].drawn, made[1].drawn, strict=True):
        if method.ends.is_over:
            return None
        drawn.append(_statistics((first, second), made, fitted, method))
    return CalibratedDoubts(adjusted(recorded, drawn, method), count)


def adjusted(recorded: Statistics, drawn: list[Statistics], method: Method = STANDARD) -> dict[tuple[str, str], float]:
    """Return the adjusted probability of each statistic by the maximum over all of them.

    Each of them, the recording too, is standardised by all others, as what is alike for a sound machine has to be treated alike: with the
    recording by the replicates and these by themselves, two alarms in a hundred became five. The spread is that of the upper half, else a
    statistic with a long tail would be the largest of all most of the time.
    """
    names = list(recorded)
    table = np.array([[one[name] for name in names] for one in (recorded, *drawn)])
    scores = np.array([_standardised(row, np.delete(table, place, axis=0), method) for place, row in enumerate(table)])
    largest = scores[1:].max(axis=1)
    return {name: float(1 + np.count_nonzero(largest >= score)) / len(table) for name, score in zip(names, scores[0], strict=True)}


def _standardised(row: FloatArray, others: FloatArray, method: Method) -> FloatArray:
    """Return how far statistics (statistics,) lie above the median of others (rows, statistics), in spreads of their upper half; what is
    less than the integration steps make counts as no spread: a statistic that is mostly nothing would else be infinitely far out."""
    middle = np.median(others, axis=0)
    above = np.maximum(others - middle, 0.0)
    spread = np.maximum(np.sqrt(2.0 * np.mean(above**2, axis=0)), method.location.integration_error)
    return np.asarray((row - middle) / spread)


def _statistics(pair: tuple[Experiment, Experiment], made: list[Replicates], fitted: tuple[Fitted, Fitted], method: Method) -> Statistics:
    """Return the statistics of a recording and its validation, or of a replicate of both."""
    found: Statistics = {}
    left: list[Fitted] = []
    for one, of, known in zip(pair, made, fitted, strict=True):
        residual = one.sensed.one({name: of.values[name] for name in one.sensed.settable(of.values)})
        noise = noise_of(residual, of.own.sensed.noise_shapes(of.values))
        # the machine of a replicate knows the values of its own effects alone, and not those that an effect left behind
        nothing = np.zeros(0)
        left.append(replace(known, free=(), values=nothing, constant=of.values, residual=residual, noise=noise))
        seconds = one.sensed.samples * one.machine.assembly.sample_period
        controllers = {part.name for part in one.machine.assembly.parts if decides(part.component)}
        for row, channel in enumerate(one.machine.compare):
            if channel.partition(".")[0] in controllers:
                continue
            for octave, strength in band_strengths(channel, residual[row], noise[row], seconds, method).items():
                found[BAND, octave] = max(found.get((BAND, octave), 0.0), strength)
    for channel, share in coherent_share(pair, (made[0].values, made[1].values), method).items():
        found[COHERENCE, channel] = share
    return found | _motion_and_sensors(pair, (left[0], left[1]), effects=bool(made[0].own.candidates), method=method)


def _motion_and_sensors(pair: tuple[Experiment, Experiment], left: tuple[Fitted, Fitted], *, effects: bool, method: Method) -> Statistics:
    """Return how much of what acts is missing behind each channel and goes with the motion, on the second experiment as learned on the
    first, and how far redundant sensors differ there, in resolutions."""
    found: Statistics = {}
    explained = _told_by_motion(pair, left, effects=effects, method=method)
    for row, channel in enumerate(pair[1].machine.compare):
        share, _ = missing_share(pair[1], left[1], row)
        found[DEPENDENCE, channel] = share * float(np.sqrt(explained.get(channel, 0.0))) if np.isfinite(share) else 0.0
    for sight in (sight for sight in pair[1].sensed.redundant_sensors if not sight.rate):
        apart = root_mean_square(left[1].residual[sight.row])
        found[SENSORS, pair[1].machine.compare[sight.row]] = apart / pair[1].sensed.seen_floors[sight.row]
    return found


def _told_by_motion(pair: tuple[Experiment, Experiment], left: tuple[Fitted, Fitted], *, effects: bool, method: Method) -> dict[str, float]:
    """Return the share of what is missing behind each channel that the variable tells which tells most."""
    explained: dict[str, float] = {}
    for bar in bars(pair[0], left[0], pair[1], left[1], method=method):
        if not effects or bar.kind is not Kind.TOGETHER:
            explained[bar.channel] = max(explained.get(bar.channel, 0.0), bar.share)
    return explained


def _errors(experiment: Experiment, model: Model, method: Method) -> dict[str, float]:
    """Return by how much the laws of the lesson and of the effects may be wrong, one standard deviation of each value that stands for one:
    the values that the lesson calls uncertain, and the sizes of effects.

    What a law leaves where its form is wrong is drawn as what it leaves where its size is. Source: M. C. Kennedy, A. O'Hagan, J. R. Stat.
    Soc. B 63 (2001), 425-464 (a model has a discrepancy, declared before the data are looked at). Left out: refitting to each replicate.
    """
    values, verdict = model.fitted.by_name, method.verdict
    errors = {name: verdict.law_error * abs(values[name]) for name in experiment.machine.uncertain if name in values}
    for candidate in model.candidates:
        sizes = [name for name in candidate.parameters if name.partition(".")[2] in candidate.effect.neutral]
        errors |= {name: verdict.form_error * abs(values[name]) for name in sizes}
    return errors


def _noise(experiment: Experiment, fitted: Fitted) -> dict[str, float]:
    """Return the noise of each channel, one standard deviation: what a fit leaves from one sample to the next, at most the floor.

    The floor is what the recorded values themselves change from one sample to the next, and holds what the loop makes of its counts.
    """
    steps = np.sqrt(np.nanmean(np.square(np.diff(fitted.residual, axis=1)), axis=1) / 2.0)
    return {name: min(experiment.floors[name], float(step)) for name, step in zip(experiment.machine.compare, steps, strict=True)}


def _loads(experiment: Experiment, fitted: Fitted, told: Mapping[str, float]) -> list[Load]:
    """Return what acts beside the drives as far as it is missing: as large, and as slow, as what the fit leaves at each moving part, less
    the share that the motion has ``told`` (channel -> share): a load goes with nothing."""
    found: dict[str, Load] = {}
    shapes = experiment.sensed.noise_shapes(fitted.by_name)
    for row, name in enumerate(experiment.machine.compare):
        missing = missing_signal(experiment, fitted, row)
        if missing.at == name or missing.at in found:
            continue
        deviation, corner = first_order_noise(missing.values, experiment.sensed.period, shapes[row].band)
        found[missing.at] = Load(missing.at, deviation * float(np.sqrt(max(1.0 - told.get(name, 0.0), 0.0))), corner)
    return list(found.values())


def first_order_noise(values: FloatArray, period: float, band: int) -> tuple[float, float]:
    """Return standard deviation and corner [Hz] of the first-order noise whose spectrum is most likely that of some values (samples,), of
    which only the first ``band`` lines are known.

    A load goes on above the band in which a motion shows it, and its power there is found from its shape below. Source: P. Whittle, Arkiv
    for Matematik 2 (1953), 423-434 (likelihood of a spectrum).
    """
    power = np.abs(np.fft.rfft(values))[1 : max(band, 3)] ** 2 / len(values)
    if not np.any(power > 0.0):
        return 0.0, 1.0 / period
    angle = 2.0 * np.pi * np.arange(1, 1 + len(power)) / len(values)

    def shape(logarithm: float) -> FloatArray:
        kept = np.exp(-2.0 * np.pi * np.exp(logarithm) * period)
        return np.asarray((1.0 - kept * kept) / np.abs(1.0 - kept * np.exp(-1j * angle)) ** 2)

    def unlikely(logarithm: float) -> float:
        lines = shape(logarithm)
        return float(np.log(np.mean(power / lines)) + np.mean(np.log(lines)))

    lowest, highest = np.log(angle[0] / (2.0 * np.pi * period)), np.log(0.5 / period)
    found = float(minimize_scalar(unlikely, bounds=(lowest, highest), method="bounded").x)
    return float(np.sqrt(np.mean(power / shape(found)))), float(np.exp(found))
