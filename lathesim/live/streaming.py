"""The planner's side of a stream: set-points out over TCP as there is room for them, feedback in over UDP; or all without a network.

On a virtual clock planner, buffer and machine run in one process, bit-repeatable. The planner is busy now and then, as one on an ordinary
computer is: in period k, when k has reached the next turn, it fills the buffer up to F and is away for ``least`` + Exp(``mean``) periods.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from lathesim.errors import LatheSimError
from lathesim.live.connections import Address
from lathesim.live.feedback_source import FeedbackOrder, Inbox, channels_told, servo_link
from lathesim.live.samples import LiveError, SampleSink, Signal
from lathesim.live.set_point_buffer import BufferCount, SetPointBuffer
from lathesim.live.stepped_machine import LARGEST_BLOCK, SteppedMachine
from lathesim.live.wire_format import LARGEST_PAYLOAD, Decoder, FrameKind, Numbers, WireError, end_frame, numbers_frame, read_text
from lathesim.record import FloatArray

PATIENCE = 15.0
"""Seconds the servo side may be silent before the stream is given up."""
_LARGEST_FRAME = LARGEST_PAYLOAD // 8 - 64
"""Numbers of a frame of set-points at most."""


@dataclass
class StreamResult:
    """What a stream did: the last report of the servo side, counts of the feedback, and what to tell."""

    sent: int = 0
    status: dict[str, Any] = field(default_factory=dict)
    feedback: dict[str, int] = field(default_factory=dict)
    dropped: int = 0
    machine: str = ""
    reason: str = "complete"

    def as_json(self) -> dict[str, Any]:
        """Return the result as plain data."""
        feedback = {**self.feedback, "datagrams_dropped": self.dropped}
        return {"machine": self.machine, "sent": self.sent, "ended": self.reason, "servo": self.status, "feedback": feedback}


@dataclass
class StreamJob:
    """A stream to be sent: names of the ``axes``, the ``period`` [s], blocks of set-points (count, axes), how full to keep the buffer."""

    axes: Sequence[str]
    period: float
    blocks: Iterator[FloatArray]
    fill: int = 150
    open_sink: Callable[[tuple[Signal, ...]], SampleSink | None] = lambda signals: None
    progress: Callable[[float], None] = lambda seconds: None


async def stream(job: StreamJob, address: Address, stop: asyncio.Event) -> StreamResult:
    """Send a stream and take its feedback; raises :class:`LiveError` where the peer refuses or is no servo side.

    When ``stop`` is set, no more is sent, the machine plays what it has, and the result says so.
    """
    result = StreamResult()
    async with servo_link(address, {"axes": list(job.axes), "period": job.period}, PATIENCE) as (reader, writer, inbox):
        try:
            await _converse(job, reader, writer, inbox, result, stop)
        except (OSError, TimeoutError):
            result.reason = "the servo side went away"
        result.dropped = inbox.dropped
    return result


class _Feedback:
    """Takes the datagrams apart and writes the samples, in order, to a sink."""

    def __init__(self, job: StreamJob, greeting: dict[str, Any]) -> None:
        self._job = job
        self.order = FeedbackOrder()
        signals = channels_told({"channels": [], **greeting})
        if signals is None:
            raise WireError("the servo side names no channels.")
        self.signals = signals
        self._sink = job.open_sink(signals)

    def take(self, inbox: Inbox) -> None:
        """Take what has come."""
        for numbers in inbox.numbers(len(self.signals)):
            self._write(self.order.take(numbers))

    def _write(self, runs: list[Numbers]) -> None:
        for run in runs:
            if self._sink is not None:
                times = (run.first + np.arange(len(run.values), dtype=np.float64)) * self._job.period
                self._sink.write(times, np.ascontiguousarray(run.values.T))

    def finish(self, result: StreamResult) -> None:
        """Write what still waits, and close the sink with what happened."""
        self._write(self.order.rest())
        result.feedback = self.order.as_json()
        if self._sink is not None:
            lost = result.feedback["lost"]
            note = f"{lost} samples were lost on the way" if lost else ""
            self._sink.finish({"sample_period": self._job.period, "status": result.reason, "machine": result.machine, "notes": note})


async def _converse(
    job: StreamJob, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, inbox: Inbox, result: StreamResult, stop: asyncio.Event
) -> None:
    frames = _frames(reader)
    greeting = await _next(frames)
    if greeting[0] is not FrameKind.HELLO:
        raise WireError("the servo side did not greet.")
    result.machine = str(greeting[1].get("machine", ""))[:200]
    feedback = _Feedback(job, greeting[1])
    out = _Outgoing(job, writer, int(greeting[1].get("capacity", 0)), int(greeting[1].get("begin_at", 0)))
    failure: LatheSimError | None = None
    try:
        await out.send(0, 0.0, stop)
        while True:
            kind, data = await _next(frames)
            feedback.take(inbox)
            if kind is not FrameKind.STATUS:
                continue
            result.status, result.sent = data, out.sent
            if data.get("last"):
                break
            job.progress(float(data.get("periods", 0)) * job.period)
            await out.send(int(data.get("arrived", 0)), float(data.get("fill", 0.0)), stop)
        if stop.is_set():
            result.reason = "stopped"
    except LatheSimError as error:
        failure = error
        result.reason = error.fact
    except (TypeError, ValueError):
        failure = WireError("the servo side sent a report that cannot be read.")
        result.reason = failure.fact
    result.sent = out.sent
    await asyncio.sleep(0.05)  # the last datagrams are still on their way
    feedback.take(inbox)
    feedback.finish(result)
    if failure is not None:
        raise failure


class _Outgoing:
    """Set-points on their way out: as many as keep the buffer of the servo side at the fill that is wanted."""

    def __init__(self, job: StreamJob, writer: asyncio.StreamWriter, capacity: int, begin_at: int) -> None:
        self._job, self._writer = job, writer
        wanted = max(job.fill, begin_at)  # with fewer the servo side would wait for more
        self._target = min(wanted, capacity) if capacity > 0 else wanted
        self._rest: FloatArray = np.zeros((0, len(job.axes)))
        self._ended = False
        self.sent = 0

    async def send(self, arrived: int, fill: float, stop: asyncio.Event) -> None:
        """Send what there is room for: the wanted fill, less what waits there and what is on its way."""
        if self._ended:
            return
        room = self._target - int(np.ceil(fill)) - (self.sent - arrived)
        while room > 0 and not stop.is_set():
            if not len(self._rest):
                following = next(self._job.blocks, None)
                if following is None:
                    break
                self._rest = following
            count = min(room, len(self._rest), _LARGEST_FRAME // len(self._job.axes))
            self._writer.write(numbers_frame(FrameKind.SET_POINTS, self.sent, self._rest[:count]))
            self._rest = self._rest[count:]
            self.sent += count
            room -= count
        if stop.is_set() or (room > 0 and not len(self._rest)):
            self._writer.write(end_frame(self.sent))
            self._ended = True
        await asyncio.wait_for(self._writer.drain(), PATIENCE)


async def _next(frames: Any) -> tuple[FrameKind, dict[str, Any]]:
    try:
        item: tuple[FrameKind, dict[str, Any]] = await asyncio.wait_for(anext(frames), PATIENCE)
    except StopAsyncIteration:
        raise LiveError("the servo side closed the connection.") from None
    except TimeoutError:
        raise LiveError(f"the servo side has been silent for {PATIENCE:g} s.") from None
    if item[0] is FrameKind.ERROR:
        raise LiveError(str(item[1].get("sentence", "the servo side refuses."))[:500])
    return item


async def _frames(reader: asyncio.StreamReader) -> Any:
    """Return the texts that the servo side sends, one after another."""
    decoder = Decoder()
    while data := await reader.read(1 << 16):
        for item in decoder.feed(data):
            if item.kind not in (FrameKind.HELLO, FrameKind.STATUS, FrameKind.ERROR):
                raise WireError(f"the servo side sent a {item.kind.name} frame.")
            yield item.kind, read_text(item)


@dataclass(frozen=True)
class Planner:
    """How the planner fills the buffer: up to ``fill`` set-points, away for ``least`` + Exp(``mean``) periods; ``mean`` 0: never away."""

    fill: int = 150
    least: float = 5.0
    mean: float = 15.0
    seed: int = 0


def stream_virtually(
    blocks: Iterator[FloatArray],
    machine: SteppedMachine | None,
    buffer: SetPointBuffer,
    planner: Planner,
    sink: SampleSink | None = None,
    progress: Callable[[float], None] = lambda seconds: None,
) -> BufferCount:
    """Return what the buffer saw while the machine played a stream; what it did goes to ``sink`` block by block.

    Without a machine only the set-points that were played go to the sink, at a period of 1 s.
    """
    rng = np.random.default_rng(planner.seed)
    feed = _Feed(blocks)
    going = _Going(machine, sink, progress)
    turn = 0.0
    while not buffer.finished:
        if going.periods >= turn:
            feed.fill(buffer, planner.fill)
            turn = going.periods + (planner.least + rng.exponential(planner.mean) if planner.mean > 0.0 else 1.0)
        until = max(1, int(np.ceil(turn)) - going.periods)
        if planner.mean <= 0.0:
            until = max(1, min(LARGEST_BLOCK, int(buffer.fill)))
        going.play(buffer.play(until))
        if buffer.ended and buffer.fill <= 0.0:
            break
    going.flush()
    return buffer.count()


class _Feed:
    """The set-points that are still to come."""

    def __init__(self, blocks: Iterator[FloatArray]) -> None:
        self._blocks = blocks
        self._rest: FloatArray = np.zeros((0, 0))

    def fill(self, buffer: SetPointBuffer, level: int) -> None:
        """Fill the buffer up to a level, and end it where nothing is left."""
        room = int(np.ceil(min(level, buffer.capacity) - buffer.fill))
        while self._are_left(buffer) and room > 0:
            taken = buffer.put(self._rest[:room])
            self._rest = self._rest[taken:]
            room = room - taken if taken else 0

    def _are_left(self, buffer: SetPointBuffer) -> bool:
        """Return whether there are more set-points; without any the buffer ends."""
        if not len(self._rest) and not buffer.ended:
            following = next(self._blocks, None)
            if following is None:
                buffer.end()
            else:
                self._rest = following
        return not buffer.ended


class _Going:
    """The machine going on: set-points are gathered, so that it is called once for many periods."""

    def __init__(self, machine: SteppedMachine | None, sink: SampleSink | None, progress: Callable[[float], None]) -> None:
        self._machine, self._sink, self._progress = machine, sink, progress
        self._period = machine.period if machine is not None else 1.0
        self._waiting: list[FloatArray] = []
        self._count = 0
        self._done = 0
        self.periods = 0

    def play(self, set_points: FloatArray) -> None:
        """Take the set-points of the next periods."""
        self._waiting.append(set_points)
        self._count += len(set_points)
        self.periods += len(set_points)
        if self._count >= LARGEST_BLOCK:
            self.flush()

    def flush(self) -> None:
        """Let the machine move by what has been gathered."""
        if not self._count:
            return
        set_points = np.concatenate(self._waiting)
        self._waiting, self._count = [], 0
        rows = [set_points.T] if self._machine is None else [set_points.T, self._machine.advance(set_points)]
        if self._sink is not None:
            times = (self._done + np.arange(len(set_points), dtype=np.float64)) * self._period
            self._sink.write(times, np.ascontiguousarray(np.vstack(rows)))
        self._done += len(set_points)
        self._progress(self._done * self._period)
