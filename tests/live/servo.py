"""A lesson with one axis under cascade control, its servo side, and set-points for it."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import cache

import numpy as np

from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import Prepared, prepare
from lathesim.live.samples import SampleSink
from lathesim.live.servo_session import ServoSettings
from lathesim.live.servo_side import ServoSide
from lathesim.live.stepped_machine import SteppedMachine, axes_of
from lathesim.plugins import load_registry
from lathesim.record import FloatArray

LESSON = "22_what_is_wrong_with_this_machine"
PERIOD = 1e-3


def free_port() -> int:
    """Return a port that nobody listens at."""
    with socket.socket() as trial:
        trial.bind(("127.0.0.1", 0))
        return int(trial.getsockname()[1])


@cache
def prepared() -> Prepared:
    """Return the lesson's machine."""
    return prepare(load_lesson(LESSON), load_registry([]))


def machine() -> SteppedMachine:
    """Return the lesson's machine at rest; its one axis is called x."""
    ready = prepared()
    return SteppedMachine(ready, axes_of(ready, ("x",), {}))


def wave(samples: int) -> FloatArray:
    """Return a smooth motion of 5 mm from rest to rest, (samples, 1)."""
    s = np.linspace(0.0, 1.0, samples)
    return 5e-3 * (1.0 - np.cos(2.0 * np.pi * s))[:, None]


class Kept:
    """A sink that keeps what it gets."""

    def __init__(self) -> None:
        self.blocks: list[FloatArray] = []
        self.times: list[FloatArray] = []
        self.meta: dict[str, object] = {}
        self.opened = 0

    def write(self, time: FloatArray, values: FloatArray) -> None:
        """Keep a block."""
        self.times.append(time)
        self.blocks.append(values)

    def finish(self, meta: object = None) -> None:
        """Keep the meta."""
        self.meta = dict(meta or {})  # type: ignore[call-overload]

    @property
    def values(self) -> FloatArray:
        """Return all blocks as one, (signals, samples)."""
        return np.concatenate(self.blocks, axis=1)

    @property
    def time(self) -> FloatArray:
        """Return all times."""
        return np.concatenate(self.times)


@asynccontextmanager
async def servo_side(settings: ServoSettings, log: list[str], kept: Kept | None = None) -> AsyncIterator[tuple[ServoSide, int]]:
    """Run a servo side at a free port of the loopback."""
    ready = prepared()

    def open_sink(_: SteppedMachine) -> SampleSink | None:
        if kept is not None:
            kept.opened += 1
        return kept

    side = ServoSide(lambda names: SteppedMachine(ready, axes_of(ready, names, {})), settings, log.append, open_sink)
    server = await side.serve("127.0.0.1", 0)
    try:
        yield side, server.sockets[0].getsockname()[1]
    finally:
        server.close()
        await side.close()
        await asyncio.sleep(0)
