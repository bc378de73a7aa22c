"""A servo side and a pipe as sources: what watch, twin and record take is what the machine did."""

from __future__ import annotations

import asyncio
import os
import threading
from pathlib import Path

import numpy as np
import pytest

from lathesim.live.connections import read_address
from lathesim.live.feedback_source import FeedbackSource
from lathesim.live.opening import PipeSource
from lathesim.live.recording_run import record
from lathesim.live.samples import LiveError, SampleBlock, Signal
from lathesim.live.servo_session import ServoSettings
from lathesim.live.streaming import StreamJob, stream
from lathesim.live.wire_format import FrameKind, text_frame
from lathesim.record import load
from tests.cli.command import call
from tests.live.servo import LESSON, PERIOD, Kept, servo_side, wave
from tests.live.streams import stream as measured

X = [(Signal("x_scale.position", "m"), 1e-3), (Signal("x_drive.current", "A"), 1.0)]


async def piped(text: bytes, place: Path) -> tuple[list[SampleBlock], PipeSource]:
    """Return what a pipe gives that this text is written to."""
    os.mkfifo(place)
    writing = threading.Thread(target=lambda: place.write_bytes(text))
    writing.start()
    source = PipeSource(str(place), X, PERIOD)
    found = [block async for block in source.blocks()]
    writing.join()
    return found, source


def whole(blocks: list[SampleBlock]) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Return times, values and notes of blocks."""
    values = np.concatenate([block.values for block in blocks], axis=1)
    return np.concatenate([block.time for block in blocks]), values, [note for block in blocks for note in block.notes]


async def test_who_looks_on_gets_what_was_asked_for_and_what_the_machine_did(tmp_path: Path) -> None:
    kept, stop = Kept(), asyncio.Event()
    async with servo_side(ServoSettings(virtual=True), [], kept) as (_, port):
        source = FeedbackSource(read_address(f"tcp://127.0.0.1:{port}", "tcp"))
        looking = asyncio.create_task(record(source, tmp_path / "r.h5", 60.0, stop, lambda _: None))
        await asyncio.sleep(0.2)
        for _ in range(2):
            points = wave(600)
            await stream(StreamJob(["x"], PERIOD, iter([points])), read_address(str(port), "tcp"), asyncio.Event())
        await asyncio.sleep(0.3)
        stop.set()
        await looking
    seen = load(tmp_path / "r.h5")
    assert len(seen) == 1200
    assert np.array_equal(seen["x_controller.reference"], kept.values[0])
    assert np.allclose(np.diff(seen.time), PERIOD)
    assert np.array_equal(
        seen["x_scale.position"], kept.values[1 + [signal.name for signal in source.signals[1:]].index("x_scale.position")]
    )


async def test_an_onlooker_who_reads_nothing_or_greets_badly_does_not_disturb() -> None:
    log: list[str] = []
    async with servo_side(ServoSettings(virtual=True), log) as (side, port):
        writers = [(await asyncio.open_connection("127.0.0.1", port))[1] for _ in range(12)]
        for writer in writers:
            writer.write(text_frame(FrameKind.HELLO, {"looks_on": True, "udp_port": 9}))
        writers[-1].write(text_frame(FrameKind.HELLO, {"looks_on": True, "udp_port": "x"}))
        result = await stream(StreamJob(["x"], PERIOD, iter([wave(400)])), read_address(str(port), "tcp"), asyncio.Event())
        for writer in writers:
            writer.close()
    assert result.status["arrived"] == 400
    assert side.sessions[0].reason == "complete"
    assert sum("look on; let go" in line for line in log) == 1


async def test_where_no_servo_side_listens_a_sentence_says_so() -> None:
    with pytest.raises(LiveError, match="nothing listens at 127"):
        await anext(FeedbackSource(read_address("tcp://127.0.0.1:1", "tcp")).blocks())


async def test_lines_of_a_pipe_are_samples_with_their_numbers_and_gaps(tmp_path: Path) -> None:
    text = b"7 1.5 0.25\n8 2.5 0.5\n12 3.5,0.75\nwhat is this\n\n13 4.5 1e0\n"
    time, values, notes = whole((await piped(text, tmp_path / "pipe"))[0])
    assert time == pytest.approx([0.0, 1e-3, 5e-3, 6e-3])
    assert values[0] == pytest.approx([1.5e-3, 2.5e-3, 3.5e-3, 4.5e-3])
    assert values[1] == pytest.approx([0.25, 0.5, 0.75, 1.0])
    assert notes == ["a line holds no numbers"]


async def test_an_endless_line_an_overrun_and_wrong_counts_are_told_once(tmp_path: Path) -> None:
    text = b"1 2\n" + b"9" * 3_000_000 + b"\noverrun\n3 4\n5\n6\n7 8\n"
    time, values, notes = whole((await piped(text, tmp_path / "pipe"))[0])
    assert values[1].tolist() == [2.0, 4.0, 8.0]
    assert time == pytest.approx([0.0, 2e-3, 3e-3])
    assert len(notes) == len(set(notes)) == 4
    assert any("longer than 4096 bytes" in note for note in notes)
    assert any("ran over" in note for note in notes)


def test_a_twin_takes_a_pipe_as_it_takes_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    values = measured(3.0, 1)
    values[:3] *= 1e3  # the lesson maps millimetres
    os.mkfifo(tmp_path / "pipe")
    writing = threading.Thread(target=lambda: np.savetxt(tmp_path / "pipe", values.T))
    writing.start()
    said = call(capsys, "twin", LESSON, tmp_path / "pipe", "--out", tmp_path / "twin.h5")
    writing.join()
    assert said.code == 0, said.err
    kept = load(tmp_path / "twin.h5")
    assert len(kept) == 3000
    assert np.abs(kept["x_scale.position"] - kept["twin.x_scale.position"]).max() < 20e-6
