"""Runs of many programs on the machine that holds all rivals: what each rival would make a recording read.

Sizes that a rival may have on this machine: with them no program drives it to a limit, and no lag is shorter than it can show.

A drive that stands at its limit does not follow, and nobody has such a machine diagnosed; beyond the limit two forces differ that are alike
everywhere else. A lag far below the sample period is how a simulation steps.
"""

from __future__ import annotations

import dataclasses
import functools
import math
import threading
from collections.abc import Sequence

import numpy as np

from lathesim.diagnosis.method import STANDARD
from lathesim.engine.assembly import Assembly, FloatArray, Place
from lathesim.engine.batch import Batch
from lathesim.engine.wiring import Plan, wire
from lathesim.experiments.candidate_programs import Laid, lay_candidate
from lathesim.experiments.families import CandidateProgram
from lathesim.experiments.replica import given_values
from lathesim.experiments.rivals import Rival
from lathesim.experiments.room import Room
from lathesim.identification.records import Candidate as Term
from lathesim.identification.replay.converter_rounding import counts_of
from lathesim.identification.signal import channel_floor

_MOVES = 10.0
"""Noise floors by which a channel moves in a program that shows something."""
_ROUNDING = 1e-9
"""Share of its range by which a signal that stands may change from sample to sample: rounding of what it is computed from."""
_HALVINGS = 10
"""Times that a size is halved until the machine does its program: it is a thousandth then."""
_STANDS = 2
"""Samples for which a signal must stay exactly at its extreme to be at a limit: without noise nothing else holds one that long."""


def shown_lags(term: Term, sizes: FloatArray, plan: Plan) -> FloatArray:
    """Return sizes (..., parameters) with lags that are too short to show at none at all."""
    least = STANDARD.sizes.least_lag * plan.assembly.sample_period
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
    moving = still[alive].mean(axis=0) < STANDARD.larger_part if alive.any() else np.zeros(seen.shape[1] - 1, dtype=bool)
    for row, steps, usual, rests in zip(seen, still, sound, usually_still, strict=True):
        for extreme, is_beyond in ((row.max(), row.max() > usual.max()), (row.min(), row.min() < usual.min())):
            stands = steps & moving & ~rests
            there = int(np.count_nonzero(stands & (np.abs(row[1:] - extreme) <= _ROUNDING * np.ptp(row))))
            if is_beyond and there >= _STANDS and there > STANDARD.larger_part * np.count_nonzero(stands):
                return True
    return False


def _still(rows: FloatArray) -> FloatArray:
    """Return where signals (channels, samples) stay as they are, but for rounding."""
    return np.asarray(np.abs(np.diff(rows, axis=1)) <= _ROUNDING * np.ptp(rows, axis=1)[:, None])


_ROWS = 1200
"""Mean values of a recording that are compared for each channel; a finer look costs time and tells little more; assumed."""
_STEADY = 0.1
"""Share of a floor by which all readings of a channel may be off together: what no model follows; assumed."""


