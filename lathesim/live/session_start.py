"""How a simulation beside a source begins, for the watch and for the twin: which channels drive it and are compared, and its clock."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncGenerator, AsyncIterator
from dataclasses import dataclass

import numpy as np

from lathesim.lessons.simulate import Prepared
from lathesim.live.even_clock import SampleClock
from lathesim.live.samples import LiveError, SampleBlock, Signal, Source
from lathesim.record import FloatArray

_FOR_THE_PERIOD = 20
"""Samples from which the sample period is taken."""


@dataclass(frozen=True, eq=False)
class BegunStream:
    """A simulation that can begin: the channels that ``drive`` it and those to ``compare``, as ``signals``, and the ``clock`` for them."""

    drive: tuple[str, ...]
    compare: tuple[str, ...]
    signals: tuple[Signal, ...]
    clock: SampleClock


def driven_and_compared(prepared: Prepared) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the names of the channels that drive a lesson's machine, and of those that are compared; refuse a lesson without them."""
    recordings = prepared.case.lesson.settings.recordings
    if recordings is None or not recordings.drive or not recordings.compare:
        place = str(prepared.case.lesson.path)
        raise LiveError("the lesson does not say what drives it and what is compared.", place=place, remedy="Add 'recordings:'.")
    return tuple(recordings.drive), tuple(recordings.compare)


async def begun_blocks(
    prepared: Prepared, source: Source, channels: tuple[tuple[str, ...], tuple[str, ...]], stop: asyncio.Event
) -> AsyncGenerator[tuple[BegunStream, SampleBlock], None]:
    """Yield the blocks of a source, their rows those of ``begun.signals``, until it ends or ``stop`` is set.

    ``channels`` are those of :func:`driven_and_compared`. The first blocks wait until the sample period is known, and come one after
    another then. Raises :class:`LiveError` where the source
    lacks what drives the machine, or all that is compared.
    """
    begun: tuple[BegunStream, list[int]] | None = None
    waiting: list[SampleBlock] = []
    async with contextlib.aclosing(_until_stopped(source.blocks(), stop)) as blocks:
        async for block in blocks:
            waiting.append(block)
            if begun is None and sum(len(item) for item in waiting) < _FOR_THE_PERIOD:
                continue
            begun = begun or _begin(prepared, source, channels, np.concatenate([item.time for item in waiting]))
            for item in waiting:
                yield begun[0], SampleBlock(item.time, item.values[begun[1]], item.notes, item.fresh)
            waiting = []


def _begin(
    prepared: Prepared, source: Source, channels: tuple[tuple[str, ...], tuple[str, ...]], time: FloatArray
) -> tuple[BegunStream, list[int]]:
    """Return what can begin with the first instants (samples,) [s], and the rows of its signals among those of the source."""
    drive, compare = channels
    names = [signal.name for signal in source.signals]
    missing = [name for name in drive if name not in names]
    if missing:
        raise LiveError(f"{source.name} has no '{missing[0]}', which drives the lesson.", remedy="Add it to the map.")
    there = tuple(name for name in compare if name in names)
    if not there:
        raise LiveError(f"{source.name} has no channel that the lesson compares.", remedy=f"Map {', '.join(compare)}.")
    rows = [names.index(name) for name in (*drive, *there)]
    steps, own = np.diff(np.sort(time)), prepared.plan.assembly.sample_period
    period = float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else own
    clock = SampleClock(own * max(1, round(period / own)))
    return BegunStream(drive, there, tuple(source.signals[row] for row in rows), clock), rows


async def _until_stopped(blocks: AsyncIterator[SampleBlock], stop: asyncio.Event) -> AsyncGenerator[SampleBlock, None]:
    """Yield blocks until there are no more or ``stop`` is set, also while the next one is waited for."""
    ending: asyncio.Task[bool] = asyncio.ensure_future(stop.wait())
    try:
        while not stop.is_set():
            following = asyncio.ensure_future(anext(blocks, None))
            await asyncio.wait([following, ending], return_when=asyncio.FIRST_COMPLETED)
            if not following.done():
                following.cancel()
                with contextlib.suppress(asyncio.CancelledError, Exception):
                    await following
                return
            block = following.result()
            if block is None:
                return
            yield block
    finally:
        ending.cancel()
