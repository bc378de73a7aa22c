"""Streams for what watches them: the axis of the campaign while its values change, as a source, as a record and in blocks."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

import numpy as np

from lathesim.live.samples import SampleBlock, Signal
from lathesim.record import Channel, FloatArray, Record
from lathesim.record_writer import save
from tests.live.campaign.machines import PERIOD, axis

DRIVE = ("x_controller.reference",)
COMPARE = ("x_encoder.position", "x_scale.position", "x_controller.voltage", "x_drive.current")
SIGNALS = tuple(Signal(name, unit) for name, unit in zip((*DRIVE, *COMPARE), ("m", "m", "m", "V", "A"), strict=True))


def stream(seconds: float, seed: int, **changes: FloatArray) -> FloatArray:
    """Return reference, motor, table, voltage and current of the axis of lesson 22, (5, samples)."""
    return axis(seconds, seed, changes)


def in_blocks(values: FloatArray, size: int) -> Iterator[SampleBlock]:
    """Return a stream in blocks of so many samples."""
    for begin in range(0, values.shape[1], size):
        part = values[:, begin : begin + size]
        yield SampleBlock((begin + np.arange(part.shape[1])) * PERIOD, part)


class Streamed:
    """A source that gives a stream in blocks of ``size`` samples, with a ``pause`` [s] after each."""

    name = "stream"

    def __init__(self, values: FloatArray, signals: tuple[Signal, ...] = SIGNALS, size: int = 2000, pause: float = 0.0) -> None:
        self._values, self.signals, self._size, self._pause = values, signals, size, pause

    async def blocks(self) -> AsyncIterator[SampleBlock]:
        """Return the blocks."""
        for block in in_blocks(self._values, self._size):
            yield block
            await asyncio.sleep(self._pause)


def written(values: FloatArray, place: Path) -> Path:
    """Write a stream as a record whose channels are called as the machine's."""
    channels = {signal.name: Channel(signal.name, signal.unit, row) for signal, row in zip(SIGNALS, values, strict=True)}
    save(Record(np.arange(values.shape[1]) * PERIOD, channels, {"sample_period": PERIOD}), place)
    return place
