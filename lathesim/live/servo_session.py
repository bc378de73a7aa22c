"""One planner's session at the servo side, and the peers that look on."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from lathesim.errors import LatheSimError
from lathesim.live.samples import SampleSink, Signal
from lathesim.live.set_point_buffer import ClockStatistics, SetPointBuffer
from lathesim.live.stepped_machine import SteppedMachine
from lathesim.live.wire_format import (
    Decoder,
    Frame,
    FrameKind,
    WireError,
    numbers_frame,
    read_numbers,
    read_total,
    samples_of_a_datagram,
    text_frame,
)
from lathesim.record import FloatArray

MOST_ONLOOKERS = 8
"""Onlookers at once; each costs the servo side the datagrams that it is sent."""
_MOST_CHANNELS = 64
_BEHIND = 1 << 16
"""Bytes that may wait for an onlooker who does not read what he is told; then he is let go."""


class FeedbackSender:
    """Sends samples to a UDP port; what the network does not take at once is lost, as on a real machine, and counted there."""

    def __init__(self, address: tuple[str, int], channels: int) -> None:
        self._channels = channels
        self._socket: socket.socket | None = None
        if address[1]:
            self._socket = socket.socket(socket.AF_INET6 if ":" in address[0] else socket.AF_INET, socket.SOCK_DGRAM)
            self._socket.setblocking(False)
            self._address = address

    def send(self, first: int, values: FloatArray) -> None:
        """Send samples (channels, samples); the first has the number ``first``."""
        if self._socket is None:
            return
        table = values[: self._channels].T
        largest = samples_of_a_datagram(max(1, table.shape[1]))
        for begin in range(0, len(table), largest):
            with contextlib.suppress(OSError):
                self._socket.sendto(numbers_frame(FrameKind.FEEDBACK, first + begin, table[begin : begin + largest]), self._address)

    def close(self) -> None:
        """Close the socket."""
        if self._socket is not None:
            self._socket.close()


class Onlookers:
    """Those who look on. Samples are numbered through all streams; each stream is greeted with the number at which it begins."""

    def __init__(self) -> None:
        self._peers: dict[asyncio.StreamWriter, FeedbackSender] = {}
        self._greeting: dict[str, Any] | None = None
        self._columns: list[int] = []
        self._begun, self._next = 0, 0

    def __len__(self) -> int:
        return len(self._peers)

    async def look_on(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, port: int) -> None:
        """Serve an onlooker until he goes; whatever he sends is let go unread."""
        sender = FeedbackSender((writer.get_extra_info("peername")[0], port), _MOST_CHANNELS)
        self._peers[writer] = sender
        try:
            if self._greeting is not None:
                writer.write(text_frame(FrameKind.HELLO, {**self._greeting, "begin": self._next}))
            while await reader.read(1024):
                pass
        except (OSError, asyncio.CancelledError):
            pass  # he went, or the servo side ends
        finally:
            self._peers.pop(writer, None)
            sender.close()

    def begin(self, machine: SteppedMachine) -> None:
        """Greet all with the machine of a new stream."""
        self._columns = machine.driven_columns
        signals = [*driven_signals(machine), *machine.signals][:_MOST_CHANNELS]
        channels = [[signal.name, signal.unit, signal.description[:80]] for signal in signals]
        self._begun = self._next
        self._greeting = {"machine": machine.name, "period": machine.period, "channels": channels}
        self._tell(text_frame(FrameKind.HELLO, {**self._greeting, "begin": self._begun}))

    def send(self, set_points: FloatArray, values: FloatArray) -> None:
        """Send what was asked for (periods, axes) and what the machine did (channels, periods)."""
        if self._peers:
            table = np.concatenate([set_points[:, self._columns].T, values])
            for sender in self._peers.values():
                sender.send(self._next, table)
        self._next += len(set_points)

    def status(self, data: dict[str, Any]) -> None:
        """Send how full the buffer is."""
        if self._peers:
            self._tell(text_frame(FrameKind.STATUS, data))

    def end(self) -> None:
        """Forget the machine: its stream has ended."""
        self._greeting = None

    def _tell(self, data: bytes) -> None:
        for writer in list(self._peers):
            if writer.transport.get_write_buffer_size() > _BEHIND:
                writer.transport.abort()
                continue
            writer.write(data)


def driven_signals(machine: SteppedMachine) -> list[Signal]:
    """Return the inputs that follow set-points, as signals."""
    return [Signal(target, unit, "set-point") for target, unit in machine.driven]


PATIENCE = 5.0
"""Seconds a peer may take for its greeting, and a planner for its next whole frame, before it is let go."""
COMPLETE = "complete"
"""Reason of a session that ended as it should."""
CHUNK = 1 << 16
"""Bytes read at once."""
_STATUS_EVERY = 0.02
"""Seconds between two reports of the fill to the planner."""
_LONGEST_CATCH_UP = 20
"""Periods computed in one go at most when this computer was away; the rest did not pass for the machine, and is counted."""


@dataclass
class Session:
    """What one planner's stream did."""

    peer: str
    periods: int = 0
    late_periods: int = 0
    reason: str = ""
    clock: ClockStatistics = field(default_factory=ClockStatistics)
    counts: dict[str, float | int] = field(default_factory=dict)


