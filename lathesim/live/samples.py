"""Timed samples on their way: blocks from a source to a sink, whatever they come from and go to."""

from __future__ import annotations

import asyncio
import signal
from collections.abc import AsyncIterator, Callable, Coroutine, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol, TypeVar

import numpy as np

from lathesim.errors import LatheSimError
from lathesim.limit import Limit
from lathesim.record import Channel, FloatArray

SAME = Limit(1e-9, "share", "two rates or periods that differ by less are one", "derived", "sums of times lose six digits")


class LiveError(LatheSimError):
    """A peer, a stream or a mapping cannot be used."""


@dataclass(frozen=True)
class Signal:
    """One channel of a stream: ``name`` as its source calls it, SI ``unit``, and what it is."""

    name: str
    unit: str
    description: str = ""

    def as_channel(self) -> Channel:
        """Return the signal as a channel of a record, without values."""
        return Channel(self.name, self.unit, np.zeros(0), self.description)


@dataclass(frozen=True, eq=False)
class SampleBlock:
    """Samples that arrived together: ``time`` (samples,) [s] by the source's own clock, ``values`` (signals, samples).

    ``notes`` are sentences about what happened before this block: a gap, a restart, samples that came twice. A value that is not known at
    an instant is NaN. ``fresh`` says that another recording begins: what was before does not go on.
    """

    time: FloatArray
    values: FloatArray
    notes: tuple[str, ...] = field(default=())
    fresh: bool = False

    def __len__(self) -> int:
        return len(self.time)


class Source(Protocol):
    """Gives timed samples block by block: a file, a simulated machine, a socket, OPC UA, MTConnect."""

    @property
    def name(self) -> str:
        """Return what the source is called in sentences."""

    @property
    def signals(self) -> tuple[Signal, ...]:
        """Return the signals, in the order of the values; known once the first block is there."""

    def blocks(self) -> AsyncIterator[SampleBlock]:
        """Return the blocks in the order of their times."""


class SampleSink(Protocol):
    """Takes timed samples block by block; a :class:`lathesim.record_writer.RecordWriter` is one."""

    def write(self, time: FloatArray, values: FloatArray) -> None:
        """Take the next block: times (samples,), values (signals, samples)."""

    def finish(self, meta: Mapping[str, str | float | int] | None = None) -> None:
        """Take what is known at the end."""


Answer = TypeVar("Answer")


def run_until_stopped(work: Callable[[asyncio.Event], Coroutine[Any, Any, Answer]]) -> tuple[Answer, bool]:
    """Run a coroutine that ends soon after the event it is given is set; Ctrl-C and a request to terminate set it.

    Return its answer and whether it was stopped.
    """

    async def guarded() -> tuple[Answer, bool]:
        stop = asyncio.Event()
        loop = asyncio.get_running_loop()
        for kind in (signal.SIGINT, signal.SIGTERM):
            try:
                loop.add_signal_handler(kind, stop.set)
            except (NotImplementedError, RuntimeError, ValueError):
                break  # not in the main thread, or not on this system: Ctrl-C then ends the loop as it does any program
        return await work(stop), stop.is_set()

    return asyncio.run(guarded())
