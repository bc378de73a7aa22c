"""Where a search begins for effects whose typical values say too little: their waves and their instants are read off the residual."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lathesim.diagnosis.candidates.periodic_starts import wave_points
from lathesim.diagnosis.candidates.screening import is_limit
from lathesim.engine.assembly import FloatArray
from lathesim.identification.machine.roles import commands
from lathesim.identification.records.candidate import INSTANT, Term
from lathesim.identification.records.fit import Fitted
from lathesim.identification.replay.experiment import Rig
from lathesim.identification.signal.analysis import behind, strongest_jumps

_FREQUENCIES = 10
_SMALL_AND_LARGE = (0.3, 0.85)
"""Quantiles of the usual values of a resonance."""
_FASTEST = 0.2
"""Cycles a sample up to which a resonance is looked for."""
_REACHED = (0.995, 0.98, 0.95, 0.85)
"""Shares of the samples in which a command is below where a limit is looked for ..."""
_OF_LARGEST = (0.9, 0.75, 0.6, 0.45)
"""... and shares of its largest value: a command in steps is at its largest for long."""
_LATEST = 0.1
"""The latest that a reading is looked for [s]."""


def starting_points(rig: Rig, fitted: Fitted, terms: list[Term]) -> dict[str, FloatArray]:
    """Give starting values (points, parameters) by term part for the effects that need them."""
    found = wave_points(rig, fitted, terms)
    jumps = [(instant, size) for row in fitted.residual for instant, size in strongest_jumps(row, rig.machine.assembly.sample_period)]
    for term in terms:
        names = [name.partition(".")[2] for name in term.parameters]
        if INSTANT not in names or not jumps:
            continue
        points = np.tile(np.where(np.array(names) == INSTANT, 0.0, term.points[0]), (len(jumps), 1))
        for point, (instant, size) in zip(points, jumps, strict=True):
            point[names.index(INSTANT)] = instant
            for place, name in enumerate(names):
                if name in term.effect.neutral:
                    point[place] = size
        found[term.part] = np.clip(points, term.low, term.high)
    return found | limit_points(rig, terms) | _frequency_points(rig, terms) | _late_points(rig, fitted, terms)


def _late_points(rig: Rig, fitted: Fitted, terms: Sequence[Term]) -> dict[str, FloatArray]:
    """Give starting values for what makes a reading late: beside the usual ones that by which the recording is behind the simulation. A
    staircase that is late by half a step is as near as one that is late by two."""
    period, seconds = rig.machine.assembly.sample_period, {sight.row for sight in rig.sensed.second_sight}
    simulated = rig.sensed.seen - fitted.residual
    found: dict[str, FloatArray] = {}
    for term in terms:
        late = f"{term.part}.{term.effect.late_by or term.effect.in_samples}"
        if late not in term.parameters or rig.sensed.plan.unit(late) != "s" or not len(term.points):
            continue
        rows = [row for row, name in enumerate(rig.machine.compare) if term.at in (name, name.partition(".")[0]) and row not in seconds]
        column = term.parameters.index(late)
        samples = np.array([behind(rig.sensed.seen[row], simulated[row], round(_LATEST / period)) for row in rows])
        # what is held and then delayed is read that many samples late from one sample less on
        lags = period * (samples - 0.5 * np.sign(samples) if term.effect.in_samples else samples)
        points = np.tile(np.median(term.points, axis=0), (len(lags), 1))
        points[:, column] = lags
        points = points[points[:, column] != 0.0]
        if len(points):
            found[term.part] = np.clip(np.vstack([points, term.points]), term.low, term.high)
    return found


def _frequency_points(rig: Rig, terms: Sequence[Term]) -> dict[str, FloatArray]:
    """Give starting values for resonances: frequencies so close together that one is in the valley, its other values usual."""
    fastest = _FASTEST / rig.machine.assembly.sample_period
    found: dict[str, FloatArray] = {}
    for term in terms:
        resonance = f"{term.part}.{term.effect.resonance}"
        if resonance not in term.parameters or not len(term.points):
            continue
        column = term.parameters.index(resonance)
        low, high = float(term.least[column]), min(float(term.usual[column]), fastest)
        if high > low:
            usual = np.quantile(term.points, _SMALL_AND_LARGE, axis=0)
            points = np.repeat(usual, _FREQUENCIES, axis=0)
            points[:, column] = np.tile(np.geomspace(low, high, _FREQUENCIES), len(usual))
            found[term.part] = np.clip(points, term.low, term.high)
    return found


def limit_points(rig: Rig, terms: Sequence[Term]) -> dict[str, FloatArray]:
    """Give starting values for limits of a command, or of its rate, where the command of this recording comes to: a limit that is never
    reached does nothing, and one that is usual on another machine may be never reached here."""
    found: dict[str, FloatArray] = {}
    channels, sources = rig.sensed.plan.channels, commands(rig.sensed.plan.assembly)
    for term in terms:
        limits, source = np.flatnonzero(is_limit(term)), sources.get(term.at, "")
        if term.effect.site != "drive" or len(limits) != 1 or len(term.parameters) != 1 or source not in channels:
            continue
        command = np.nan_to_num(rig.sensed.channel([], [], channels.index(source)))
        if rig.sensed.plan.unit(term.parameters[0]).endswith("/s"):
            command = np.diff(command) / rig.machine.assembly.sample_period
        size = np.abs(command)
        reached = np.r_[np.quantile(size, _REACHED), np.array(_OF_LARGEST) * size.max(initial=0.0)]
        found[term.part] = np.clip(np.unique(reached[reached > 0.0])[::-1, None], term.low, term.high)
    return found
