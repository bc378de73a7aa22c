"""Publishing one machine in several ways at once: one run or one recording of a lesson, again and again."""

from __future__ import annotations

import asyncio
import time as clock
from collections.abc import AsyncIterator, Callable, Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np

from lathesim.lessons.simulate import Prepared, run_prepared
from lathesim.live.channel_names import PublishedName
from lathesim.live.samples import SAME, LiveError, Signal
from lathesim.plugins import Registry
from lathesim.record import FloatArray, Record


@dataclass(frozen=True, eq=False)
class PublishedRun:
    """Samples of one run: ``values`` (signals, samples) every ``period`` [s]; ``name`` is that of the lesson."""

    name: str
    signals: tuple[Signal, ...]
    period: float
    values: FloatArray

    def __len__(self) -> int:
        return int(self.values.shape[1])

    def sampled(self, rate: float) -> PublishedRun:
        """Return the lap at a lower rate [Hz]: the nearest sample at each instant, as a gateway that polls gives it.

        Raises :class:`LiveError` where the rate is above that of the machine.
        """
        own = 1.0 / self.period
        if rate > own * (1.0 + SAME):
            raise LiveError(f"{rate:g} Hz is above the {own:g} Hz of the machine.", remedy=f"Give a rate up to {own:g} Hz.")
        count = int(np.floor((len(self) - 1) * self.period * rate)) + 1
        rows = np.round(np.arange(count) / rate / self.period).astype(np.int64)
        return PublishedRun(self.name, self.signals, 1.0 / rate, self.values[:, rows])


def lap_of(record: Record, name: str) -> PublishedRun:
    """Return the lap of a record on an even clock."""
    signals = tuple(Signal(channel.name, channel.unit, channel.description) for channel in record.channels.values())
    return PublishedRun(name, signals, record.sample_period, np.array([channel.values for channel in record.channels.values()]))


def simulated_lap(prepared: Prepared) -> PublishedRun:
    """Return a run of the lesson's machine, with the effects that it inserts."""
    return lap_of(run_prepared(prepared), prepared.name)


def recorded_lap(prepared: Prepared, file: Path, registry: Registry) -> PublishedRun:
    """Return a recording of the lesson's machine: the inputs it drives and the channels it compares."""
    from lathesim.identification.replay.loading import read_for

    _, recorded = read_for(prepared, file, registry)
    return lap_of(recorded.record, prepared.name)


@dataclass(frozen=True)
class Faults:
    """What goes wrong on purpose: every ``gap_every`` s nothing for ``gap`` s; values held back and sent together every ``burst`` s; at
    ``jump_at`` s the clock jumps by ``jump`` s."""

    gap_every: float = 0.0
    gap: float = 0.0
    burst: float = 0.0
    jump_at: float = 0.0
    jump: float = 0.0

    def lost(self, time: FloatArray) -> np.typing.NDArray[np.bool_]:
        """Return which instants are not published."""
        if self.gap_every <= 0.0 or self.gap <= 0.0:
            return np.zeros(len(time), dtype=bool)
        phase = np.mod(time + 1e-9, self.gap_every)
        return np.asarray((phase >= self.gap_every - self.gap) & (time > 0.0))

    def shown(self, time: FloatArray) -> FloatArray:
        """Return the instants as the machine's clock shows them."""
        return np.where((self.jump != 0.0) & (time >= self.jump_at), time + self.jump, time)


@dataclass(frozen=True, eq=False)
class PublishedRow:
    """All values of one instant: its number since the start, its time [s] as the machine's clock shows it, and ``values`` (signals,)."""

    number: int
    time: float
    values: FloatArray

    def stamp(self, origin: datetime) -> datetime:
        """Return its time where the machine began at ``origin``."""
        return origin + timedelta(microseconds=round(1e6 * self.time))


class Publisher:
    """Gives the rows that are due: lap after lap, with the faults that were asked for."""

    def __init__(self, lap: PublishedRun, faults: Faults, laps: int = 0) -> None:
        self.lap, self.faults = lap, faults
        self._last = laps * len(lap) if laps else 0
        self._next = 0

    @property
    def finished(self) -> bool:
        """Return whether all laps were given."""
        return bool(self._last) and self._next >= self._last

    def due(self, elapsed: float) -> Iterator[PublishedRow]:
        """Return the rows up to ``elapsed`` [s] after the start that were not given yet."""
        if self.faults.burst > 0.0:
            elapsed = np.floor(elapsed / self.faults.burst) * self.faults.burst
        until = int(np.floor(elapsed / self.lap.period + 1e-9)) + 1
        until = min(until, self._last) if self._last else until
        numbers = np.arange(self._next, max(self._next, until))
        self._next = max(self._next, until)
        times = np.asarray(numbers * self.lap.period, dtype=np.float64)
        lost, shown = self.faults.lost(times), self.faults.shown(times)
        for number, time, gone in zip(numbers, shown, lost, strict=True):
            if not gone:
                yield PublishedRow(int(number), float(time), self.lap.values[:, int(number) % len(self.lap)])

    async def rows(self, stop: asyncio.Event) -> AsyncIterator[Iterator[PublishedRow]]:
        """Yield the rows that are due, again and again until ``stop`` is set or all laps are done; then clients get time for the last."""
        begun = clock.perf_counter()
        while not stop.is_set() and not self.finished:
            yield self.due(clock.perf_counter() - begun)
            await asyncio.sleep(min(0.01, self.lap.period))
        await asyncio.sleep(0.2)


@dataclass(frozen=True)
class Places:
    """Where a machine is published: ``host`` and the ports; None for what is not wanted."""

    host: str
    opcua: int | None
    mtconnect: int | None
    shdr: int | None = None


async def publish_all(
    lap: PublishedRun,
    faults: Faults,
    laps: int,
    names: Sequence[PublishedName],
    places: Places,
    stop: asyncio.Event,
    ready: Callable[[str], None],
) -> list[int]:
    """Publish until all laps are done or ``stop`` is set; return how many instants went out each way."""
    jobs = []
    if places.opcua is not None:
        from lathesim.live.opcua_server import publish_opcua

        jobs.append(publish_opcua(Publisher(lap, faults, laps), names, places.host, places.opcua, stop, ready))
    if places.mtconnect is not None:
        from lathesim.live.mtconnect_publish import publish_mtconnect

        jobs.append(publish_mtconnect(Publisher(lap, faults, laps), names, places.host, places.mtconnect, stop, ready, places.shdr))
    return list(await asyncio.gather(*jobs))