@dataclass(frozen=True)
class ServoSettings:
    """How the servo side plays: room of the buffer, set-points to wait for at the start, elastic rate change per period (None: hold)."""

    capacity: int = 200
    begin_at: int = 50
    rho: float | None = None
    virtual: bool = False


class Playing:
    """One planner's session: reading fills the buffer, playing empties it."""

    def __init__(
        self, settings: ServoSettings, machine: SteppedMachine, session: Session,
        stream: tuple[asyncio.StreamReader, asyncio.StreamWriter], feedback: tuple[str, int],
        open_sink: Callable[[], SampleSink | None], tell: Callable[[str, str], None], onlookers: Onlookers,
    ) -> None:  # fmt: skip
        self._settings, self._machine, self._session, self._tell = settings, machine, session, tell
        self._reader, self._writer = stream
        self._buffer = SetPointBuffer(len(machine.axes), settings.capacity, settings.rho)
        self._room = asyncio.Event()
        self._more = asyncio.Event()
        self._feedback = FeedbackSender(feedback, min(64, len(machine.signals)))
        self._onlookers = onlookers
        self._sink: SampleSink | None = None
        self._open_sink: Callable[[], SampleSink | None] | None = open_sink

    async def run(self, decoder: Decoder, frames: list[Frame]) -> None:
        """Play until the stream has ended or the planner is gone, then tell what happened."""
        playing = asyncio.create_task(self._play())
        reading = asyncio.create_task(self._read(decoder, frames))
        try:
            await asyncio.wait({playing, reading}, return_when=asyncio.FIRST_COMPLETED)
            if reading.done() and not playing.done():
                self._buffer.end()
                self._more.set()
                await playing
            if playing.done() and playing.exception() is not None:
                raise playing.exception()  # type: ignore[misc]
            if reading.done() and reading.exception() is not None:
                raise reading.exception()  # type: ignore[misc]
        except LatheSimError as error:
            self._session.reason = error.fact.removesuffix(".")
            raise
        finally:
            for task in (playing, reading):
                task.cancel()
            await asyncio.gather(playing, reading, return_exceptions=True)
            self._close()
        self._writer.write(text_frame(FrameKind.STATUS, self._status(True)))
        with contextlib.suppress(OSError, TimeoutError):
            await asyncio.wait_for(self._writer.drain(), 1.0)

    def _close(self) -> None:
        count = self._buffer.count()
        session = self._session
        session.periods = self._machine.periods
        names = ("arrived", "consumed", "underruns", "hard_stops")
        session.counts = {**{name: getattr(count, name) for name in names}, "lowest_fill": count.lowest}
        session.reason = session.reason or COMPLETE
        self._feedback.close()
        self._onlookers.end()
        if self._sink is not None:
            with contextlib.suppress(LatheSimError):
                self._sink.finish({"sample_period": self._machine.period, "status": session.reason, "machine": self._machine.name})

    async def _read(self, decoder: Decoder, frames: list[Frame]) -> None:
        """Put what comes into the buffer; stop reading while it is full."""
        expected = 0
        clock = asyncio.get_running_loop().time
        deadline = clock() + PATIENCE
        while True:
            for item in frames:
                if item.kind is FrameKind.END:
                    if read_total(item) != expected:
                        raise WireError(f"the stream ends after {read_total(item)} set-points, and {expected} came.")
                    return
                if item.kind is not FrameKind.SET_POINTS:
                    raise WireError(f"a {item.kind.name} frame came where set-points are expected.")
                numbers = read_numbers(item)
                if numbers.first != expected or numbers.values.shape[1] != len(self._machine.axes):
                    fact = f"set-point {numbers.first} of {numbers.values.shape[1]} axes came, not {expected} of {len(self._machine.axes)}."
                    raise WireError(fact)
                await self._store(numbers.values)
                expected += len(numbers.values)
            if frames:  # single bytes now and then are no frame, and the planner is as good as silent
                deadline = clock() + PATIENCE
            try:
                data = await asyncio.wait_for(self._reader.read(CHUNK), max(0.0, deadline - clock()))
            except TimeoutError:
                self._session.reason = f"the planner was silent for {PATIENCE:g} s after {expected} set-points"
                return
            except OSError:
                data = b""
            if not data:
                self._session.reason = f"the planner went away after {expected} set-points"
                return
            frames = decoder.feed(data)

    async def _store(self, values: FloatArray) -> None:
        while len(values):
            values = values[self._buffer.put(values) :]
            self._more.set()
            if len(values):
                self._room.clear()
                await self._room.wait()

    async def _play(self) -> None:
        while self._buffer.fill < self._settings.begin_at and self._buffer.room and not self._buffer.ended:
            self._more.clear()
            self._writer.write(text_frame(FrameKind.STATUS, self._status(False)))
            await self._more.wait()
        await (self._play_virtual() if self._settings.virtual else self._play_wall())

    async def _play_virtual(self) -> None:
        """Let a period pass for each set-point: as many as there are, however they were grouped."""
        while not self._buffer.finished:
            count = int(self._buffer.fill)
            if count:
                self._move(count)
                self._send_status()
                await asyncio.wait_for(self._writer.drain(), PATIENCE)  # a planner that reads no report is let go
                await asyncio.sleep(0)
            elif not self._buffer.ended:
                self._more.clear()
                await self._more.wait()

    async def _play_wall(self) -> None:
        """Let as many periods pass as the clock says."""
        period = self._machine.period
        begun, done, told = time.perf_counter(), 0, 0.0
        while not self._buffer.finished:
            now = time.perf_counter() - begun
            due = int(now / period) + 1 - done
            if due > _LONGEST_CATCH_UP:
                self._session.late_periods += due - _LONGEST_CATCH_UP
                done += due - _LONGEST_CATCH_UP
                due = _LONGEST_CATCH_UP
            if due > 0:
                self._session.clock.add(max(0.0, now - done * period), self._buffer.fill)
                self._move(due)
                done += due
            if now - told > _STATUS_EVERY:
                told = now
                self._send_status()
            await asyncio.sleep(max(0.0, begun + done * period - time.perf_counter()))

    def _send_status(self) -> None:
        """Report the fill, unless the planner does not read what it is told."""
        self._onlookers.status({"fill": self._buffer.count().fill, "capacity": self._settings.capacity})
        if self._writer.transport.get_write_buffer_size() < CHUNK:
            self._writer.write(text_frame(FrameKind.STATUS, self._status(False)))

    def _move(self, periods: int) -> None:
        first = self._machine.periods
        set_points = self._buffer.play(periods)
        if not len(set_points):
            return
        values = self._machine.advance(set_points)
        if self._buffer.room:
            self._room.set()
        self._feedback.send(first, values)
        self._onlookers.send(set_points, values)
        self._keep(first, np.vstack([set_points.T, values]))

    def _keep(self, first: int, values: FloatArray) -> None:
        """Write samples to the record, which is made with the first ones, so that a mere greeting leaves no record."""
        try:
            if self._open_sink is not None:
                open_sink, self._open_sink = self._open_sink, None
                self._sink = open_sink()
            if self._sink is not None:
                self._sink.write((first + np.arange(values.shape[1], dtype=np.float64)) * self._machine.period, values)
        except LatheSimError as error:
            self._sink = None  # the machine goes on without its record, which is reported once
            self._tell("record", error.message)

    def _status(self, last: bool) -> dict[str, Any]:
        going_on = {"room": self._buffer.room, "periods": self._machine.periods, "last": last}
        return {**vars(self._buffer.count()), **going_on, **({"clock": self._session.clock.as_json()} if last else {})}


def machine_signals(machine: SteppedMachine) -> tuple[Signal, ...]:
    """Return what a session keeps: the set-points it played, then the channels of the machine."""
    played = [
        Signal(f"set_point.{name}", unit, f"set-point of {name}") for name, unit in zip(machine.axes, machine.axis_units, strict=True)
    ]
    return (*played, *machine.signals)
