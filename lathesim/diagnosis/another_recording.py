"""A fitted model on another recording: what belongs to a recording is fitted anew there, the rest is as it is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from lathesim.diagnosis.fit import Fitted, Free, fit
from lathesim.diagnosis.problem import Rig
from lathesim.diagnosis.starting_points import instants_of, strongest_jumps
from lathesim.diagnosis.terms import Term
from lathesim.engine.assembly import FloatArray

_ANGLES = ("phase", "middle")
"""Angles of a turn that belong to a recording: of a wave, of a slot or a spot."""
_TURNS = (0.0, 0.5 * np.pi, np.pi, -0.5 * np.pi)
_FINE_TURNS = tuple(2.0 * np.pi * place / 36 for place in range(36))
"""A slot may be a twentieth of a turn."""
_VAGUE = 0.02
"""A value whose standard error is a larger share of it than this is left open by a recording."""
_ROUGH = 1e-4
"""A judge's descent ends when a step gains less than this share of the cost."""


def on_recording(rig: Rig, fitted: Fitted, terms: Sequence[Term]) -> Fitted:
    """Give a fitted model on another recording: start values and nuisance parameters fitted anew, the rest as it is."""
    starts = rig.start_states(rig.sensed.plan)
    own = {item.name for item in starts}
    nuisance = {name for term in terms for name in term.nuisance}
    values = fitted.by_name
    free = [*starts, *[replace(item, start=values[item.name]) for item in fitted.free if item.name in nuisance]]
    free += [item for item in _vague(fitted) if item.name not in own and item.name not in nuisance]
    freed = {item.name for item in free}
    constant = {name: value for name, value in values.items() if name not in freed and name not in own}
    phases = [item.name for item in free if item.name in nuisance and item.name.endswith(_ANGLES)]
    if phases:
        free = _at_the_best_turn(rig, free, constant, phases)
    instants = [item.name for item in free if item.name in nuisance and item.name in instants_of([item.name])]
    if instants:
        free = _at_the_best_instant(rig, free, constant, terms, instants)
    judged = fit(rig.sensed, free, constant, rounds=2, iterations=6, tolerance=_ROUGH, slopes="kept")
    motion = {name for name in rig.feeling_their_motion(terms) if name in constant}
    if not motion:
        return judged
    # in which of its two ways a replay is felt belongs to a recording: where a table hardly rests, the recorded motion tells more
    recorded = {name: value for name, value in constant.items() if name not in motion}
    other = fit(rig.sensed, free, recorded, rounds=2, iterations=6, tolerance=_ROUGH, slopes="kept")
    return max((judged, other), key=lambda fitted: fitted.score)


def _at_the_best_turn(rig: Rig, free: list[Free], constant: Mapping[str, float], phases: Sequence[str]) -> list[Free]:
    """Give the free values with the phases turned to where they explain most beside what the other values may absorb: a phase may be
    anywhere on another recording, and from the wrong side a fit ends in the wrong hump."""
    here = fit(rig.sensed, free, constant, rounds=0)
    turns = _FINE_TURNS if any(name.endswith("middle") for name in phases) else _TURNS
    turned = [[replace(item, start=item.start + turn) if item.name in phases else item for item in free] for turn in turns]
    rows = np.array([[*constant.values(), *(item.start for item in one)] for one in turned])

    def white(arrays: FloatArray) -> FloatArray:
        """Give arrays (n, channels, samples) whitened, (n, values)."""
        return np.concatenate([model.whiten(arrays[:, row], wide=True) for row, model in enumerate(here.noise)], axis=1)

    left = white(np.array(rig.sensed.residuals([*constant, *(item.name for item in free)], rows)))
    assert here.sensitivity is not None
    waves = {name.partition(".")[0] for name in phases}
    others = [place for place, item in enumerate(free) if item.name.partition(".")[0] not in waves]
    if others:
        slopes = white(here.sensitivity[others])
        slopes /= np.maximum(np.linalg.norm(slopes, axis=1, keepdims=True), 1e-300)
        left = left - (left @ np.linalg.pinv(slopes)) @ slopes
    return turned[int(np.argmin(np.sum(left * left, axis=1)))]


def _at_the_best_instant(
    rig: Rig, free: list[Free], constant: Mapping[str, float], terms: Sequence[Term], instants: Sequence[str]
) -> list[Free]:
    """Give the free values with each instant where this recording has it: among the steps of what is left without the effect."""
    for name in instants:
        term = next(term for term in terms if name in term.parameters)
        sizes = [(item, value) for item, value in zip(term.parameters, term.neutral, strict=True) if item not in term.nuisance]
        without = {**constant, **{item.name: item.start for item in free}, **dict(sizes)}
        residual = rig.sensed.one(without)
        times = [time for row in residual for time, _ in strongest_jumps(row, rig.machine.assembly.sample_period)]
        moved = [[replace(item, start=time) if item.name == name else item for item in free] for time in dict.fromkeys(times)]
        free = list(max((fit(rig.sensed, start, constant, rounds=0) for start in moved), key=lambda fitted: fitted.score).free)
    return free


def _vague(fitted: Fitted) -> list[Free]:
    """Give the values that a recording left open, held by what it does say of them: where it tells only a ratio of two, another one is not
    to be judged by where in that valley the fit came to rest."""
    found = []
    for item in fitted.free:
        value, error = fitted.by_name[item.name], fitted.error(item.name)
        if error > _VAGUE * abs(value) > 0.0:
            found.append(replace(item, start=value, given=value, uncertainty=error))
    return found
