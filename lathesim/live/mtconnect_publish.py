"""The simulated machine as an MTConnect device: its channels as data items, its rows as observations."""

from __future__ import annotations

import asyncio
import contextlib
import math
import re
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

from lathesim.live.cnc_names import PublishedName
from lathesim.live.connections import Listening
from lathesim.live.mtconnect_agent import AgentServer
from lathesim.live.mtconnect_documents import UNAVAILABLE, Agent, DataItem, ObservationBuffer, stamp
from lathesim.live.publishing import PublishedRow, Publisher
from lathesim.units import from_si

LONGEST_LINE = 65_536
MOST_AGENTS = 16
"""Largest number of agents connected at once (assumed)."""
_MOST_WAITING = 1 << 20
"""Bytes that may wait for an agent that does not read; beyond it is disconnected (assumed)."""
HEARTBEAT = 10_000
"""Milliseconds between two pings."""


@dataclass(frozen=True)
class ShdrLine:
    """A line: its time [UTC] and pairs of key and value."""

    time: datetime
    pairs: tuple[tuple[str, str], ...]


def read_line(line: str) -> ShdrLine | None:
    """Return a line's time and pairs; None for a command (``* ...``), an empty line and what cannot be read."""
    text = line.strip()
    if not text or text.startswith("*"):
        return None
    cells = text.split("|")
    try:
        time = datetime.fromisoformat(cells[0].partition("@")[0].replace("Z", "+00:00"))
    except ValueError:
        return None
    if time.tzinfo is None:
        time = time.replace(tzinfo=UTC)
    if len(cells) < 3:
        return None
    return ShdrLine(time, tuple((cells[at].strip(), cells[at + 1].strip()) for at in range(1, len(cells) - 1, 2)))


def write_line(time: datetime, pairs: Iterable[tuple[str, str]]) -> str:
    """Return a line; bars and line ends in values become blanks."""
    cells = [stamp(time)]
    for key, value in pairs:
        cells += [key, value.replace("|", " ").replace("\n", " ").replace("\r", " ")]
    return "|".join(cells) + "\n"


async def follow_adapter(host: str, port: int, buffer: ObservationBuffer, stop: asyncio.Event, log: Callable[[str], None]) -> None:
    """Take what an adapter sends into a buffer until ``stop`` is set; it is pinged, and when it is gone its items are UNAVAILABLE, once."""
    while not stop.is_set():
        writer = None
        try:
            reader, writer = await asyncio.wait_for(asyncio.open_connection(host, port, limit=LONGEST_LINE), 3.0)
            writer.write(b"* PING\n")
            while not stop.is_set():
                line = await asyncio.wait_for(reader.readline(), 2.0 * HEARTBEAT / 1e3)
                if not line:
                    break
                _take(buffer, line.decode("utf-8", "replace"))
        except (OSError, TimeoutError, ValueError, asyncio.LimitOverrunError) as failure:
            log(f"{host}:{port}: {failure or 'the adapter is silent'}.")
        finally:
            if writer is not None:
                writer.close()
        buffer.unavailable(datetime.now(UTC))
        with contextlib.suppress(TimeoutError, asyncio.TimeoutError):
            await asyncio.wait_for(stop.wait(), 0.5)


def _take(buffer: ObservationBuffer, line: str) -> None:
    found = read_line(line)
    if found is None:
        return
    for key, value in found.pairs:
        item = buffer.item(key)
        if item is not None:
            buffer.observe(item, found.time, value)


