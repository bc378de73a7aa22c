"""Feedback of a servo side: put in order again, and as a source while another one plans."""

from __future__ import annotations

import asyncio
import contextlib
from collections import deque
from collections.abc import AsyncIterator, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from lathesim.live.connections import Address
from lathesim.live.samples import LiveError, SampleBlock, Signal
from lathesim.live.wire_format import (
    Decoder,
    FrameKind,
    Numbers,
    WireError,
    describes_channel,
    read_datagram,
    read_numbers,
    read_text,
    text_frame,
)
from lathesim.record import FloatArray

WAIT = 512
"""Samples that may come before an earlier one that is still missing; then that one is lost."""


@dataclass
class FeedbackOrder:
    """Takes numbered samples as they come and returns them in order; memory is at most ``WAIT`` samples and one datagram.

    ``lost`` counts samples that did not come in time, ``doubled`` those that came again, ``late`` those that came after they were given up,
    ``reordered`` those that came after a later one and were still in time.
    """

    expected: int = 0
    received: int = 0
    lost: int = 0
    doubled: int = 0
    late: int = 0
    reordered: int = 0
    _waiting: dict[int, FloatArray] = field(default_factory=dict)
    _given_up: list[tuple[int, int]] = field(default_factory=list)
    _newest: int = -1

    def take(self, numbers: Numbers) -> list[Numbers]:
        """Return the runs of samples, each whole and in order, that are known now."""
        for at, row in enumerate(numbers.values):
            number = numbers.first + at
            if number < self.expected:
                if any(begin <= number < end for begin, end in self._given_up):
                    self.late += 1
                else:
                    self.doubled += 1
            elif number in self._waiting:
                self.doubled += 1
            else:
                self.reordered += number < self._newest
                self._newest = max(self._newest, number)
                self._waiting[number] = row
        return self._known(False)

    def rest(self) -> list[Numbers]:
        """Return what still waits at the end; what is missing between is lost."""
        return self._known(True)

    def _known(self, all_of_it: bool) -> list[Numbers]:
        found = []
        while self._waiting:
            run = []
            first = self.expected
            while self.expected in self._waiting:
                run.append(self._waiting.pop(self.expected))
                self.expected += 1
            if run:
                self.received += len(run)
                found.append(Numbers(first, np.array(run)))
            if not self._waiting or (self._newest - self.expected < WAIT and not all_of_it):
                break
            following = min(self._waiting)
            self.lost += following - self.expected
            self._given_up = [*self._given_up[-15:], (self.expected, following)]
            self.expected = following
        return found

    def as_json(self) -> dict[str, int]:
        """Return the counts as plain data."""
        return {name: getattr(self, name) for name in ("received", "lost", "doubled", "late", "reordered")}


_PATIENCE = 10.0
"""Seconds a servo side may take to accept the connection."""
_ROOM = 4096
"""Datagrams that wait at most; then the oldest is dropped and counted."""
_EVERY = 0.02
"""Seconds between two looks at what has come."""


class Inbox(asyncio.DatagramProtocol):
    """The newest datagrams of a servo side, and how many were ``dropped``; those of others are left out."""

    def __init__(self, peer: str) -> None:
        self._peer = peer
        self.waiting: deque[bytes] = deque(maxlen=_ROOM)
        self.dropped = 0

    def datagram_received(self, data: bytes, addr: Any) -> None:
        """Keep a datagram of the peer; the oldest goes where there is no room."""
        if addr[0] == self._peer:
            self.dropped += len(self.waiting) == _ROOM
            self.waiting.append(data)

    def numbers(self, channels: int) -> Iterator[Numbers]:
        """Take what waits and yield the samples of so many channels; what is no feedback of this machine is left out."""
        while self.waiting:
            with contextlib.suppress(WireError):
                frame = read_datagram(self.waiting.popleft())
                if frame.kind is FrameKind.FEEDBACK:
                    numbers = read_numbers(frame)
                    if numbers.values.shape[1] == channels:
                        yield numbers


@contextlib.asynccontextmanager
async def servo_link(
    address: Address, greeting: Mapping[str, Any], patience: float = _PATIENCE
) -> AsyncIterator[tuple[asyncio.StreamReader, asyncio.StreamWriter, Inbox]]:
    """Connect to a servo side, open a port for its feedback and greet it. Raises :class:`LiveError` where nothing listens."""
    try:
        reader, writer = await asyncio.wait_for(asyncio.open_connection(address.host, address.port), patience)
    except (OSError, TimeoutError):
        remedy = f"Start it with 'lathesim machine LESSON --listen {address.port}'."
        raise LiveError(f"nothing listens at {address.host}:{address.port}.", remedy=remedy) from None
    inbox = Inbox(writer.get_extra_info("peername")[0])
    own = writer.get_extra_info("sockname")[0]
    transport, _ = await asyncio.get_running_loop().create_datagram_endpoint(lambda: inbox, local_addr=(own, 0))
    try:
        writer.write(text_frame(FrameKind.HELLO, {**greeting, "udp_port": transport.get_extra_info("sockname")[1]}))
        yield reader, writer, inbox
    finally:
        transport.close()
        writer.close()


