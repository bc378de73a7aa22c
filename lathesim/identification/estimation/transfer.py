"""A fitted model on another recording: what belongs to a recording is fitted anew there, the rest is as it is."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from lathesim.engine.assembly import Place
from lathesim.identification.estimation.least_squares import ROUGH, fit
from lathesim.identification.noise import whitened
from lathesim.identification.records import QUARTER_TURNS, Candidate, Fitted, Free, instants_of, is_full_band, jump_at, with_start
from lathesim.identification.replay.experiment import Experiment
from lathesim.identification.signal import strongest_jumps

_FINE_TURNS = tuple(2.0 * np.pi * place / 36 for place in range(36))
"""A slot may be a twentieth of a turn."""
_NEARBY = range(-2, 3)
"""Samples by which a step may be off where it seems to be."""
_SOME_TIME, _LONG_AGO = 0.1, 100.0
"""Shares of its duration that make a step of the time before a recording, and the longest."""
_VAGUE = 0.02
"""A value whose standard error is a larger share of it than this is left open by a recording."""


def begun_anew(experiment: Experiment, candidates: Sequence[Candidate]) -> list[Free]:
    """Return what is free where another recording starts: states, and what effects remember of before, as an edge that was worn."""
    duration = len(experiment.record) * experiment.machine.assembly.sample_period
    unit = experiment.sensed.plan.unit
    before = []
    for name in (name for candidate in candidates for name in candidate.remembered):
        # in seconds as a share of what the recording lasts, else as a share of all that may be
        step, most = (_SOME_TIME * duration, _LONG_AGO * duration) if unit(name) == "s" else (_SOME_TIME, 1.0)
        before.append(Free(name, 0.0, step, 0.0, most))
    return [*experiment.start_states(experiment.sensed.plan), *before]


def transferred(experiment: Experiment, fitted: Fitted, candidates: Sequence[Candidate]) -> Fitted:
    """Return a fitted model on another recording: start values and nuisance parameters fitted anew, the rest as it is."""
    nuisance = {name for candidate in candidates for name in candidate.nuisance}
    free, constant = _freed(experiment, fitted, candidates, nuisance)
    free = _phases_turned(experiment, free, constant, candidates, nuisance)
    events = {name for candidate in candidates for name in instants_of(candidate)}
    instants = [item.name for item in free if item.name in nuisance and item.name in events]
    if instants:
        free = _at_the_best_instant(experiment, free, constant, candidates, instants)
        # known to the sample now: a descent would only move them off it
        constant |= {item.name: item.start for item in free if item.name in instants}
        free = [item for item in free if item.name not in instants]
    wide = is_full_band(candidates)
    judged = fit(experiment.sensed, free, constant, rounds=2, iterations=6, full_band=wide, tolerance=ROUGH, slopes="corrected")
    motion = {name for name in experiment.simulated_motion_of(candidates) if name in constant}
    if not motion:
        return judged
    # in which of its two ways a replay is sensed belongs to a recording: where a table hardly rests, the recorded motion tells more
    recorded = {name: value for name, value in constant.items() if name not in motion}
    other = fit(experiment.sensed, free, recorded, rounds=2, iterations=6, full_band=wide, tolerance=ROUGH, slopes="corrected")
    return max((judged, other), key=lambda fitted: fitted.score)


def _freed(
    experiment: Experiment, fitted: Fitted, candidates: Sequence[Candidate], nuisance: Collection[str]
) -> tuple[list[Free], dict[str, float]]:
    """Return what is fitted anew on another recording, its start first, and the values that are kept."""
    starts, values = begun_anew(experiment, candidates), fitted.by_name
    own = {item.name for item in starts}
    free = [*starts, *[replace(item, start=values[item.name]) for item in fitted.free if item.name in nuisance]]
    free += [item for item in _vague(fitted) if item.name not in own and item.name not in nuisance]
    freed = own | {item.name for item in free}
    return free, {name: value for name, value in values.items() if name not in freed}


def _phases_turned(
    experiment: Experiment, free: list[Free], constant: Mapping[str, float], candidates: Sequence[Candidate], nuisance: Collection[str]
) -> list[Free]:
    """Return the free values with the phases among the ``nuisance`` parameters turned to where they explain most."""
    middles = {name for candidate in candidates for name in candidate.named(candidate.effect.identification.middles)}
    angles = middles | {name for candidate in candidates for name in candidate.named(candidate.effect.identification.phases)}
    phases = [item.name for item in free if item.name in nuisance and item.name in angles]
    if not phases:
        return free
    return _at_the_best_turn(experiment, free, constant, phases, _FINE_TURNS if middles & set(phases) else QUARTER_TURNS)


def _at_the_best_turn(
    experiment: Experiment, free: list[Free], constant: Mapping[str, float], phases: Sequence[str], turns: Sequence[float]
) -> list[Free]:
    """Return the free values with the phases turned to where they explain most beside what the other values may absorb: a phase may be
    anywhere on another recording, and from the wrong side a fit ends in the wrong hump."""
    here = fit(experiment.sensed, free, constant, rounds=0)
    turned = [[replace(item, start=item.start + turn) if item.name in phases else item for item in free] for turn in turns]
    rows = np.array([[*constant.values(), *(item.start for item in one)] for one in turned])
    left = whitened(here.noise, np.array(experiment.sensed.residuals([*constant, *(item.name for item in free)], rows)), full_band=True)
    assert here.sensitivity is not None
    waves = {Place.of(name).part for name in phases}
    others = [place for place, item in enumerate(free) if Place.of(item.name).part not in waves]
    if others:
        slopes = whitened(here.noise, here.sensitivity[others], full_band=True)
        slopes /= np.maximum(np.linalg.norm(slopes, axis=1, keepdims=True), 1e-300)
        left = left - (left @ np.linalg.pinv(slopes)) @ slopes
    return turned[int(np.argmin(np.sum(left * left, axis=1)))]


def _at_the_best_instant(
    experiment: Experiment, free: list[Free], constant: Mapping[str, float], candidates: Sequence[Candidate], instants: Sequence[str]
) -> list[Free]:
    """Return the free values with each instant where this recording has it: among the steps of what is left without the effect."""
    for place, name in enumerate(instants):
        candidate = next(candidate for candidate in candidates if name in candidate.parameters)
        free = _at_its_best_instant(experiment, free, constant, candidate, name, instants[place + 1 :])
    # with all of them there, and the start of the recording fitted, each to the sample
    placed = [item for item in free if item.name in instants]
    rest = [item for item in free if item.name not in instants]
    here = {**constant, **{item.name: item.start for item in placed}}
    free = [*with_start(fit(experiment.sensed, rest, here, rounds=1, iterations=6, tolerance=ROUGH, slopes="corrected")), *placed]
    for name in (*instants, *instants[:-1]):
        found = next(item.start for item in free if item.name == name)
        nearby = [found + samples * experiment.machine.assembly.sample_period for samples in _NEARBY]
        free = _best(experiment, [[_moved(item, {name: time}, ()) for item in free] for time in nearby], constant)
    return free


def _at_its_best_instant(
    experiment: Experiment, free: list[Free], constant: Mapping[str, float], candidate: Candidate, name: str, others: Sequence[str]
) -> list[Free]:
    """Return the free values with one instant at the best of the steps of what is left without the effect; ``others`` come after it."""
    neutral = dict(zip(candidate.parameters, candidate.neutral.tolist(), strict=True))
    # of several, those that come after this one are not there yet
    later = {jump_at(other) for other in others if other in neutral}
    own = {jump_at(name)} if jump_at(name) in neutral else set(neutral) - set(candidate.nuisance)
    without = {**constant, **{item.name: item.start for item in free}, **{other: neutral[other] for other in own | later}}
    residual = experiment.sensed.one(without)
    jumps = [jump for row in residual for jump in strongest_jumps(row, experiment.machine.assembly.sample_period)]
    moved = [[_moved(item, {name: time, jump_at(name): size}, later) for item in free] for time, size in dict.fromkeys(jumps)]
    return _best(experiment, moved, constant)


def _best(experiment: Experiment, starts: Sequence[list[Free]], constant: Mapping[str, float]) -> list[Free]:
    """Return the start that explains most as it is, on all frequencies: a step that is a sample late is a needle."""
    return list(
        max((fit(experiment.sensed, start, constant, rounds=0, full_band=True) for start in starts), key=lambda fitted: fitted.score).free
    )


def _moved(item: Free, starts: Mapping[str, float], nothing: Collection[str]) -> Free:
    """Return a free value with the start it has among some, and at zero where it is to be nothing."""
    return replace(item, start=0.0) if item.name in nothing else replace(item, start=starts.get(item.name, item.start))


def _vague(fitted: Fitted) -> list[Free]:
    """Return the values that a recording left open, held by what it does say of them: where it tells only a ratio of two, another one is
    not to be judged by where in that valley the fit came to rest."""
    found = []
    for item in fitted.free:
        value, error = fitted.by_name[item.name], fitted.error(item.name)
        if error > _VAGUE * abs(value) > 0.0:
            found.append(replace(item, start=value, given=value, uncertainty=error))
    return found
