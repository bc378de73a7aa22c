"""A stream without a network: planner, buffer and machine in one process on a virtual clock, bit-repeatable.

The planner is busy now and then, as one on an ordinary computer is: in period k, when k has reached the next turn, it fills the buffer up
to F and is away for ``least`` + Exp(``mean``) periods.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from lathesim.live.samples import SampleSink
from lathesim.live.set_point_buffer import BufferCount, SetPointBuffer
from lathesim.live.stepped_machine import LARGEST_BLOCK, SteppedMachine
from lathesim.record import FloatArray


@dataclass(frozen=True)
class Planner:
    """How the planner fills the buffer: up to ``fill`` set-points, away for ``least`` + Exp(``mean``) periods; ``mean`` 0: never away."""

    fill: int = 150
    least: float = 5.0
    mean: float = 15.0
    seed: int = 0


def stream_virtually(
    blocks: Iterator[FloatArray],
    machine: SteppedMachine | None,
    buffer: SetPointBuffer,
    planner: Planner,
    sink: SampleSink | None = None,
    progress: Callable[[float], None] = lambda seconds: None,
    most_periods: int | None = None,
) -> BufferCount:
    """Return what the buffer saw while the machine played a stream; what it did goes to ``sink`` block by block.

    Without a machine only the set-points that were played go to the sink, at a period of 1 s. ``most_periods`` ends it earlier.
    """
    rng = np.random.default_rng(planner.seed)
    feed = _Feed(blocks)
    going = _Going(machine, sink, progress)
    turn = 0.0
    while not buffer.finished and (most_periods is None or going.periods < most_periods):
        if going.periods >= turn:
            feed.fill(buffer, planner.fill)
            turn = going.periods + (planner.least + rng.exponential(planner.mean) if planner.mean > 0.0 else 1.0)
        until = max(1, int(np.ceil(turn)) - going.periods)
        if planner.mean <= 0.0:
            until = max(1, min(LARGEST_BLOCK, int(buffer.fill)))
        if most_periods is not None:
            until = min(until, most_periods - going.periods)
        going.play(buffer.play(until))
        if buffer.ended and buffer.fill <= 0.0:
            break
    going.flush()
    return buffer.count()


class _Feed:
    """The set-points that are still to come."""

    def __init__(self, blocks: Iterator[FloatArray]) -> None:
        self._blocks = blocks
        self._rest: FloatArray | None = None

    def fill(self, buffer: SetPointBuffer, level: int) -> None:
        """Fill the buffer up to a level, and end it where nothing is left."""
        room = int(np.ceil(min(level, buffer.capacity) - buffer.fill))
        while room > 0 and not buffer.ended:
            if self._rest is None or not len(self._rest):
                self._rest = next(self._blocks, None)
                if self._rest is None:
                    buffer.end()
                    return
            taken = buffer.put(self._rest[:room])
            self._rest = self._rest[taken:]
            room = room - taken if taken else 0
        if self._rest is not None and not len(self._rest):
            self._rest = next(self._blocks, None)
            if self._rest is None:
                buffer.end()


class _Going:
    """The machine going on: set-points are gathered, so that it is called once for many periods."""

    def __init__(self, machine: SteppedMachine | None, sink: SampleSink | None, progress: Callable[[float], None]) -> None:
        self._machine, self._sink, self._progress = machine, sink, progress
        self._period = machine.period if machine is not None else 1.0
        self._waiting: list[FloatArray] = []
        self._count = 0
        self._done = 0
        self.periods = 0

    def play(self, set_points: FloatArray) -> None:
        """Take the set-points of the next periods."""
        self._waiting.append(set_points)
        self._count += len(set_points)
        self.periods += len(set_points)
        if self._count >= LARGEST_BLOCK:
            self.flush()

    def flush(self) -> None:
        """Let the machine move by what has been gathered."""
        if not self._count:
            return
        set_points = np.concatenate(self._waiting)
        self._waiting, self._count = [], 0
        rows = [set_points.T] if self._machine is None else [set_points.T, self._machine.advance(set_points)]
        if self._sink is not None:
            times = (self._done + np.arange(len(set_points), dtype=np.float64)) * self._period
            self._sink.write(times, np.ascontiguousarray(np.vstack(rows)))
        self._done += len(set_points)
        self._progress(self._done * self._period)
