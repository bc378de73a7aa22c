"""SHDR, the line protocol between an adapter and an MTConnect agent: ``time|key|value|key|value``, and a ping with its answer."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from datetime import UTC, datetime

from lathesim.live.mtconnect.mtconnect_buffer import ObservationBuffer
from lathesim.live.mtconnect.mtconnect_documents import stamp
from lathesim.live.sources.listening import Listening

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
