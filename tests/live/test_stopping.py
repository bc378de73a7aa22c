"""Commands of the live machine in processes of their own: Ctrl-C ends each soon and keeps what was recorded; a full disk is told."""

from __future__ import annotations

import contextlib
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from lathesim.record import Channel, Record, load
from lathesim.record_writer import save
from tests.cli.command import environment
from tests.live.campaign.machines import PERIOD, step
from tests.live.servo import LESSON, free_port, wave
from tests.live.streams import stream, written
from tests.tui.terminal import wait

SOON = 10.0
"""Seconds that a busy computer may take for what takes two on an idle one."""


@contextmanager
def running(folder: Path, *arguments: object) -> Iterator[subprocess.Popen[str]]:
    """Start ``lathesim`` in a process of its own, and leave none behind."""
    command = [sys.executable, "-m", "lathesim", *map(str, arguments)]
    process = subprocess.Popen(
        command, cwd=folder, env={**environment(), "PYTHONUNBUFFERED": "1"}, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    try:
        yield process
    finally:
        if process.poll() is None:
            process.kill()
        process.communicate()


def says(process: subprocess.Popen[str], words: str) -> None:
    """Wait for a line that holds ``words``."""
    assert process.stdout is not None
    seen = []
    for line in process.stdout:
        seen.append(line)
        if words in line:
            return
    raise AssertionError("".join(seen))


def interrupted(process: subprocess.Popen[str]) -> str:
    """Press Ctrl-C, wait for the end, and return what was said until then."""
    process.send_signal(signal.SIGINT)
    said, _ = process.communicate(timeout=SOON)
    assert process.returncode == 130, said
    assert "Traceback" not in said
    return said


@pytest.mark.slow
def test_a_twin_ends_and_keeps_what_it_showed(tmp_path: Path) -> None:
    long = written(stream(60.0, 1), tmp_path / "long.h5")
    with running(tmp_path, "twin", LESSON, long, "--every", "0.2 s", "--out", "twin.h5") as twin:
        says(twin, "t = ")
        interrupted(twin)
    kept = load(tmp_path / "twin.h5")
    assert 0 < len(kept) < 60_000
    assert kept.meta["status"] == "stopped"


@pytest.mark.slow
def test_a_watch_ends(tmp_path: Path) -> None:
    long = written(stream(120.0, 1), tmp_path / "long.h5")
    with running(tmp_path, "watch", LESSON, *[long] * 20, "--learn", "20 s") as watch:
        says(watch, "what is usual is learnt")
        interrupted(watch)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="processes are looked for in /proc")
def test_a_watch_ends_with_the_diagnosis_that_it_began(tmp_path: Path) -> None:
    written(stream(80.0, 5, friction=step(80.0, 40.0, 0.0, 8.0)), tmp_path / "r.h5")

    def diagnoses() -> list[Path]:
        found = []
        for place in Path("/proc").glob("[0-9]*/cmdline"):
            with contextlib.suppress(OSError):
                if str(tmp_path).encode() in place.read_bytes() and b"diagnose" in place.read_bytes():
                    found.append(place)
        return found

    with running(tmp_path, "watch", LESSON, tmp_path / "r.h5", "--learn", "20 s", "--out", tmp_path / "out") as watch:
        assert wait(lambda: bool(diagnoses()))
        time.sleep(1.0)
        interrupted(watch)
        assert not diagnoses()


@pytest.mark.slow
def test_a_machine_and_its_stream_end_and_keep_what_was_played(tmp_path: Path) -> None:
    points = wave(60_000)
    save(Record(np.arange(len(points)) * PERIOD, {"x.position": Channel("x.position", "m", points[:, 0])}, {}), tmp_path / "s.h5")
    port = free_port()
    with running(tmp_path, "machine", LESSON, "--listen", port, "--out", "machine.h5") as machine:
        says(machine, "takes set-points")
        with running(tmp_path, "stream", "s.h5", f"127.0.0.1:{port}", "--out", "fed_back.h5") as planner:
            assert wait((tmp_path / "fed_back.h5").exists)
            time.sleep(1.0)
            interrupted(planner)
        assert "stopped" in str(load(tmp_path / "fed_back.h5").meta["status"])
        interrupted(machine)
    assert 0 < len(load(tmp_path / "machine.h5")) < 60_000


@pytest.mark.slow
def test_a_publisher_and_its_recorder_end_and_keep_what_came(tmp_path: Path) -> None:
    port = free_port()
    with running(tmp_path, "publish", LESSON, "--mtconnect", port, "--rate", "50 Hz") as publisher:
        says(publisher, "Published at")
        with running(tmp_path, "record", f"http://127.0.0.1:{port}", "--lesson", LESSON, "--out", "r.h5") as recorder:
            assert wait((tmp_path / "r.h5").exists)
            time.sleep(0.5)
            said = interrupted(recorder)
        assert "stopped" in said
        assert len(load(tmp_path / "r.h5")) > 0
        interrupted(publisher)


FULL = """
import asyncio, resource, signal, sys
import numpy as np
from pathlib import Path
from lathesim.cli.main import run_command_line
from lathesim.errors import LatheSimError
from lathesim.live.recording_run import record
from lathesim.live.samples import SampleBlock, Signal
import lathesim.live.twin

signal.signal(signal.SIGXFSZ, signal.SIG_IGN)

class Endless:
    name, signals = "endless", (Signal("part.c0", "V"),)
    async def blocks(self):
        for begin in range(0, 10_000_000, 10_000):
            yield SampleBlock(1e-3 * np.arange(begin, begin + 10_000), np.random.default_rng(begin).normal(size=(1, 10_000)))

code = 0
resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, resource.RLIM_INFINITY))
for command in sys.argv[1:]:
    if command == "record":
        try:
            asyncio.run(record(Endless(), Path("record.h5"), 60.0, asyncio.Event(), lambda _: None))
        except LatheSimError as error:
            print(error.message, file=sys.stderr)
            code += 1
    else:
        code += run_command_line(command.split())
sys.exit(code)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="the size of a file cannot be limited there")
def test_a_full_disk_is_told_once_and_what_came_before_is_kept(tmp_path: Path) -> None:
    written(stream(20.0, 1), tmp_path / "long.h5")
    commands = ["record", f"twin {LESSON} long.h5 --fast --out twin.h5"]
    done = subprocess.run(
        [sys.executable, "-c", FULL, *commands], cwd=tmp_path, env=environment(), capture_output=True, text=True, check=False
    )
    assert done.returncode == len(commands), done.stderr
    for name in ("record.h5", "twin.h5"):
        assert done.stderr.count(name) == 1, done.stderr
        assert len(load(tmp_path / name)) > 1000  # what came before is kept
    assert not list(tmp_path.glob(".*.part"))
    assert "Traceback" not in done.stderr
