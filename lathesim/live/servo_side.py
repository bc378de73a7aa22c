"""The servo side of the simulated machine: takes set-points over TCP, moves, and sends feedback over UDP.

One planner at a time moves the machine; whoever else connects is told so and let go. Reading stops while the buffer is full, so a planner
that sends more than there is room for waits, and no set-point is lost. The clock is ``wall`` or ``virtual``: in virtual time a period
passes when there is a set-point for it, and the result depends on nothing else.
"""

from __future__ import annotations

import asyncio
import contextlib
import functools
import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from lathesim.errors import LatheSimError
from lathesim.live.connections import Listening
from lathesim.live.samples import LiveError, SampleSink
from lathesim.live.servo_session import CHUNK, COMPLETE, MOST_ONLOOKERS, PATIENCE, Onlookers, Playing, ServoSettings, Session
from lathesim.live.set_point_buffer import SetPointBuffer
from lathesim.live.stepped_machine import SteppedMachine
from lathesim.live.wire_format import LARGEST_PORT, MOST_AXES, Decoder, Frame, FrameKind, WireError, read_text, text_frame
from lathesim.units import in_unit

MOST_CONNECTIONS = 32
"""Connections that are open at once; more are closed as they come."""
_LONGEST_NAME = 79
MOST_SESSIONS = 100
"""Sessions that are remembered; older ones are forgotten."""
_MOST_KINDS = 200
"""Kinds of faults that are told apart in the log; the rest is one kind."""

MachineMaker = Callable[[tuple[str, ...]], SteppedMachine]


