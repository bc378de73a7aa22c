"""The simulated machine as an MTConnect device: its channels as data items, its rows as observations, served by an agent over HTTP.

The agent answers ``/probe``, ``/current`` and ``/sample``, streams at an interval, and gives errors as documents.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
import re
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from urllib.parse import parse_qs, unquote, urlsplit

from lathesim.live.channel_names import PublishedName
from lathesim.live.connections import Listening
from lathesim.live.mtconnect_documents import (
    UNAVAILABLE,
    Agent,
    DataItem,
    Observation,
    ObservationBuffer,
    devices,
    error,
    stamp,
    streams,
    wanted_by,
)
from lathesim.live.publishing import PublishedRow, Publisher
from lathesim.units import from_si

LONGEST_REQUEST = 8192
_WORDS = 3
"""Words of the first line of a request."""
MOST_CONNECTIONS = 64
LONGEST_PATH = 400
"""Characters of an XPath."""
PATIENCE = 10.0
"""Seconds a client may take for its request."""
_BOUNDARY = "lathesim-part"
_COUNT = 100
_HEARTBEAT = 10_000
_LONGEST_INTERVAL = 600_000
"""Milliseconds."""
_STATUS = {200: "OK", 400: "Bad Request", 404: "Not Found", 405: "Method Not Allowed", 431: "Request Header Fields Too Large"}
_CODE_STATUS = {"INVALID_URI": 404, "NO_DEVICE": 404, "UNSUPPORTED": 405}


class RefusalError(Exception):
    """An error that is answered with a document: ``code`` as the standard has it, and a ``sentence``."""

    def __init__(self, code: str, sentence: str) -> None:
        super().__init__(sentence)
        self.code, self.sentence = code, sentence


@dataclass(frozen=True)
class _Asked:
    kind: str
    wanted: set[str] | None
    at: int | None = None
    begin: int | None = None
    count: int = _COUNT
    interval: int | None = None
    heartbeat: int = _HEARTBEAT


class AgentServer(Listening):
    """Answers requests about one agent's buffer."""

    def __init__(self, agent: Agent) -> None:
        super().__init__(most=MOST_CONNECTIONS, longest=LONGEST_REQUEST, option="--mtconnect")
        self.agent = agent

    async def _answer(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            head = await asyncio.wait_for(reader.readuntil(b"\r\n\r\n"), PATIENCE)
        except asyncio.LimitOverrunError:
            await _send(writer, 431, error(self.agent, "INVALID_URI", f"The request is longer than {LONGEST_REQUEST} bytes."))
            return
        words = head.split(b"\r\n", 1)[0].decode("latin-1").split(" ")
        try:
            if len(words) != _WORDS or not words[-1].startswith("HTTP/1"):
                raise RefusalError("INVALID_URI", "This is no HTTP request.")
            if words[0] != "GET":
                raise RefusalError("UNSUPPORTED", f"{words[0]} is not understood; use GET.")
            asked = read_request(self.agent, words[1])
            if asked.interval is not None:
                await self._stream(writer, asked)
                return
            await _send(writer, 200, self._document(asked)[0])
        except RefusalError as refusal:
            await _send(writer, _CODE_STATUS.get(refusal.code, 400), error(self.agent, refusal.code, refusal.sentence))

    def _document(self, asked: _Asked) -> tuple[bytes, int]:
        buffer = self.agent.buffer
        if asked.kind == "probe":
            return devices(self.agent), 0
        if asked.kind == "current":
            return streams(self.agent, buffer.current(asked.at, asked.wanted), buffer.next_sequence), buffer.next_sequence
        begin = asked.begin
        if begin is None:
            begin = buffer.first_sequence if asked.count > 0 else buffer.last_sequence
        entries, following = buffer.since(begin, asked.count, asked.wanted)
        return streams(self.agent, entries, following), following

    async def _stream(self, writer: asyncio.StreamWriter, asked: _Asked) -> None:
        """Send a part at each interval with what is new, and an empty one at every heartbeat."""
        writer.write(
            f"HTTP/1.1 200 OK\r\nContent-Type: multipart/x-mixed-replace;boundary={_BOUNDARY}\r\nCache-Control: no-cache\r\n"
            "Connection: close\r\n\r\n".encode()
        )
        buffer = self.agent.buffer
        following = asked.begin if asked.begin is not None else buffer.first_sequence
        interval, heartbeat = (asked.interval or 0) / 1e3, asked.heartbeat / 1e3
        sent = time.monotonic()
        while True:
            entries: list[Observation] = []
            if asked.kind == "current":
                part: bytes | None = streams(self.agent, buffer.current(None, asked.wanted), buffer.next_sequence)
            else:
                if following < buffer.first_sequence:
                    await _part(writer, error(self.agent, "OUT_OF_RANGE", f"{following} is no longer in the buffer."))
                    break
                entries, following = buffer.since(following, asked.count, asked.wanted)
                quiet = not entries and time.monotonic() - sent < heartbeat
                part = None if quiet else streams(self.agent, entries, following)
            if part is not None:
                await _part(writer, part)
                sent = time.monotonic()
            more = len(entries) == asked.count and following < buffer.next_sequence
            await asyncio.sleep(0.0 if more else max(interval, 0.005))
        writer.write(f"--{_BOUNDARY}--\r\n".encode())
        await writer.drain()


async def _part(writer: asyncio.StreamWriter, document: bytes) -> None:
    writer.write(f"--{_BOUNDARY}\r\nContent-Type: text/xml\r\nContent-Length: {len(document)}\r\n\r\n".encode() + document + b"\r\n")
    await asyncio.wait_for(writer.drain(), PATIENCE)


async def _send(writer: asyncio.StreamWriter, status: int, document: bytes) -> None:
    writer.write(
        f"HTTP/1.1 {status} {_STATUS[status]}\r\nContent-Type: text/xml\r\nContent-Length: {len(document)}\r\n"
        "Connection: close\r\n\r\n".encode()
        + document
    )
    with contextlib.suppress(OSError):
        await asyncio.wait_for(writer.drain(), PATIENCE)


def read_request(agent: Agent, target: str) -> _Asked:
    """Return what a request asks for; :class:`RefusalError` with the code of the standard where it cannot be answered."""
    try:
        parts = urlsplit(target)
    except ValueError:
        raise RefusalError("INVALID_URI", f"'{target}' is not a path; use /probe, /current or /sample.") from None
    steps = [unquote(step) for step in parts.path.split("/") if step]
    if len(steps) > 1 or (steps and steps[0] not in ("probe", "current", "sample")):
        device = steps.pop(0)
        if device != agent.device:
            raise RefusalError("NO_DEVICE", f"There is no device '{device}'; this is {agent.device}.")
    kind = steps[0] if steps else "probe"
    if len(steps) > 1 or kind not in ("probe", "current", "sample"):
        raise RefusalError("INVALID_URI", f"There is nothing at {parts.path}; ask for /probe, /current or /sample.")
    given = {key: values[-1] for key, values in parse_qs(parts.query, keep_blank_values=True).items()}
    known = {"probe": (), "current": ("at", "path", "interval"), "sample": ("from", "count", "path", "interval", "heartbeat")}[kind]
    for key in given:
        if key not in known:
            raise RefusalError("INVALID_PARAMETER_VALUE", f"/{kind} does not know '{key}'.")
    wanted = None
    if "path" in given:
        wanted = wanted_by(agent, given["path"]) if len(given["path"]) <= LONGEST_PATH else None
        if wanted is None or not wanted:
            raise RefusalError("INVALID_XPATH", f"The path '{given['path']}' selects nothing.")
    return _with_numbers(agent, kind, wanted, given)


def _with_numbers(agent: Agent, kind: str, wanted: set[str] | None, given: Mapping[str, str]) -> _Asked:
    buffer = agent.buffer
    at = _number(given, "at", buffer.first_sequence, buffer.last_sequence)
    begin = _number(given, "from", buffer.first_sequence, buffer.next_sequence)
    count = _number(given, "count", -buffer.size, buffer.size)
    interval = _number(given, "interval", 0, _LONGEST_INTERVAL)
    heartbeat = _number(given, "heartbeat", 1, _LONGEST_INTERVAL)
    if count == 0 or (interval is not None and count is not None and count < 0):
        raise RefusalError("OUT_OF_RANGE", "'count' is not above 0.")
    if at is not None and interval is not None:
        raise RefusalError("INVALID_PARAMETER_VALUE", "'at' and 'interval' do not go together.")
    return _Asked(kind, wanted, at, begin, _COUNT if count is None else count, interval, _HEARTBEAT if heartbeat is None else heartbeat)


def _number(given: Mapping[str, str], key: str, low: int, high: int) -> int | None:
    if key not in given:
        return None
    try:
        value = int(given[key])
    except ValueError:
        raise RefusalError("INVALID_PARAMETER_VALUE", f"'{key}' is '{given[key]}', and a whole number is expected.") from None
    if not low <= value <= high:
        raise RefusalError("OUT_OF_RANGE", f"'{key}' is {value}, and must be between {low} and {high}.")
    return value


LONGEST_LINE = 65_536
MOST_AGENTS = 16
"""Largest number of agents connected at once (assumed)."""
_MOST_WAITING = 1 << 20
"""Bytes that may wait for an agent that does not read; beyond it is disconnected (assumed)."""
HEARTBEAT = 10_000
"""Milliseconds between two pings."""


def write_line(time: datetime, pairs: Iterable[tuple[str, str]]) -> str:
    """Return a line; bars and line ends in values become blanks."""
    cells = [stamp(time)]
    for key, value in pairs:
        cells += [key, value.replace("|", " ").replace("\n", " ").replace("\r", " ")]
    return "|".join(cells) + "\n"


class Adapter(Listening):
    """Sends lines to every agent that connects, and answers its pings; an agent that does not read is let go."""

    def __init__(self) -> None:
        super().__init__(most=MOST_AGENTS, longest=LONGEST_LINE, option="--shdr")
        self._writers: set[asyncio.StreamWriter] = set()

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
    items, factors = data_items(names, [signal.unit for signal in publisher.lap.signals])
    buffer = ObservationBuffer(items)
    origin = datetime.now(UTC)
    buffer.unavailable(origin)
    agent = Agent(re.sub(r"\W", "_", publisher.lap.name), int(origin.timestamp()), buffer)
    server, adapter = AgentServer(agent), Adapter()
    listening = [await server.serve(host, port)]
    if adapter_port is not None:
        listening.append(await adapter.serve(host, adapter_port))
    ready(f"http://{host}:{listening[0].sockets[0].getsockname()[1]}/")
    for item, value, level in ((items[-3], "ACTIVE", ""), (items[-2], "AVAILABLE", ""), (items[-1], "", "Normal")):
        buffer.observe(item, origin, value, level)
    count = 0
    try:
        async for rows in publisher.rows(stop):
            for row in rows:
                _observe(buffer, adapter, items, factors, origin, row)
                count += 1
    finally:
        for one in listening:
            one.close()
        await server.close()
        await adapter.close()
    return count


def _observe(
    buffer: ObservationBuffer, adapter: Adapter, items: Sequence[DataItem], factors: Sequence[float], origin: datetime, row: PublishedRow
) -> None:
    when = row.stamp(origin)
    pairs = [
        (item, f"{float(value) * factor:.10g}" if math.isfinite(value) else UNAVAILABLE)
        for item, factor, value in zip(items, factors, row.values, strict=False)
    ]
    for item, text in pairs:
        buffer.observe(item, when, text)
    adapter.send(write_line(when, [(item.name, text) for item, text in pairs]))
