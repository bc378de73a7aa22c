"""The twin: what was asked for, what the machine did and what the simulation would have done, shown and kept while it happens."""

from __future__ import annotations

import asyncio
import contextlib
import time as clock
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lathesim.lessons.simulate import Prepared
from lathesim.live.sample_clock import SampleClock, Stretch
from lathesim.live.samples import LiveError, SampleBlock, Signal, Source
from lathesim.live.watching.residual_stream import ResidualStream
from lathesim.record import FloatArray
from lathesim.record_writer import RecordWriter

_FOR_THE_PERIOD = 20


@dataclass(frozen=True)
class TwinLine:
    """What a line of the twin shows: ``time`` [s], by axis (name, unit, reference, executed, simulated), the largest difference since the
    last line, and how many samples the recording lost."""

    time: float
    axes: tuple[tuple[str, str, float, float, float], ...]
    largest: dict[str, float]
    lost: int


@dataclass(frozen=True, eq=False)
class TwinStretch:
    """What the twin has just done: ``time`` (samples,) [s], the ``reference`` (drives, samples), what was ``executed`` and ``simulated``
    (channels, samples), and the SI ``units`` of both."""

    time: FloatArray
    reference: FloatArray
    executed: FloatArray
    simulated: FloatArray
    units: tuple[tuple[str, ...], tuple[str, ...]]


class Twin:
    """Runs a lesson's simulation beside a source and writes all of it to a record: references, executed channels, simulated ones.

    ``every`` [s] is how often a line is shown; with ``pace`` a recording is played again at its own times.
    """

    def __init__(self, prepared: Prepared, source: Source, out: Path | None, *, every: float = 0.5, pace: bool = False) -> None:
        recordings = prepared.case.lesson.settings.recordings
        if recordings is None or not recordings.drive or not recordings.compare:
            place = str(prepared.case.lesson.path)
            raise LiveError("the lesson does not say what drives it and what is compared.", place=place, remedy="Add 'recordings:'.")
        self._prepared, self._source, self._out, self._every, self._pace = prepared, source, out, every, pace
        self._drive, self._compare = list(recordings.drive), list(recordings.compare)
        self._residuals: ResidualStream | None = None
        self._clock: SampleClock | None = None
        self._writer: RecordWriter | None = None
        self._rows: list[int] = []
        self._units: list[str] = []
        self._largest: FloatArray = np.zeros(0)
        self._next = 0.0
        self._look: Callable[[TwinStretch], None] | None = None
        self.samples = 0

    async def run(self, stop: asyncio.Event, show: Callable[[TwinLine], None], look: Callable[[TwinStretch], None] | None = None) -> str:
        """Show and keep until the source ends or ``stop`` is set; return how it ended. ``look`` gets every sample."""
        self._look = look
        blocks = self._source.blocks()
        ending: asyncio.Task[bool] = asyncio.ensure_future(stop.wait())
        waiting: list[SampleBlock] = []
        begun, status = clock.monotonic(), "complete"
        try:
            while True:
                following = asyncio.ensure_future(_next(blocks))
                await asyncio.wait([following, ending], return_when=asyncio.FIRST_COMPLETED)
                if not following.done():
                    following.cancel()
                    with contextlib.suppress(asyncio.CancelledError, Exception):
                        await following
                    status = "stopped"
                    break
                block = following.result()
                if block is None or stop.is_set():
                    status = "stopped" if stop.is_set() else status
                    break
                waiting.append(block)
                if self._residuals is None and sum(len(item) for item in waiting) < _FOR_THE_PERIOD:
                    continue
                if self._residuals is None:
                    self._begin(np.concatenate([item.time for item in waiting]))
                for item in waiting:
                    await self._take(item, show, begun, stop)
                waiting = []
        finally:
            ending.cancel()
            if self._writer is not None and self._clock is not None:
                self._writer.finish({"sample_period": self._clock.period, "status": status, "source": self._source.name})
        return status

    def _begin(self, time: FloatArray) -> None:
        signals = self._source.signals
        names = [signal.name for signal in signals]
        missing = [name for name in self._drive if name not in names]
        compare = [name for name in self._compare if name in names]
        if missing or not compare:
            fact = f"{self._source.name} has no '{(missing or self._compare)[0]}'."
            raise LiveError(fact, remedy="Add it to the map.")
        self._rows = [names.index(name) for name in (*self._drive, *compare)]
        steps = np.diff(np.sort(time))
        own = self._prepared.plan.assembly.sample_period
        period = own * max(1, round(float(np.median(steps[steps > 0.0])) / own)) if (steps > 0.0).any() else own
        self._clock = SampleClock(period)
        self._residuals = ResidualStream(self._prepared, self._drive, compare, period)
        self._units = [signals[row].unit for row in self._rows]
        self._largest = np.zeros(len(compare))
        if self._out is not None:
            kept = [signals[row] for row in self._rows]
            twins = [Signal(f"twin.{name}", unit) for name, unit in zip(compare, self._units[len(self._drive) :], strict=True)]
            self._writer = RecordWriter(self._out, [signal.as_channel() for signal in (*kept, *twins)], growing=True)

    async def _take(self, block: SampleBlock, show: Callable[[TwinLine], None], begun: float, stop: asyncio.Event) -> None:
        assert self._clock is not None
        size = max(1, round(self._every / self._clock.period))
        for first in range(0, len(block), size):
            if stop.is_set():
                return
            part = slice(first, first + size)
            notes = block.notes if first == 0 else ()
            for stretch in self._clock.take(
                SampleBlock(block.time[part], block.values[self._rows][:, part], notes, block.fresh and first == 0)
            ):
                self._simulate(stretch, show)
                if self._pace:
                    end = stretch.begin + stretch.values.shape[1] * self._clock.period
                    with contextlib.suppress(TimeoutError):
                        await asyncio.wait_for(stop.wait(), max(0.001, begun + end - clock.monotonic()))
            await asyncio.sleep(0)

    def _simulate(self, stretch: Stretch, show: Callable[[TwinLine], None]) -> None:
        assert self._residuals is not None
        assert self._clock is not None
        if stretch.fresh:
            self._residuals.restart()
        residual = self._residuals.take(stretch.values)
        executed = stretch.values[len(self._drive) :]
        simulated = executed - residual.values
        times = stretch.begin + np.arange(stretch.values.shape[1]) * self._clock.period
        if self._writer is not None:
            self._writer.write(times, np.ascontiguousarray(np.vstack([stretch.values, simulated])))
        if self._look is not None:
            count = len(self._drive)
            units = (tuple(self._units[:count]), tuple(self._units[count:]))
            self._look(TwinStretch(np.asarray(times, dtype=np.float64), stretch.values[:count], executed, simulated, units))
        self.samples += stretch.values.shape[1]
        self._largest = np.maximum(self._largest, np.abs(residual.values).max(axis=1))
        if times[-1] >= self._next:
            self._next = float(times[-1]) + self._every
            reference = float(stretch.values[0, -1])
            names = zip(self._residuals.compare, self._units[len(self._drive) :], executed[:, -1], simulated[:, -1], strict=True)
            axes = tuple((name, unit, reference, float(did), float(would)) for name, unit, did, would in names)
            largest = dict(zip(self._residuals.compare, self._largest.tolist(), strict=True))
            show(TwinLine(float(times[-1]), axes, largest, self._clock.counts.get("missing", 0)))
            self._largest[:] = 0.0


async def _next(blocks: AsyncIterator[SampleBlock]) -> SampleBlock | None:
    return await anext(blocks, None)