class Adapter:
    """Sends lines to every agent that connects, and answers its pings; an agent that does not read is let go."""

    def __init__(self) -> None:
        self._writers: set[asyncio.StreamWriter] = set()
        self._listening = Listening(self._answer, most=MOST_AGENTS, longest=LONGEST_LINE)

    async def serve(self, host: str, port: int) -> asyncio.Server:
        """Begin to listen. Raises :class:`LiveError` if the port cannot be opened."""
        return await self._listening.serve(host, port, option="--shdr")

    async def close(self) -> None:
        """Disconnect all agents."""
        await self._listening.close()

    async def _answer(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._writers.add(writer)
        try:
            while line := await reader.readline():
                if line.strip() == b"* PING":
                    writer.write(f"* PONG {HEARTBEAT}\n".encode())
        except ValueError:  # a line that is too long
            pass
        finally:
            self._writers.discard(writer)

    def send(self, line: str) -> None:
        """Send a line to all."""
        for writer in list(self._writers):
            if writer.is_closing() or writer.transport.get_write_buffer_size() > _MOST_WAITING:
                self._writers.discard(writer)
                writer.transport.abort()
            else:
                writer.write(line.encode())


_KINDS = {
    "m": ("POSITION", "MILLIMETER", "mm"),
    "m/s": ("VELOCITY", "MILLIMETER/SECOND", "mm/s"),
    "rad": ("ANGLE", "DEGREE", "deg"),
    "rad/s": ("ROTARY_VELOCITY", "REVOLUTION/MINUTE", "rpm"),
    "N": ("LINEAR_FORCE", "NEWTON", "N"),
    "N*m": ("TORQUE", "NEWTON_METER", "N*m"),
    "V": ("VOLTAGE", "VOLT", "V"),
    "A": ("AMPERAGE", "AMPERE", "A"),
    "W": ("WATTAGE", "WATT", "W"),
    "m/s^2": ("ACCELERATION", "MILLIMETER/SECOND^2", "mm/s^2"),
    "Hz": ("FREQUENCY", "HERTZ", "Hz"),
    "Pa": ("PRESSURE", "PASCAL", "Pa"),
    "s": ("ACCUMULATED_TIME", "SECOND", "s"),
}
"""Type, units of MTConnect, and the same unit in this program, by SI unit."""
UNITS = {units: unit for _, units, unit in _KINDS.values()}
"""Units of MTConnect to those of this program."""


def data_items(names: Sequence[PublishedName], si_units: Sequence[str]) -> tuple[list[DataItem], list[float]]:
    """Return the data item of each channel, and the factor from SI to its units."""
    items, factors = [], []
    for name, unit in zip(names, si_units, strict=True):
        kind, units, own = _KINDS.get(unit, ("VARIABLE", "", unit))
        component = ("Linear", name.path[1]) if name.path[0] == "CncAxisList" else ("Controller", "controller")
        component = ("Rotary", name.path[1]) if name.path[0] == "CncSpindleList" else component
        commanded = {"CmdPos": "COMMANDED", "ActPos": "ACTUAL"}.get(name.path[-1], "")
        identifier = re.sub(r"\W", "_", name.channel)
        category = "SAMPLE" if unit in _KINDS else "EVENT"  # the standard uses an event for a number without a type
        items.append(DataItem(identifier, name.channel, category, kind, units, commanded, component))
        factors.append(from_si(1.0, own))
    status = ("Controller", "controller")
    items.append(DataItem("execution", "execution", "EVENT", "EXECUTION", component=status))
    items.append(DataItem("availability", "avail", "EVENT", "AVAILABILITY", component=status))
    items.append(DataItem("system", "system", "CONDITION", "SYSTEM", component=status))
    return items, factors


async def publish_mtconnect(
    publisher: Publisher, names: Sequence[PublishedName], host: str, port: int, stop: asyncio.Event, ready: Callable[[str], None],
    adapter_port: int | None = None,
) -> int:  # fmt: skip
    """Publish rows at their times until ``stop`` is set or all laps are done; return how many rows were published.

    With ``adapter_port`` the same lines go out there as SHDR, for an agent of another maker.
    """
    units = [signal.unit for signal in publisher.lap.signals]
    items, factors = data_items(names, units)
    buffer = ObservationBuffer(items)
    origin = datetime.now(UTC)
    buffer.unavailable(origin)
    agent = Agent(re.sub(r"\W", "_", publisher.lap.name), int(origin.timestamp()), buffer)
    server, adapter = AgentServer(agent), Adapter()
    listening = [await server.serve(host, port)]
    if adapter_port is not None:
        listening.append(await adapter.serve(host, adapter_port))
    taken = listening[0].sockets[0].getsockname()[1]
    ready(f"http://{host}:{taken}/")
    for item, value, level in ((items[-3], "ACTIVE", ""), (items[-2], "AVAILABLE", ""), (items[-1], "", "Normal")):
        buffer.observe(item, origin, value, level)
    begun, count = time.perf_counter(), 0
    try:
        while not stop.is_set() and not publisher.finished:
            for row in publisher.due(time.perf_counter() - begun):
                _observe(buffer, adapter, items, factors, origin, row)
                count += 1
            await asyncio.sleep(min(0.01, publisher.lap.period))
        await asyncio.sleep(0.2)
    finally:
        for one in listening:
            one.close()
        await server.close()
        await adapter.close()
    return count


def _observe(
    buffer: ObservationBuffer, adapter: Adapter, items: Sequence[DataItem], factors: Sequence[float], origin: datetime, row: PublishedRow
) -> None:
    when = origin + timedelta(microseconds=round(1e6 * row.time))
    pairs = [
        (item, f"{float(value) * factor:.10g}" if math.isfinite(value) else UNAVAILABLE)
        for item, factor, value in zip(items, factors, row.values, strict=False)
    ]
    for item, text in pairs:
        buffer.observe(item, when, text)
    adapter.send(write_line(when, [(item.name, text) for item, text in pairs]))
