"""Where a search begins for effects whose typical values say too little: their waves and their instants are read off the residual."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lathesim.component import Input
from lathesim.diagnosis.candidates.periodic_starts import wave_points
from lathesim.diagnosis.candidates.screening import is_limit
from lathesim.diagnosis.location import value_of
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.engine.assembly import FloatArray, Place
from lathesim.identification.records import INSTANT, Candidate, Fitted
from lathesim.identification.replay.experiment import Experiment
from lathesim.identification.roles import commands
from lathesim.identification.signal import behind, strongest_jumps
from lathesim.units import convertible


def starting_points(
    experiment: Experiment, fitted: Fitted, candidates: list[Candidate], method: Method = STANDARD
) -> dict[str, FloatArray]:
    """Return starting values (points, parameters) by candidate part for the effects that need them."""
    found = wave_points(experiment, fitted, candidates, method=method)
    jumps = [
        (instant, size) for row in fitted.residual for instant, size in strongest_jumps(row, experiment.machine.assembly.sample_period)
    ]
    for candidate in candidates:
        names = [Place.of(name).port for name in candidate.parameters]
        if INSTANT not in names or not jumps:
            continue
        points = np.tile(np.where(np.array(names) == INSTANT, 0.0, candidate.points[0]), (len(jumps), 1))
        for point, (instant, size) in zip(points, jumps, strict=True):
            point[names.index(INSTANT)] = instant
            for place, name in enumerate(names):
                if name in candidate.effect.neutral:
                    point[place] = size
        found[candidate.part] = np.clip(points, candidate.low, candidate.high)
    return (
        found
        | limit_points(experiment, candidates)
        | frequency_points(experiment, candidates, method=method)
        | _late_points(experiment, fitted, candidates)
    )


def _late_points(experiment: Experiment, fitted: Fitted, candidates: Sequence[Candidate]) -> dict[str, FloatArray]:
    """Return starting values for what makes a reading late: beside the usual ones that by which the recording is behind the simulation, up
    to a tenth of a second, or by which it falls behind in time. A staircase that is late by half a step is as near as one that is late by
    two."""
    period, seconds = experiment.machine.assembly.sample_period, {sight.row for sight in experiment.sensed.redundant_sensors}
    simulated = experiment.sensed.seen - fitted.residual
    found: dict[str, FloatArray] = {}
    for candidate in candidates:
        late = f"{candidate.part}.{candidate.effect.identification.delay or candidate.effect.identification.whole_samples}"
        if late not in candidate.parameters or not len(candidate.points):
            continue
        rows = [
            row for row, name in enumerate(experiment.machine.compare) if candidate.at in (name, Place.of(name).part) and row not in seconds
        ]
        column, is_time = candidate.parameters.index(late), experiment.sensed.plan.unit(late) == "s"
        how_late, most = behind if is_time else _falling_behind, round(0.1 / period)
        lags = np.array([how_late(experiment.sensed.seen[row], simulated[row], most) for row in rows])
        # what is held and then delayed is read that many samples late from one sample less on
        lags = lags - 0.5 * np.sign(lags) if candidate.effect.identification.whole_samples else lags
        points = np.tile(np.median(candidate.points, axis=0), (len(lags), 1))
        points[:, column] = period * lags if is_time else lags
        points = points[points[:, column] != 0.0]
        if len(points):
            found[candidate.part] = np.clip(np.vstack([points, candidate.points]), candidate.low, candidate.high)
    return found


def _falling_behind(signal: FloatArray, other: FloatArray, most: int) -> float:
    """Return by how many samples a sample a signal falls behind another one: its second half is behind by more than its first."""
    half = len(signal) // 2
    first, second = (behind(signal[part], other[part], most) for part in (slice(half), slice(half, None)))
    return (second - first) / half


def frequency_points(experiment: Experiment, candidates: Sequence[Candidate], method: Method = STANDARD) -> dict[str, FloatArray]:
    """Return starting values for resonances: frequencies so close together that one is in the valley, its other values usual.

    A link that bends is softer than a screw is: the lowest frequency is the one that the recording shows a few times.
    """
    period = experiment.machine.assembly.sample_period
    # five samples a swing, and four swings within the recording
    fastest, slowest = 0.2 / period, 4.0 / (period * len(experiment.record))
    found: dict[str, FloatArray] = {}
    for candidate in candidates:
        resonance = f"{candidate.part}.{candidate.effect.identification.resonance}"
        if resonance not in candidate.parameters or not len(candidate.points):
            continue
        column = candidate.parameters.index(resonance)
        usual_low, high = float(candidate.least[column]), min(float(candidate.usual[column]), fastest)
        low = min(usual_low, max(slowest, usual_low / method.sizes.largest, float(candidate.low[column])))
        if high > usual_low:
            # a small one and a large one of the other values; ten frequencies within the usual range
            usual = np.quantile(candidate.points, (0.3, 0.85), axis=0)
            many = round(10 * np.log(high / low) / np.log(high / usual_low))
            points = np.repeat(usual, many, axis=0)
            points[:, column] = np.tile(np.geomspace(low, high, many), len(usual))
            found[candidate.part] = np.clip(points, candidate.low, candidate.high)
    return found


def limit_points(experiment: Experiment, candidates: Sequence[Candidate]) -> dict[str, FloatArray]:
    """Return starting values for limits of a command, or of its rate, where the command of this recording comes to: a limit that is never
    reached does nothing, and one that is usual on another machine may be never reached here."""
    found: dict[str, FloatArray] = {}
    channels, sources = experiment.sensed.plan.channels, commands(experiment.sensed.plan.assembly)
    for candidate in candidates:
        limits, source = np.flatnonzero(is_limit(candidate)), sources.get(candidate.at, "")
        if candidate.effect.site != "drive" or len(limits) != 1 or len(candidate.parameters) != 1 or source not in channels:
            continue
        command = np.nan_to_num(experiment.sensed.channel([], [], channels.index(source)))
        of_rate = not convertible(*(experiment.sensed.plan.unit(name) for name in (candidate.parameters[0], source)))
        induced = _induced(experiment, candidate)
        size = np.abs(np.diff(command) / experiment.machine.assembly.sample_period if of_rate else command - induced)
        largest = float(size.max(initial=0.0))
        if of_rate:
            # a command in steps says nothing of how long its ramps take: from a sample to the whole recording
            least = float(np.ptp(command)) / (len(command) * experiment.machine.assembly.sample_period)
            reached = np.geomspace(least, largest, 12) if least else size[:0]
        elif np.any(induced):
            # what a motor could not follow has commands grow far beyond what drove it; beside another effect a level that is a tenth
            # off leads nowhere, as its error adds up over the way
            reached = np.geomspace(0.01, 1.0, 48) * largest
        else:
            # a command in steps is at its largest for long
            reached = np.r_[np.quantile(size, (0.995, 0.98, 0.95, 0.85)), np.array([0.9, 0.75, 0.6, 0.45]) * largest]
        found[candidate.part] = np.clip(np.unique(reached[reached > 0.0])[::-1, None], candidate.low, candidate.high)
    return found


def _induced(experiment: Experiment, candidate: Candidate) -> FloatArray | float:
    """Return what of a command the recorded motion takes up (samples,), for an effect that limits the rest of it; nothing for others."""
    plan, role = experiment.sensed.plan, "back_emf"
    host = next(part for part in experiment.machine.assembly.parts if part.name == Place.of(candidate.at).part)
    ports = host.component.ports
    if role not in candidate.effect.declared(Input) or role not in ports or "flow" not in ports:
        return 0.0
    sources = {wire.target: wire.source for wire in experiment.machine.assembly.wires}
    flow = f"{host.name}.{ports['flow']}"
    velocity = experiment.motion.get(sources.get(flow, flow))
    return 0.0 if velocity is None else value_of(plan, host.name, ports[role], {}) * velocity
