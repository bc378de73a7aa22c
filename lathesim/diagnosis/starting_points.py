"""Where a search begins for effects whose typical values say too little: their waves and their instants are read off the residual."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.fft import irfft, rfft

from lathesim.diagnosis.fit import Fitted
from lathesim.diagnosis.problem import Rig, commands
from lathesim.diagnosis.screening import is_limit
from lathesim.diagnosis.terms import Term
from lathesim.diagnosis.waves import wave_points
from lathesim.engine.assembly import FloatArray

_INSTANT = "instant"
_JUMPS = 2
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
_APART = 0.02
"""Share of a recording by which two instants lie apart."""


def starting_points(rig: Rig, fitted: Fitted, terms: list[Term]) -> dict[str, FloatArray]:
    """Give starting values (points, parameters) by term part for the effects that need them."""
    found = wave_points(rig, fitted, terms)
    jumps = [(instant, size) for row in fitted.residual for instant, size in strongest_jumps(row, rig.machine.assembly.sample_period)]
    for term in terms:
        names = [name.partition(".")[2] for name in term.parameters]
        if _INSTANT not in names or not jumps:
            continue
        points = np.tile(np.where(np.array(names) == _INSTANT, 0.0, term.points[0]), (len(jumps), 1))
        for point, (instant, size) in zip(points, jumps, strict=True):
            point[names.index(_INSTANT)] = instant
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


def behind(signal: FloatArray, other: FloatArray, most: int) -> int:
    """Give the samples, up to ``most`` either way, by which a signal (samples,) is behind another one: where their differences correlate
    best. Source: Knapp, Carter, The generalized correlation method for estimation of time delay, IEEE Trans. ASSP 24 (1976)."""
    first, second = (np.diff(np.nan_to_num(values)) for values in (signal, other))
    most = min(most, len(first) // 4)
    shifts = np.r_[0 : most + 1, -most:0]
    correlated = irfft(rfft(first, 2 * len(first)) * np.conj(rfft(second, 2 * len(first))))[shifts]
    # over what overlaps of both: the first one without its beginning and the second without its end, or the other way round
    powers = [np.r_[0.0, np.cumsum(values**2)] for values in (first, second)]
    ahead, after = np.maximum(shifts, 0), np.maximum(-shifts, 0)
    there = [(power[-1 - other] - power[own]) for power, own, other in zip(powers, (ahead, after), (after, ahead), strict=True)]
    return int(shifts[np.argmax(correlated / np.sqrt(np.maximum(there[0] * there[1], 1e-300)))])


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


def strongest_jumps(signal: FloatArray, period: float) -> list[tuple[float, float]]:
    """Give instant [s] and size of the strongest steps of a signal (samples,): the largest of the likelihood ratio over all instants.

    S(k) = (mean after k - mean before k)^2 k (n - k) / n. Source: Basseville, Nikiforov, Detection of Abrupt Changes, 1993, sec. 2.6.
    """
    samples = len(signal)
    count = np.arange(1, samples, dtype=float)
    total = np.cumsum(signal)
    before = total[:-1] / count
    after = (total[-1] - total[:-1]) / (samples - count)
    ratio = (after - before) ** 2 * count * (samples - count) / samples
    # a slow wander of the whole shows the step best in a short window on both sides
    width = max(2, samples // 100)
    near = np.convolve(signal, np.r_[np.ones(width), -np.ones(width)] / width, mode="same")
    found: list[tuple[float, float]] = []
    for strength, sizes in ((ratio, after - before), (near**2, near)):
        left = strength.copy()
        for _ in range(_JUMPS):
            place = int(np.argmax(left))
            # between two samples: at one of them, rounding would say on which side it is
            found.append((float((place + 0.5) * period), float(sizes[place])))
            left[max(0, place - int(_APART * samples)) : place + int(_APART * samples) + 1] = 0.0
    return found


def instants_of(names: Sequence[str]) -> list[str]:
    """Give those of some free names that are instants of a recording."""
    return [name for name in names if name.endswith(_INSTANT)]


def jump_at(instant: str) -> str:
    """Give the free name of what happens at an instant (a free name): ``second_jump`` at ``second_instant``."""
    return instant.removesuffix(_INSTANT) + "jump"
