"""The twin: what was asked for, what the machine did and what the simulation would have done, shown and kept while it happens."""

from __future__ import annotations

import asyncio
import contextlib
import time as clock
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lathesim.lessons.simulate import Prepared
from lathesim.live.even_clock import Stretch
from lathesim.live.samples import SampleBlock, Signal, Source
from lathesim.live.session_start import BegunStream, begun_blocks, driven_and_compared
from lathesim.live.watching.residual_stream import ResidualStream
from lathesim.record import FloatArray
from lathesim.record_writer import RecordWriter


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
        self._prepared, self._source, self._out, self._every, self._pace = prepared, source, out, every, pace
        self._channels = driven_and_compared(prepared)
        self._residuals: ResidualStream | None = None
        self._begun: BegunStream | None = None
        self._writer: RecordWriter | None = None
        self._largest: FloatArray = np.zeros(0)
        self._next = 0.0
        self._look: Callable[[TwinStretch], None] | None = None
        self.samples = 0

    async def run(self, stop: asyncio.Event, show: Callable[[TwinLine], None], look: Callable[[TwinStretch], None] | None = None) -> str:
        """Show and keep until the source ends or ``stop`` is set; return how it ended. ``look`` gets every sample."""
        self._look = look
        started = clock.monotonic()
        try:
            async with contextlib.aclosing(begun_blocks(self._prepared, self._source, self._channels, stop)) as blocks:
                async for begun, block in blocks:
                    if self._begun is None:
                        self._begin(begun)
                    await self._take(begun, block, show, started, stop)
        finally:
            status = "stopped" if stop.is_set() else "complete"
            if self._writer is not None and self._begun is not None:
                self._writer.finish({"sample_period": self._begun.clock.period, "status": status, "source": self._source.name})
        return status

    def _begin(self, begun: BegunStream) -> None:
        self._begun = begun
        self._residuals = ResidualStream(self._prepared, begun.drive, begun.compare, begun.clock.period)
        self._largest = np.zeros(len(begun.compare))
        if self._out is not None:
            twins = [Signal(f"twin.{signal.name}", signal.unit) for signal in begun.signals[len(begun.drive) :]]
            self._writer = RecordWriter(self._out, [signal.as_channel() for signal in (*begun.signals, *twins)], growing=True)

    async def _take(
        self, begun: BegunStream, block: SampleBlock, show: Callable[[TwinLine], None], started: float, stop: asyncio.Event
    ) -> None:
        period = begun.clock.period
        size = max(1, round(self._every / period))
        for first in range(0, len(block), size):
            if stop.is_set():
                return
            part = slice(first, first + size)
            notes = block.notes if first == 0 else ()
            for stretch in begun.clock.take(SampleBlock(block.time[part], block.values[:, part], notes, block.fresh and first == 0)):
                self._simulate(begun, stretch, show)
                if self._pace:
                    end = stretch.begin + stretch.values.shape[1] * period
                    with contextlib.suppress(TimeoutError):
                        await asyncio.wait_for(stop.wait(), max(0.001, started + end - clock.monotonic()))
            await asyncio.sleep(0)

    def _simulate(self, begun: BegunStream, stretch: Stretch, show: Callable[[TwinLine], None]) -> None:
        assert self._residuals is not None
        if stretch.fresh:
            self._residuals.restart()
        count, units = len(begun.drive), tuple(signal.unit for signal in begun.signals)
        residual = self._residuals.take(stretch.values)
        executed = stretch.values[count:]
        simulated = executed - residual.values
        times = np.asarray(stretch.begin + np.arange(stretch.values.shape[1]) * begun.clock.period, dtype=np.float64)
        if self._writer is not None:
            self._writer.write(times, np.ascontiguousarray(np.vstack([stretch.values, simulated])))
        if self._look is not None:
            self._look(TwinStretch(times, stretch.values[:count], executed, simulated, (units[:count], units[count:])))
        self.samples += stretch.values.shape[1]
        self._largest = np.maximum(self._largest, np.abs(residual.values).max(axis=1))
        if times[-1] >= self._next:
            self._next = float(times[-1]) + self._every
            reference = float(stretch.values[0, -1])
            names = zip(begun.compare, units[count:], executed[:, -1], simulated[:, -1], strict=True)
            axes = tuple((name, unit, reference, float(did), float(would)) for name, unit, did, would in names)
            largest = dict(zip(begun.compare, self._largest.tolist(), strict=True))
            show(TwinLine(float(times[-1]), axes, largest, begun.clock.counts.get("missing", 0)))
            self._largest[:] = 0.0
