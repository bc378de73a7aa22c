"""Peers that look on while a planner moves the machine: a TCP connection that says what comes, and feedback over UDP."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import Callable
from typing import Any

import numpy as np

from lathesim.live.servo.stepped_machine import SteppedMachine
from lathesim.live.servo.wire_format import Kind, numbers_frame, samples_of_a_datagram, text_frame
from lathesim.live.sources.samples import Signal
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
            kind = socket.AF_INET6 if ":" in address[0] else socket.AF_INET
            self._socket = socket.socket(kind, socket.SOCK_DGRAM)
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
                self._socket.sendto(numbers_frame(Kind.FEEDBACK, first + begin, table[begin : begin + largest]), self._address)

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
                writer.write(text_frame(Kind.HELLO, {**self._greeting, "begin": self._next}))
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
        self._tell(text_frame(Kind.HELLO, {**self._greeting, "begin": self._begun}))

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
            self._tell(text_frame(Kind.STATUS, data))

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


def refuses(onlookers: Onlookers, tell: Callable[[str], None]) -> bool:
    """Return whether there are too many; then it is told."""
    if len(onlookers) < MOST_ONLOOKERS:
        return False
    tell(f"more than {MOST_ONLOOKERS} look on; let go.")
    return True