def channels_told(told: Mapping[str, Any]) -> tuple[Signal, ...] | None:
    """Return the channels that a servo side names in its greeting; none where it names them in no known form."""
    channels = told.get("channels")
    return tuple(Signal(*row) for row in channels) if isinstance(channels, list) and all(map(describes_channel, channels)) else None


@dataclass
class FeedbackSource:
    """Samples of the machine behind ``tcp://host:port``: the inputs that follow set-points, and the channels that it records.

    The signals are known once a stream has begun. Time is the number of the sample times the period. Datagrams that are lost are gaps.
    ``remarks`` says what was odd, ``fill`` how many set-points wait at the servo side, and for how many there is room.
    """

    address: Address
    signals: tuple[Signal, ...] = ()
    remarks: list[str] = field(default_factory=list)
    fill: tuple[float, float] | None = None
    _period: float = 0.0
    _begins: deque[int] = field(default_factory=lambda: deque(maxlen=64))
    _gone: bool = False
    _fault: LiveError | None = None

    @property
    def name(self) -> str:
        """Return the address."""
        return f"tcp://{self.address.host}:{self.address.port}"

    async def blocks(self) -> AsyncIterator[SampleBlock]:
        """Return samples as they come, until the servo side goes; raises :class:`LiveError` where there is none."""
        async with servo_link(self.address, {"looks_on": True}) as (reader, _, inbox):
            listening = asyncio.ensure_future(self._listen(reader))
            try:
                async for block in self._flow(inbox):
                    yield block
            finally:
                listening.cancel()
                await asyncio.gather(listening, return_exceptions=True)
        if self._fault is not None:
            raise self._fault

    async def _listen(self, reader: asyncio.StreamReader) -> None:
        """Take the greetings of streams that begin."""
        decoder = Decoder()
        try:
            while data := await reader.read(1 << 16):
                for frame in decoder.feed(data):
                    told = read_text(frame)
                    if frame.kind is FrameKind.ERROR:
                        raise LiveError(str(told.get("sentence", "the servo side refuses."))[:500])
                    if frame.kind is FrameKind.STATUS:
                        self._filled(told)
                        continue
                    self._greeted(told)
        except LiveError as error:
            self._fault = error
        except OSError:
            pass
        finally:
            self._gone = True

    def _filled(self, told: dict[str, Any]) -> None:
        fill, capacity = told.get("fill"), told.get("capacity")
        if isinstance(fill, (int, float)) and isinstance(capacity, (int, float)) and capacity > 0:
            self.fill = (float(fill), float(capacity))

    def _greeted(self, told: dict[str, Any]) -> None:
        signals, period, begin = channels_told(told), told.get("period"), told.get("begin")
        if signals is None or not isinstance(period, float) or not 0.0 < period <= 1.0 or not isinstance(begin, int) or begin < 0:
            raise WireError("the servo side does not say what it sends.")
        if self.signals and (signals != self.signals or period != self._period):
            raise LiveError("the next stream moves another machine, or other axes of it.", remedy="Begin anew.")
        self.signals, self._period = signals, period
        self._begins.append(begin)

    async def _flow(self, inbox: Inbox) -> AsyncIterator[SampleBlock]:
        order, fresh = FeedbackOrder(), False
        while not self._gone or inbox.waiting:
            runs: list[tuple[Numbers, bool]] = []
            for numbers in inbox.numbers(len(self.signals)) if self.signals else ():
                while self._begins and numbers.first >= self._begins[0]:
                    runs += [(run, False) for run in order.rest()]
                    order, fresh = FeedbackOrder(expected=self._begins.popleft()), True
                for run in order.take(numbers):
                    if runs and not fresh and runs[-1][0].first + len(runs[-1][0].values) == run.first:
                        runs[-1] = (Numbers(runs[-1][0].first, np.concatenate([runs[-1][0].values, run.values])), runs[-1][1])
                    else:
                        runs.append((run, fresh))
                    fresh = False
            for run, begins in runs:
                yield self._block(run, begins)
            await asyncio.sleep(_EVERY if not runs else 0.0)
        for run in order.rest():
            yield self._block(run, False)

    def _block(self, run: Numbers, fresh: bool) -> SampleBlock:
        time = (run.first + np.arange(len(run.values), dtype=np.float64)) * self._period
        return SampleBlock(time, np.ascontiguousarray(run.values.T), (), fresh)
