"""The simulated machine over OPC UA: standard names, values that belong together, no loss, and gaps to the sample when it is killed."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import signal
import struct
import subprocess
import sys
from collections.abc import AsyncIterator
from pathlib import Path

import numpy as np
import pytest

from lathesim.live.channel_names import NAMESPACE, PublishedName, map_from, published_names
from lathesim.live.opcua_server import MOST_CONNECTIONS, MOST_SESSIONS, publish_opcua
from lathesim.live.opcua_source import OpcUaSource, browse
from lathesim.live.opening import lesson_signals, map_for, recordings_for
from lathesim.live.publishing import Faults, PublishedRun, Publisher
from lathesim.live.recording_run import Recorder, record
from lathesim.live.samples import LiveError, SampleBlock, Signal
from lathesim.record import load
from tests.cli.command import environment
from tests.live.servo import free_port, prepared

asyncua = pytest.importorskip("asyncua", reason="the extra 'live' is not installed")


def ramp(channels: int, rate: float, seconds: float) -> PublishedRun:
    """Return a lap in which channel k is k + 1 times the number of the sample."""
    numbers = np.arange(int(seconds * rate), dtype=np.float64)
    signals = tuple(Signal(f"part.c{at}", "V") for at in range(channels))
    return PublishedRun("ramp", signals, 1.0 / rate, np.array([(at + 1) * numbers for at in range(channels)]))


def names_of(lap: PublishedRun) -> list[PublishedName]:
    """Return places below Signals."""
    return [PublishedName(signal.name, ("Signals", signal.name), signal.unit) for signal in lap.signals]


def source_of(lap: PublishedRun, port: int) -> OpcUaSource:
    """Return a source of all channels of a lap."""
    channels = {signal.name: {"path": f"Signals/{signal.name}", "unit": "V"} for signal in lap.signals}
    return OpcUaSource(f"opc.tcp://127.0.0.1:{port}", map_from({"channels": channels}, "map"))


async def test_eight_values_come_without_loss_in_order_with_the_stamps_of_the_source(tmp_path: Path) -> None:
    lap, port, stop = ramp(8, 100.0, 2.0), free_port(), asyncio.Event()
    source = source_of(lap, port)
    publishing = asyncio.create_task(publish_opcua(Publisher(lap, Faults()), names_of(lap), "127.0.0.1", port, stop, lambda _: None))
    recorder = Recorder(source, tmp_path / "r.h5")

    async def enough() -> None:
        async for block in source.blocks():
            recorder.take(block)
            if recorder.noted.samples > 100:
                break

    await asyncio.wait_for(enough(), 60.0)
    noted = recorder.finish()
    stop.set()
    await publishing
    kept = load(tmp_path / "r.h5")
    first = kept["part.c0"]
    assert (noted.lost, noted.doubled, noted.gaps) == (0, 0, [])
    assert np.allclose(np.diff(kept.time), 0.01, atol=1e-6)
    assert set(np.diff(first)) <= {1.0, -199.0}
    for at in range(8):
        assert np.array_equal(kept[f"part.c{at}"], (at + 1) * first)


def test_the_lesson_is_found_by_the_names_of_the_standard() -> None:
    ready = prepared()
    places = {entry.channel: "/".join(entry.path) for entry in published_names(ready.machinery, lesson_signals(ready))}
    assert places["x_scale.position"] == "CncAxisList/x_axis/PosDirect/ActPos"
    assert places["x_encoder.position"] == "CncAxisList/x_axis/PosIndirect/ActPos"
    assert places["x_controller.reference"] == "CncAxisList/x_axis/PosDirect/CmdPos"
    units = {"x_controller.reference": "mm", "x_scale.position": "mm", "x_controller.voltage": "V"}
    offered = {places[channel]: unit for channel, unit in units.items()}
    items = map_for(ready, offered, "path")
    assert {item.name for item in items} == set(units)
    mapping = recordings_for(ready, [item.name for item in items])
    assert mapping["drive"] == {"x_controller.reference": {"column": "x_controller.reference", "unit": "m"}}
    assert mapping["compare"]["x_scale.position"]["resolution"] == "50 nm"
    with pytest.raises(LiveError, match="nothing of 22_what_is_wrong_with_this_machine is offered there"):
        map_for(ready, {"Spindle/Speed": "rpm"}, "path")


async def test_where_no_server_answers_a_sentence_says_so() -> None:
    with pytest.raises(LiveError, match=r"no OPC UA server answers at opc\.tcp"):
        await browse(f"opc.tcp://127.0.0.1:{free_port()}", patience=0.2)


class Browsed:
    """Types, units and ranges of what a server publishes, read by a client that shares no code with the source."""

    def __init__(self) -> None:
        self.types: dict[str, str] = {}
        self.units: dict[str, tuple[int, str]] = {}

    async def read(self, node: object, path: str = "") -> None:
        """Read a node and what hangs below it."""
        for child in await node.get_children():  # type: ignore[attr-defined]
            name = (await child.read_browse_name()).Name
            if name == "EngineeringUnits":
                unit = await child.read_value()
                self.units[path] = (unit.UnitId, unit.DisplayName.Text)
                continue
            here = f"{path}/{name}" if path else name
            kind = await child.read_type_definition()
            if kind is not None and kind.NamespaceIndex:
                self.types[here] = str(kind.Identifier)
            await self.read(child, here)


async def test_types_units_and_bounds_of_a_published_machine() -> None:
    """Objects have the types of the standard, units are EUInformation, and clients that are small or many change nothing for others."""
    lap, port, stop, ready = (
        PublishedRun("lap", (Signal("s.x", "m"), Signal("s.f", "N")), 0.01, np.ones((2, 100))),
        free_port(),
        asyncio.Event(),
        asyncio.Event(),
    )
    names = [PublishedName("s.x", ("CncAxisList", "x_axis", "PosDirect", "ActPos"), "mm"), PublishedName("s.f", ("Signals", "s.f"), "N")]
    publishing = asyncio.create_task(publish_opcua(Publisher(lap, Faults()), names, "127.0.0.1", port, stop, lambda _: ready.set()))
    await ready.wait()
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    writer.write(struct.pack("<4sI5Ii", b"HELF", 32, 0, 8192, 8192, 8192, 1, -1))  # takes messages of one chunk only
    assert (await asyncio.wait_for(reader.read(4), 5.0))[:3] == b"ACK"
    writer.close()
    found = Browsed()
    async with asyncua.Client(f"opc.tcp://127.0.0.1:{port}") as client:
        machine = await client.nodes.objects.get_child([f"{await client.get_namespace_index(NAMESPACE)}:CncInterface"])
        assert (await machine.read_type_definition()).Identifier == 1007
        await found.read(machine)
    offered = dict(await browse(f"opc.tcp://127.0.0.1:{port}"))
    clients = [asyncua.Client(f"opc.tcp://127.0.0.1:{port}", timeout=2.0) for _ in range(MOST_SESSIONS + 1)]
    served = []
    for client in clients:
        # one too many may be let in for a moment
        with contextlib.suppress(asyncua.ua.UaError, OSError, TimeoutError):
            await client.connect()
    await asyncio.sleep(0.1)  # ten rounds in which the server lets go of what is too many
    for client in clients:
        with contextlib.suppress(asyncua.ua.UaError, OSError, TimeoutError, AttributeError):
            served.append(await client.nodes.server_state.read_value())
    assert 1 <= len(served) <= MOST_CONNECTIONS
    for client in clients:
        with contextlib.suppress(asyncua.ua.UaError, OSError, TimeoutError, AttributeError):
            client.disconnect_socket()
    stop.set()
    await publishing
    assert found.types == {
        "CncAxisList": "1008", "CncAxisList/x_axis": "1004", "CncAxisList/x_axis/PosDirect": "2001", "CncSpindleList": "1009",
        "CncChannelList": "1010", "CncChannelList/Channel1": "1002",
    }  # fmt: skip
    assert found.units == {"CncAxisList/x_axis/PosDirect/ActPos": (5066068, "mm"), "Signals/s.f": (5129559, "N")}
    assert offered == {"CncAxisList/x_axis/PosDirect/ActPos": "mm", "Signals/s.f": "N"}


SERVER = """
import asyncio, sys, time
from lathesim.live.publishing import Faults, Publisher
from lathesim.live.opcua_server import publish_opcua
from tests.live.test_opcua import names_of, ramp
lap = ramp(2, 200.0, 1000.0)
asyncio.run(publish_opcua(Publisher(lap, Faults()), names_of(lap), "127.0.0.1", int(sys.argv[1]), asyncio.Event(), print))
"""


class Counted:
    """A source that counts what came from it."""

    def __init__(self, source: OpcUaSource) -> None:
        self._source, self.signals, self.name, self.samples = source, source.signals, source.name, 0

    async def blocks(self) -> AsyncIterator[SampleBlock]:
        """Return the blocks of the source."""
        async for block in self._source.blocks():
            self.samples += len(block)
            yield block

    async def more(self, samples: int) -> None:
        """Wait until so many samples more have come."""
        enough = self.samples + samples
        while self.samples < enough:
            await asyncio.sleep(0.05)


@pytest.mark.slow
@pytest.mark.timeout(500)
async def test_after_kills_and_restarts_every_gap_is_in_the_record(tmp_path: Path) -> None:
    lap, port, stop = ramp(2, 200.0, 1000.0), free_port(), asyncio.Event()
    source = Counted(source_of(lap, port))
    recording = asyncio.create_task(record(source, tmp_path / "r.h5", 1e4, stop, lambda _: None))
    kills = 20
    for _ in range(kills):
        server = subprocess.Popen([sys.executable, "-c", SERVER, str(port)], env=environment(), stdout=subprocess.DEVNULL)
        await asyncio.wait_for(source.more(200), 60.0)
        os.kill(server.pid, signal.SIGKILL)
        await asyncio.to_thread(server.wait)
    await asyncio.sleep(1.5)
    stop.set()
    noted = await recording
    kept = load(tmp_path / "r.h5")
    missing = sum(count for _, _, count in noted.gaps)
    expected = round((kept.time[-1] - kept.time[0]) * 200.0) + 1
    restarts = [sentence for _, sentence in noted.notes if sentence == "the server was away"]
    assert len(restarts) == kills - 1
    assert abs(len(kept) + missing - expected) <= len(noted.gaps)
    assert json.loads(str(kept.meta["recording"]))["lost"] == missing
    assert np.array_equal(kept["part.c1"], 2.0 * kept["part.c0"])


@pytest.mark.slow
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("seconds", [60.0, 600.0])
async def test_eight_values_at_a_kilohertz_come_without_loss(tmp_path: Path, seconds: float) -> None:
    port = free_port()
    text = SERVER.replace("ramp(2, 200.0, 1000.0)", "ramp(8, 1000.0, 1000.0)")
    server = subprocess.Popen([sys.executable, "-c", text, str(port)], env=environment(), stdout=subprocess.DEVNULL)
    try:
        noted = await record(source_of(ramp(8, 1000.0, 1.0), port), tmp_path / "r.h5", seconds, asyncio.Event(), lambda _: None)
    finally:
        server.terminate()
        await asyncio.to_thread(server.wait)
    kept = load(tmp_path / "r.h5")
    print(f"{len(kept)} samples in {seconds:g} s, {noted.lost} lost, {noted.doubled} doubled")
    assert len(kept) > 500 * seconds
    assert (noted.lost, noted.doubled) == (0, 0)
    assert np.all(np.diff(kept["part.c0"]) == 1.0)
    assert np.array_equal(kept["part.c7"], 8.0 * kept["part.c0"])
