"""Planner and servo side over sockets: the same motion as without them, and peers that do not behave."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import struct
from collections.abc import Awaitable, Callable
from pathlib import Path

import numpy as np
import pytest

from lathesim.cli.live.servo_commands import Records
from lathesim.live import servo_session
from lathesim.live import servo_side as servo_side_module
from lathesim.live.connections import read_address
from lathesim.live.samples import LiveError, SampleSink, Signal
from lathesim.live.servo_session import ServoSettings, machine_signals
from lathesim.live.streaming import StreamJob, StreamResult, stream
from lathesim.live.wire_format import Decoder, FrameKind, numbers_frame, read_text, text_frame
from lathesim.record import load
from tests.live.servo import PERIOD, Kept, machine, servo_side, wave

HELLO = text_frame(FrameKind.HELLO, {"axes": ["x"], "period": PERIOD, "udp_port": 0})


async def send(port: int, samples: int, kept: Kept | None = None, fill: int = 150) -> StreamResult:
    """Stream a wave to a port."""
    points = wave(samples)

    def open_sink(_: tuple[Signal, ...]) -> SampleSink | None:
        return kept

    job = StreamJob(["x"], PERIOD, iter([points[:700], points[700:]]), fill, open_sink)
    return await stream(job, read_address(str(port), "tcp"), asyncio.Event())


async def test_over_tcp_on_the_virtual_clock_the_machine_moves_bit_for_bit_as_without_a_network() -> None:
    alone = machine().advance(wave(1500))
    for fill in (37, 150):
        at_the_machine = Kept()
        async with servo_side(ServoSettings(virtual=True), [], at_the_machine) as (side, port):
            result = await send(port, 1500, fill=fill)
        assert result.status["underruns"] == 0
        assert np.array_equal(at_the_machine.values[1:], alone)
        assert side.sessions[0].reason == "complete"


async def test_on_the_wall_clock_everything_that_was_sent_is_played_and_comes_back() -> None:
    kept, log = Kept(), []
    async with servo_side(ServoSettings(), log) as (side, port):
        result = await send(port, 800, kept)
    assert log == []
    assert result.status["arrived"] == 800
    assert result.status["periods"] == 800 + result.status["underruns"]
    assert result.feedback["received"] + result.feedback["lost"] == result.status["periods"]
    assert kept.values.shape[1] == result.feedback["received"]
    assert np.all(np.diff(kept.time) > 0.0)
    assert side.sessions[0].clock.wakes > 10


async def test_a_planner_that_goes_away_leaves_what_was_recorded() -> None:
    kept, log = Kept(), []
    async with servo_side(ServoSettings(begin_at=10), log, kept) as (side, port):
        _, writer = await asyncio.open_connection("127.0.0.1", port)
        writer.write(HELLO + numbers_frame(FrameKind.SET_POINTS, 0, wave(100)))
        await writer.drain()
        await asyncio.sleep(0.3)
        writer.close()
        await asyncio.wait_for(side.ended.wait(), 5.0)
    assert kept.values.shape[1] >= 100
    assert kept.meta["status"] == "the planner went away after 100 set-points"


HOSTILE = {
    "wrong magic": (b"GET / HTTP/1.1\r\n\r\n", "a frame begins with b'LSET'"),
    "10 MB line": (b"A" * 10_000_000, "a frame begins with b'LSET'"),
    "long frame": (struct.pack("<4sBBHI", b"LSET", 1, 2, 0, 1 << 31), "is too long"),
    "no number": (HELLO + numbers_frame(FrameKind.SET_POINTS, 0, np.array([[np.nan]])), "not finite"),
    "backwards": (
        HELLO + numbers_frame(FrameKind.SET_POINTS, 0, wave(4)) + numbers_frame(FrameKind.SET_POINTS, 2, wave(4)),
        "set-point 2 of 1 axes came, not 4 of 1",
    ),
    "other axes": (HELLO + numbers_frame(FrameKind.SET_POINTS, 0, np.zeros((4, 2))), "set-point 0 of 2 axes came, not 0 of 1"),
    "other period": (text_frame(FrameKind.HELLO, {"axes": ["x"], "period": 0.002}), "the set-points come every 2 ms"),
    "unknown axis": (text_frame(FrameKind.HELLO, {"axes": ["y", "x"], "period": 0.001}), "follows the axis 'y'"),
    "no greeting": (numbers_frame(FrameKind.SET_POINTS, 0, wave(2)), "the first frame is SET_POINTS, and HELLO is expected"),
    "axis that is no text": (text_frame(FrameKind.HELLO, {"axes": ["x\x1b[2J"], "period": 0.001}), "the greeting names no axes"),
    "bad greeting": (text_frame(FrameKind.HELLO, {"axes": ["x"], "period": "soon"}), "the greeting has no period"),
}


@pytest.mark.parametrize("kind", HOSTILE)
async def test_a_peer_that_does_not_keep_to_the_format_is_named_once_and_let_go(kind: str) -> None:
    data, sentence = HOSTILE[kind]
    log: list[str] = []
    async with servo_side(ServoSettings(), log) as (side, port):
        for _ in range(2):
            reader, writer = await asyncio.open_connection("127.0.0.1", port)
            writer.write(data)
            told = b""
            try:
                while piece := await asyncio.wait_for(reader.read(1 << 16), 5.0):
                    told += piece
                frames = Decoder().feed(told)
                assert [read_text(item)["sentence"] for item in frames if item.kind is FrameKind.ERROR]
            except ConnectionError:
                pass  # what was not read is thrown away with the connection
            writer.close()
    assert len([line for line in log if sentence in line]) == 1, log
    assert all(sentence in session.reason for session in side.sessions)


async def test_peers_that_send_various_bytes_are_named_once_together() -> None:
    log: list[str] = []
    async with servo_side(ServoSettings(), log) as (_, port):
        for byte in range(0, 256, 16):
            reader, writer = await asyncio.open_connection("127.0.0.1", port)
            writer.write(bytes([byte, 39, 34, byte]) * 4)
            await asyncio.wait_for(reader.read(), 5.0)
            writer.close()
    assert len(log) == 1, log


async def _silent(writer: asyncio.StreamWriter) -> None:
    """Send nothing."""


async def _slow(writer: asyncio.StreamWriter) -> None:
    """Send a greeting byte by byte, each within the patience and all together beyond it."""
    for byte in HELLO:
        writer.write(bytes([byte]))
        await asyncio.sleep(0.01)


async def _half_a_frame(writer: asyncio.StreamWriter) -> None:
    """Greet, and begin a frame that never ends."""
    writer.write(HELLO + numbers_frame(FrameKind.SET_POINTS, 0, wave(100))[:-9])


async def _byte_by_byte(writer: asyncio.StreamWriter) -> None:
    """Greet, and send a frame so slowly that it never ends."""
    writer.write(HELLO)
    for byte in numbers_frame(FrameKind.SET_POINTS, 0, wave(100))[:12]:
        await asyncio.sleep(0.1)
        with contextlib.suppress(ConnectionError):
            writer.write(bytes([byte]))


async def _half_closed(writer: asyncio.StreamWriter) -> None:
    """Greet, and close the own half of the connection."""
    writer.write(HELLO + numbers_frame(FrameKind.SET_POINTS, 0, wave(100)))
    writer.write_eof()


async def test_a_greeting_alone_opens_no_record() -> None:
    kept = Kept()
    async with servo_side(ServoSettings(200, 50, None, virtual=True), [], kept) as (_, port):
        for _ in range(3):
            reader, writer = await asyncio.open_connection("127.0.0.1", port)
            writer.write(HELLO)
            await reader.readexactly(8)
            writer.close()
            await writer.wait_closed()
            await asyncio.sleep(0)
    assert kept.opened == 0


@pytest.mark.parametrize(
    ("behave", "sentence"),
    [
        (_silent, "silent for 0.3 s"),
        (_slow, "silent for 0.3 s"),
        (_half_a_frame, "the planner was silent"),
        (_byte_by_byte, "the planner was silent"),
        (_half_closed, "went away"),
    ],
)
async def test_a_slow_or_half_open_peer_is_named_once_and_the_next_one_is_served(
    behave: Callable[[asyncio.StreamWriter], Awaitable[None]], sentence: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in (servo_session, servo_side_module):
        monkeypatch.setattr(module, "PATIENCE", 0.3)
    log: list[str] = []
    async with servo_side(ServoSettings(), log) as (side, port):
        for _ in range(2):
            reader, writer = await asyncio.open_connection("127.0.0.1", port)
            await behave(writer)
            with contextlib.suppress(ConnectionError):
                while await asyncio.wait_for(reader.read(1 << 16), 10.0):
                    pass
            writer.close()
        monkeypatch.setattr(servo_session, "PATIENCE", 10.0)
        result = await send(port, 300)
    assert result.reason == "complete"
    assert [sentence in line for line in log] == [True], log
    assert all(sentence in session.reason for session in side.sessions[:-1])


async def test_a_second_planner_and_a_thousand_connections_do_not_disturb_the_first() -> None:
    log: list[str] = []
    async with servo_side(ServoSettings(), log) as (side, port):
        first = asyncio.create_task(send(port, 1200))
        await asyncio.sleep(0.2)
        with pytest.raises(LiveError, match="another planner moves the machine"):
            await send(port, 10)
        crowd = []
        for _ in range(1000):
            one = socket.socket()
            one.setblocking(False)
            one.connect_ex(("127.0.0.1", port))
            crowd.append(one)
            if len(crowd) % 50 == 0:
                await asyncio.sleep(0.001)
        result = await first
        for one in crowd:
            one.close()
    assert result.status["arrived"] == 1200
    assert result.reason == "complete"
    assert len(log) <= 4
    assert side.sessions[0].reason == "complete"


async def test_what_is_no_servo_side_is_told() -> None:
    async def speak(_: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writer.write(b"SSH-2.0-OpenSSH_9.6\r\n")
        await writer.drain()
        writer.close()

    server = await asyncio.start_server(speak, "127.0.0.1", 0)
    port = server.sockets[0].getsockname()[1]
    with pytest.raises(LiveError, match="where a frame begins with"):
        await send(port, 10)
    server.close()
    with pytest.raises(LiveError, match=f"nothing listens at 127.0.0.1:{port}"):
        await send(port, 10)


def test_machines_with_one_name_for_their_records_replace_nothing_of_each_other(tmp_path: Path) -> None:
    first, second = Records(tmp_path / "r.h5"), Records(tmp_path / "r.h5")
    for records in (first, first, second, second, second):
        sink = records.open(machine())
        assert sink is not None
        if records is first:
            sink.write(np.array([0.0]), np.full((len(machine_signals(machine())), 1), 1.0))
            sink.finish({"status": "complete"})
    assert sorted(path.name for path in tmp_path.glob("*.h5")) == ["r.h5", "r_2.h5", "r_3.h5", "r_4.h5"]
    assert [len(load(tmp_path / name)) for name in ("r.h5", "r_2.h5", "r_3.h5", "r_4.h5")] == [1, 1, 0, 0]