class ServoSide(Listening):
    """Listens at a port and moves the machine of whoever streams to it. ``log`` takes a sentence about each peer."""

    def __init__(
        self,
        make: MachineMaker,
        settings: ServoSettings,
        log: Callable[[str], None],
        open_sink: Callable[[SteppedMachine], SampleSink | None],
    ) -> None:
        super().__init__(most=MOST_CONNECTIONS, longest=CHUNK, option="--listen")
        self._make = make
        self._settings = settings
        self._log = log
        self._open_sink = open_sink
        self._busy = False
        self._told: dict[str, int] = {}
        self._onlookers = Onlookers()
        self.sessions: list[Session] = []
        self.ended = asyncio.Event()

    async def serve(self, host: str, port: int) -> asyncio.Server:
        """Begin to listen; raises :class:`LiveError` where the port cannot be taken."""
        warm = SetPointBuffer(1, 2, 0.5)  # what plays is compiled or loaded now, and not while the clock runs
        warm.put(np.zeros((2, 1)))
        warm.play(1)
        return await super().serve(host, port)

    async def _answer(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        peer = _peer(writer)
        try:
            await self._greet(reader, writer, peer)
        except (WireError, LatheSimError) as error:
            self._tell(f"{peer.partition(':')[0]} {error.fact}", f"{peer}: {error.message}")
            with contextlib.suppress(OSError):
                writer.write(text_frame(FrameKind.ERROR, {"sentence": error.message}))
                await asyncio.wait_for(writer.drain(), 1.0)
        except (TimeoutError, OSError):
            self._tell(f"{peer.partition(':')[0]} silent", f"{peer}: silent for {PATIENCE:g} s, or gone; let go.")

    def _refuse(self, writer: asyncio.StreamWriter) -> None:
        self._tell("more connections than allowed", f"{_peer(writer)}: more than {MOST_CONNECTIONS} connections; let go.")

    def _tell(self, kind: str, sentence: str) -> None:
        """Log each kind of fault once, without regard to its numbers and quoted bytes, and count it."""
        known = re.sub(r"""b?(['"])(\\.|(?!\1).)*\1|\d+""", "", kind)
        if known not in self._told and len(self._told) >= _MOST_KINDS:
            known = ""
        self._told[known] = self._told.get(known, 0) + 1
        if self._told[known] == 1:
            self._log(sentence)

    async def _greet(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, peer: str) -> None:
        decoder = Decoder()
        frames: list[Frame] = []
        deadline = asyncio.get_running_loop().time() + PATIENCE
        while not frames:
            data = await asyncio.wait_for(reader.read(CHUNK), max(0.0, deadline - asyncio.get_running_loop().time()))
            if not data:
                self._tell(f"{peer.partition(':')[0]} no greeting", f"{peer}: went away before its greeting was whole.")
                return
            frames = decoder.feed(data)
        hello = _Greeting.read(frames[0])
        if hello.looks_on:
            if len(self._onlookers) < MOST_ONLOOKERS:
                await self._onlookers.look_on(reader, writer, hello.udp_port)
            else:
                self._tell("onlookers", f"{peer}: more than {MOST_ONLOOKERS} look on; let go.")
            return
        if self._busy:
            raise LiveError("another planner moves the machine.", remedy="Wait until it has ended.")
        self._busy = True
        try:
            machine = self._make(hello.axes)
            if not math.isclose(hello.period, machine.period, rel_tol=1e-9):
                taken = in_unit(machine.period, "ms", "g")
                fact = f"the set-points come every {in_unit(hello.period, 'ms', 'g')}, and the machine takes one every {taken}."
                raise LiveError(fact, remedy=f"Time the path with --period '{taken}'.")
            session = Session(peer)
            self.sessions.append(session)
            del self.sessions[:-MOST_SESSIONS]
            host = writer.get_extra_info("peername")[0]
            writer.write(text_frame(FrameKind.HELLO, _greeting_of(machine, self._settings)))
            self._onlookers.begin(machine)
            playing = Playing(
                self._settings, machine, session, (reader, writer), (host, hello.udp_port), functools.partial(self._open_sink, machine),
                self._tell, self._onlookers,
            )  # fmt: skip
            await playing.run(decoder, frames[1:])
            if session.reason != COMPLETE:
                self._tell(f"{peer.partition(':')[0]} {session.reason}", f"{peer}: {session.reason}; let go.")
        finally:
            self._busy = False
            self.ended.set()


async def serve(
    side: ServoSide, host: str, port: int, stop: asyncio.Event, ready: Callable[[int], None], *, once: bool = False
) -> list[Session]:
    """Listen until ``stop`` is set, or with ``once`` until the first stream has ended; ``ready`` is told the port. Return the sessions."""
    server = await side.serve(host, port)
    ready(server.sockets[0].getsockname()[1])
    waits = [asyncio.ensure_future(event.wait()) for event in ([stop, side.ended] if once else [stop])]
    await asyncio.wait(waits, return_when=asyncio.FIRST_COMPLETED)
    for wait in waits:
        wait.cancel()
    server.close()
    await side.close()
    return side.sessions


def _peer(writer: asyncio.StreamWriter) -> str:
    return ":".join(str(part) for part in writer.get_extra_info("peername")[:2])


def _is_name(value: object) -> bool:
    """Return whether a value is a text of 1 to 79 printable characters."""
    return isinstance(value, str) and 0 < len(value) <= _LONGEST_NAME and value.isprintable()


@dataclass(frozen=True)
class _Greeting:
    """What a planner greets with; a peer that ``looks_on`` greets with its port alone."""

    udp_port: int
    looks_on: bool = False
    axes: tuple[str, ...] = ()
    period: float = 0.0

    @staticmethod
    def read(first: Frame) -> _Greeting:
        if first.kind is not FrameKind.HELLO:
            raise WireError(f"the first frame is {first.kind.name}, and HELLO is expected.")
        data = read_text(first)
        axes, period, port, looks_on = data.get("axes"), data.get("period"), data.get("udp_port", 0), data.get("looks_on") is True
        if not isinstance(port, int) or isinstance(port, bool) or not looks_on <= port <= LARGEST_PORT:
            raise WireError("the greeting has no UDP port.")
        if looks_on:
            return _Greeting(port, looks_on=True)
        if not isinstance(axes, list) or not 1 <= len(axes) <= MOST_AXES or not all(_is_name(name) for name in axes):
            raise WireError("the greeting names no axes.")
        if not isinstance(period, (int, float)) or isinstance(period, bool) or not 0.0 < period <= 1.0:
            raise WireError("the greeting has no period between 0 and 1 s.")
        if len(set(axes)) != len(axes):
            raise WireError("the greeting names an axis twice.")
        return _Greeting(port, axes=tuple(axes), period=float(period))


def _greeting_of(machine: SteppedMachine, settings: ServoSettings) -> dict[str, Any]:
    return {
        "machine": machine.name,
        "axes": list(machine.axes),
        "units": list(machine.axis_units),
        "period": machine.period,
        "capacity": settings.capacity,
        "begin_at": min(settings.begin_at, settings.capacity),
        "clock": "virtual" if settings.virtual else "wall",
        "channels": [[signal.name, signal.unit, signal.description[:80]] for signal in machine.signals][:64],
    }
