"""Sizes that a rival may have on this machine: with them no program drives it to a limit, and no lag is shorter than it can show.

A drive that stands at its limit does not follow, and nobody has such a machine diagnosed; beyond the limit two forces differ that are alike
everywhere else. A lag far below the sample period is how a simulation steps.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Sequence

import numpy as np

from lathesim.component import Parameter
from lathesim.diagnosis.method import STANDARD
from lathesim.engine.assembly import Assembly, FloatArray, Place
from lathesim.engine.running.batch import Batch
from lathesim.engine.wiring import Plan, wire
from lathesim.experiments.design.laying import Laid
from lathesim.experiments.design.rivals import Rival
from lathesim.experiments.replica import given_values
from lathesim.identification.records.candidate import Candidate as Term

_BITS = "bits"
"""Parameter of a converter that counts."""
_ROUNDING = 1e-9
"""Share of its range by which a signal that stands may change from sample to sample: rounding of what it is computed from."""
_HALVINGS = 10
"""Times that a size is halved until the machine does its program: it is a thousandth then."""
_STANDS = 2
"""Samples for which a signal must stay exactly at its extreme to be at a limit: without noise nothing else holds one that long."""


def counts_of(assembly: Assembly) -> dict[str, tuple[float, float]]:
    """Return ``part.parameter`` -> (given, exact) for all that counts: what one count of a sensor is worth [SI], and the bits of a
    converter, which has most of them where it is exact."""
    found = {}
    for part in assembly.parts:
        declarations, ports = part.component.declarations, part.component.ports
        name = ports["resolution"] if {"measured", "resolution"} <= set(ports) else _BITS
        declared = declarations.get(name)
        if not isinstance(declared, Parameter):
            continue
        given = float(part.parameters.get(name, declared.default))
        if name == _BITS and declared.high is not None:
            found[f"{part.name}.{name}"] = given, float(declared.high)
        elif name != _BITS and given > 0.0 and (declared.low is None or declared.low <= 0.0):
            found[f"{part.name}.{name}"] = given, 0.0
    return found


def shown_lags(term: Term, sizes: FloatArray, plan: Plan) -> FloatArray:
    """Return sizes (..., parameters) with lags that are too short to show at none at all."""
    least = STANDARD.selection.least_lag * plan.assembly.sample_period
    found = np.array(sizes, dtype=float)
    for place, name in enumerate(term.parameters):
        if Place.of(name).port in term.effect.neutral and plan.unit(name) == "s":
            short = np.abs(found[..., place] - term.neutral[place]) < least
            found[..., place] = np.where(short, term.neutral[place], found[..., place])
    return found


def with_sizes_in_reach(assembly: Assembly, rivals: Sequence[Rival], programs: Sequence[Laid], path: str) -> list[Rival]:
    """Return the rivals with sizes so small that no signal of the machine reaches a limit in any program that it does not reach without
    the rival: those beyond are halved until that is so. ``path`` is the table of the interpolator."""
    machine = dataclasses.replace(assembly, finish="", record=None)
    plan = wire(machine)
    lengths = [math.ceil(program.seconds / machine.sample_period) for program in programs]
    batch = Batch(plan, max(lengths), noisy=False)
    terms = [rival.term for rival in rivals if rival.term is not None]
    counts = counts_of(assembly)
    names = [*(name for term in terms for name in term.parameters), *counts]
    idle = given_values(plan, names)
    # a reading that waits for its next count stands at no limit
    idle[len(names) - len(counts) :] = [exact for _, exact in counts.values()]
    for term in terms:
        idle[[names.index(name) for name in term.parameters]] = term.neutral
    own = {term.part for term in terms}
    looked = [place for place, name in enumerate(plan.channels) if Place.of(name).part not in own]
    sizes = {(number, draw): row for number, rival in enumerate(rivals) for draw, row in enumerate(rival.sizes) if rival.term is not None}

    def row(number: int, draw: int) -> FloatArray:
        values = idle.copy()
        values[[names.index(name) for name in _term(rivals[number]).parameters]] = sizes[number, draw]
        return values

    for program, length in zip(programs, lengths, strict=True):
        tables = {path: [program.table] * len(sizes)}
        sound = batch.run(names, idle[None, :], lambda record: np.array(record[looked]), tables, [length])[0][:, :length]
        beyond = list(sizes)
        for _ in range(_HALVINGS):
            if not beyond:
                break
            rows = np.array([row(*key) for key in beyond])
            at_limit = functools.partial(_is_at_a_limit, looked=looked, sound=sound)
            limited = batch.run(names, rows, at_limit, tables, [length] * len(rows))
            beyond = [key for key, is_beyond in zip(beyond, limited, strict=True) if is_beyond]
            for number, draw in beyond:
                sizes[number, draw] = _halved(_term(rivals[number]), sizes[number, draw])
    return [
        rival
        if rival.term is None
        else dataclasses.replace(rival, sizes=np.array([sizes[number, draw] for draw in range(len(rival.sizes))]))
        for number, rival in enumerate(rivals)
    ]


def _term(rival: Rival) -> Term:
    assert rival.term is not None
    return rival.term


def _halved(term: Term, sizes: FloatArray) -> FloatArray:
    """Return sizes of which those that make the effect are half as far from none."""
    found = np.array(sizes)
    for place, name in enumerate(term.parameters):
        if Place.of(name).port in term.effect.neutral:
            found[place] = 0.5 * (found[place] + term.neutral[place])
    return found


def _is_at_a_limit(record: FloatArray, looked: Sequence[int], sound: FloatArray) -> bool:
    """Return whether a signal (channels, samples) stands at an extreme beyond that of the sound machine while most others move.

    One that stands at other levels as often is counted in steps, and at no limit; nor is one that stands where that of the sound machine
    does, as the force of a steady cut.
    """
    seen = record[looked, : sound.shape[1]]
    if not np.isfinite(seen).all():
        return True
    still, usually_still = (_still(rows) for rows in (seen, sound))
    alive = ~still.all(axis=1)
    moving = still[alive].mean(axis=0) < STANDARD.shared.larger_part if alive.any() else np.zeros(seen.shape[1] - 1, dtype=bool)
    for row, steps, usual, rests in zip(seen, still, sound, usually_still, strict=True):
        for extreme, is_beyond in ((row.max(), row.max() > usual.max()), (row.min(), row.min() < usual.min())):
            stands = steps & moving & ~rests
            there = int(np.count_nonzero(stands & (np.abs(row[1:] - extreme) <= _ROUNDING * np.ptp(row))))
            if is_beyond and there >= _STANDS and there > STANDARD.shared.larger_part * np.count_nonzero(stands):
                return True
    return False


def _still(rows: FloatArray) -> FloatArray:
    """Return where signals (channels, samples) stay as they are, but for rounding."""
    return np.asarray(np.abs(np.diff(rows, axis=1)) <= _ROUNDING * np.ptp(rows, axis=1)[:, None])