class Scene:
    """The machine with all rivals and its uncertain values, and the channels of a recording. Its sensors and converters do not count.

    ``names`` are the uncertain values, then the parameters of every rival. ``given`` are their values with all rivals neutral,
    ``deviation`` one standard deviation of the uncertain ones.
    """

    def __init__(
        self, assembly: Assembly, rivals: Sequence[Rival], channels: Sequence[str], uncertain: dict[str, float], room: Room,
        resolution: dict[str, float], longest: float, stop: threading.Event | None = None,
    ) -> None:  # fmt: skip
        self.rivals, self.channels, self.room, self.stop = tuple(rivals), tuple(channels), room, stop
        self.path_name = f"{room.interpolator.name}.path"
        self.rounding = counts_of(assembly)
        # a count more or less tells no rival from another
        unrounded = assembly.with_parameters({name: exact for name, (_, exact) in self.rounding.items()})
        machine = dataclasses.replace(unrounded, finish="", record=self.channels)
        self.period = machine.sample_period
        self.plan = wire(machine)
        self.batch = Batch(self.plan, math.ceil(longest / self.period) + 1, noisy=False)
        self.uncertain = tuple(name for name in uncertain if name in self.plan.parameters)
        self.names = (*self.uncertain, *[name for rival in rivals if rival.term is not None for name in rival.term.parameters])
        self.given = given_values(self.plan, self.names)
        for rival in rivals:
            if rival.term is not None:
                for name, value in zip(rival.term.parameters, rival.term.neutral, strict=True):
                    self.given[self.names.index(name)] = value
        self.deviation = np.array([uncertain[name] for name in self.uncertain])
        self.resolution = resolution
        self.runs = 0

    def columns(self, rival: Rival) -> list[int]:
        """Return where the parameters of a rival stand among the names."""
        return [self.names.index(name) for name in rival.term.parameters] if rival.term is not None else []

    def values(self, rival: Rival, sizes: FloatArray) -> FloatArray:
        """Return the values of all names with a rival of these sizes."""
        row = self.given.copy()
        row[self.columns(rival)] = sizes
        return row

    def step_as_coarsely_as_may_be(self, programs: Sequence[Laid], floors: FloatArray, small: float) -> None:
        """Take the fewest steps a sample with which no rival's run differs from that at the lesson's step by ``small`` (a sum of squares in
        noise levels): what a finer step would add tells no rival from another."""
        rows = np.array([self.values(rival, size) for rival in self.rivals for size in rival.sizes])
        full = self.plan.assembly.steps_per_sample
        exact = [self.in_noise_levels(self.readings([item], [rows])[0], item, floors) for item in programs]
        for steps in (count for count in range(1, full) if full % count == 0):
            self.batch = dataclasses.replace(self.batch, steps_per_sample=steps)
            off = 0.0
            for item, fine in zip(programs, exact, strict=True):
                coarse = self.in_noise_levels(self.readings([item], [rows])[0], item, floors)
                change = float(np.square(coarse - fine).sum(axis=(1, 2)).max()) if coarse.shape == fine.shape else math.inf
                off = max(off, change if math.isfinite(change) else math.inf)
            if off < small:
                return
        self.batch = dataclasses.replace(self.batch, steps_per_sample=0)

    def lay(self, candidate: CandidateProgram, title: Sequence[str] = ()) -> Laid:
        """Return a candidate as path; its text is read back as any part program is. Raises what the reading of a program raises."""
        return lay_candidate(candidate, self.room, title)

    def readings(self, programs: Sequence[Laid], rows: Sequence[FloatArray]) -> list[FloatArray]:
        """Return for each program the means (members, channels, stretches) [SI] of its ``rows`` (members, names): one batch of one plan.

        A run whose numbers leave all bounds reads nothing but NaN.
        """
        if self.stop is not None and self.stop.is_set():
            raise KeyboardInterrupt
        values = self._shown(np.vstack(rows))
        owner = np.repeat(np.arange(len(programs)), [len(item) for item in rows])
        lengths = [self._samples(programs[int(place)]) for place in owner]
        tables = {self.path_name: [programs[int(place)].table for place in owner]}
        stretches = {length: max(1, length // _ROWS) for length in set(lengths)}

        def reduced(record: FloatArray) -> FloatArray | None:
            length = int(np.isfinite(record[0]).sum())
            every = stretches.get(length)
            return (
                None if every is None else np.asarray(record[:, : length // every * every].reshape(record.shape[0], -1, every).mean(axis=2))
            )

        found = self.batch.run(self.names, values, reduced, tables, lengths)
        self.runs += len(values)
        result, first = [], 0
        for program, item in zip(programs, rows, strict=True):
            length = self._samples(program)
            broken = np.full((len(self.channels), length // stretches[length]), np.nan)
            result.append(np.array([broken if member is None else member for member in found[first : first + len(item)]]))
            first += len(item)
        return result

    def _shown(self, values: FloatArray) -> FloatArray:
        """Return values (members, names) in which no lag is shorter than a recording can show."""
        for rival in self.rivals:
            if rival.term is not None:
                columns = self.columns(rival)
                values[:, columns] = shown_lags(rival.term, values[:, columns], self.plan)
        return values

    def _samples(self, program: Laid) -> int:
        return min(self.batch.samples, max(20, math.ceil(program.seconds / self.period)))

    def those_that_move(self, programs: Sequence[Laid], floors: FloatArray) -> list[Laid]:
        """Return the programs in which something that is recorded moves by more than it is uncertain."""
        found = self.readings(programs, [self.given[None, :]] * len(programs))
        return [item for item, read in zip(programs, found, strict=True) if (np.ptp(read[0], axis=1) > _MOVES * floors).any()]

    def floors(self, program: Laid) -> FloatArray:
        """Return what a sample of each channel cannot resolve (channels,) [SI], one standard deviation, from a run whose sensors count."""
        names, values = (*self.names, *self.rounding), np.array([[*self.given, *(given for given, _ in self.rounding.values())]])
        record = self.batch.run(names, values, np.copy, {self.path_name: [program.table]}, [self._samples(program)])[0]
        found = []
        for name, values in zip(self.channels, record, strict=True):
            resolution = self.resolution.get(name, 0.0)
            finite = values[np.isfinite(values)]
            found.append(max(channel_floor(finite, resolution), resolution, 1e-5 * float(np.abs(finite).max()), 1e-15))
        return np.array(found)

    def in_noise_levels(self, readings: FloatArray, program: Laid, floors: FloatArray, *, steady: bool = True) -> FloatArray:
        """Return readings (members, channels, stretches) of a program in standard deviations of what cannot be resolved.

        A sample is uncertain by its floor, which averages out, and a channel by a ``steady`` share of it, which does not: errors of a
        channel with n stretches have the covariance I + s^2 11', so that its mean counts 1/sqrt(1 + n s^2) of what it would.
        """
        every = max(1, self._samples(program) // _ROWS)
        scaled = readings * (math.sqrt(every) / floors)[None, :, None]
        if not steady:
            return np.asarray(scaled)
        share = 1.0 / math.sqrt(1.0 + scaled.shape[2] * every * _STEADY**2)
        return np.asarray(scaled - (1.0 - share) * scaled.mean(axis=2, keepdims=True))
