"""The numbers of a run: what it is given, its noise, what it leaves behind and what is recorded.

Noise drawn beforehand: the same numbers for every engine and every block length.

Each ``Noise`` has a stream of its own, numpy's Philox keyed by (seed, part.name). The stream is cut into chunks of fixed length, each with
its own counter, so that any stretch of samples can be drawn without the ones before it.

The recorded numbers of a run, one row a channel, in one array that grows as blocks come in.

Where the length of the run is known the array has it from the start, so that every number is written once more and no page is asked for
twice; memory that is not written to costs nothing.
"""

from __future__ import annotations

import functools
import hashlib
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from lathesim.component import Memory
from lathesim.engine.assembly import FloatArray, Place
from lathesim.engine.wiring import Plan
from lathesim.errors import SimulationError

_MOST_CELLS = 2**22
"""Samples that a ring holds at most, 32 MB."""


@dataclass
class RunArrays:
    """Parameters, states, discrete states, memories and tables of one run, in the order of the plan."""

    parameters: Any
    states: Any
    discrete: Any
    memories: Any
    tables: Any

    @property
    def in_order(self) -> tuple[Any, Any, Any, Any, Any]:
        """The arrays as ``run_block`` takes them."""
        return self.parameters, self.states, self.discrete, self.memories, self.tables

    def as_lists(self) -> RunArrays:
        """Return the same numbers for the plain engine."""
        return RunArrays(
            _list(self.parameters),
            _list(self.states),
            _list(self.discrete),
            [_list(item) for item in self.memories],
            [item if isinstance(item, list) else item.tolist() for item in self.tables],
        )

    def as_arrays(self) -> RunArrays:
        """Return the same numbers for the compiled engine."""
        return RunArrays(
            np.array(self.parameters, dtype=float),
            np.array(self.states, dtype=float),
            np.array(self.discrete, dtype=float),
            tuple(np.array(item, dtype=float) for item in self.memories),
            tuple(np.ascontiguousarray(item, dtype=float) for item in self.tables),
        )

    def copy(self) -> RunArrays:
        """Return a copy of what a block changes."""
        return RunArrays(
            self.parameters,
            list(self.states) if isinstance(self.states, list) else self.states.copy(),
            list(self.discrete) if isinstance(self.discrete, list) else self.discrete.copy(),
            type(self.memories)(item.copy() for item in self.memories),
            self.tables,
        )


def _list(values: Any) -> list[float]:
    return [float(item) for item in values] if isinstance(values, (list, tuple)) else values.astype(float).tolist()


def start_arrays(plan: Plan, overrides: Mapping[str, float] | None = None, duration: float = 0.0) -> RunArrays:
    """Return the arrays at the start of a run; ``overrides`` maps ``part.parameter`` or ``part.state`` to another value [SI].

    ``duration`` [s] is that of the run, 0 where it is not known.

    Memories and tables are never empty tuples (the compiler could not type them): a plan without gets one number that is not read.
    """
    parameters, states, discrete = (
        np.array([plan.values[name] for name in names] or [0.0]) for names in (plan.parameters, plan.states, plan.discrete)
    )
    arrays: dict[str, FloatArray] = {"parameter": parameters, "state": states, "discrete": discrete}
    for name, value in (overrides or {}).items():
        kind, position = plan.settable(name)
        arrays[kind][position] = value
    memories = start_memories(plan, parameters, duration)
    tables = tuple(np.ascontiguousarray(plan.parts[part].tables[name], dtype=float) for part, name in map(Place.of, plan.arrays.tables))
    return RunArrays(parameters, states, discrete, memories, tables or (np.zeros((1, 1)),))


def start_memories(plan: Plan, parameters: FloatArray, duration: float) -> tuple[FloatArray, ...]:
    """Return the memories at the start of a run with these parameters, each as long as what it has to hold."""
    return tuple(_memory(plan, name, parameters, duration) for name in plan.arrays.memories) or (np.zeros(1),)


def _memory(plan: Plan, full: str, parameters: FloatArray, duration: float) -> FloatArray:
    part_name, name = Place.of(full)
    part = plan.parts[part_name]
    item = part.component.declarations[name]
    assert isinstance(item, Memory)
    length = int(part.memory_lengths.get(name, item.length))
    given = {"duration": duration}
    for argument in set(item.held_by) - {"duration"}:
        kind, source = plan.feeds.get(f"{part_name}.{argument}", ("parameter", f"{part_name}.{argument}"))
        if kind != "parameter":  # it changes during the run, and a value that the ring cannot hold breaks the run
            return _filled(length, item.start)
        given[argument] = float(parameters[plan.parameters[source]])
    period = plan.assembly.sample_period * part.every
    needed = item.samples(given, period)
    if not needed <= _MOST_CELLS:
        values = " and ".join(f"{argument} = {given[argument]:g}" for argument in item.held_by)
        raise SimulationError(
            f"{full} would have to hold {needed:.3g} samples of {period:g} s, with {values}, and holds at most {_MOST_CELLS}.",
            remedy="Take a shorter delay, or a longer sample period.",
        )
    return _filled(max(length, math.ceil(needed)), item.start)


def _filled(length: int, start: float) -> FloatArray:
    """Return an array full of one number; of zeros nothing is written, so that the memory of a part that idles costs nothing."""
    return np.full(length, start) if start else np.zeros(length)


_CHUNK = 4096


def draw_noise(names: Iterable[str], seed: int, first: int, count: int) -> FloatArray:
    """Return standard normal numbers, shape (names, count), for the samples from ``first`` on."""
    rows = [_stretch(name, seed, first, count) for name in names]
    return np.array(rows) if rows else np.zeros((1, 1))


@functools.lru_cache(maxsize=64)
def _chunk(key: int, chunk: int) -> FloatArray:
    """Return one chunk of a stream; neighbouring blocks of a run, and runs with the same seed, share it."""
    numbers = np.random.Generator(np.random.Philox(key=key, counter=[0, 0, 0, chunk])).standard_normal(_CHUNK)
    numbers.flags.writeable = False
    return numbers


def _stretch(name: str, seed: int, first: int, count: int) -> FloatArray:
    key = int.from_bytes(hashlib.sha256(f"{seed}:{name}".encode()).digest()[:16], "little")
    chunks = range(first // _CHUNK, (first + max(count, 1) - 1) // _CHUNK + 1)
    numbers = [_chunk(key, chunk) for chunk in chunks]
    offset = first - chunks[0] * _CHUNK
    return np.concatenate(numbers)[offset : offset + count]


_LARGEST_START = 2**24
"""Numbers the array has at most before there are any: 128 MB."""


class RecordedValues:
    """Collects blocks of shape (channels, samples); ``expected`` is how many samples there will be, 0 where that is not known."""

    def __init__(self, channels: int, expected: int) -> None:
        self._room = np.empty((channels, min(expected, _LARGEST_START // max(1, channels))))
        self._samples = 0

    @property
    def values(self) -> FloatArray:
        """What was collected, shape (channels, samples)."""
        return self._room[:, : self._samples]

    def add(self, block: FloatArray) -> None:
        """Copy a block behind the others."""
        end = self._samples + block.shape[1]
        if end > self._room.shape[1]:
            larger = np.empty((self._room.shape[0], max(end, 2 * self._room.shape[1])))
            larger[:, : self._samples] = self.values
            self._room = larger
        self._room[:, self._samples : end] = block
        self._samples = end
