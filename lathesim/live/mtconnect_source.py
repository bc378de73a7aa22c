"""An MTConnect agent as a source: it reads /probe, keeps a cursor, follows /sample, and says what it lost."""

from __future__ import annotations

import asyncio
import contextlib
import os
import re
from collections.abc import AsyncIterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from xml.etree import ElementTree

import numpy as np

from lathesim.errors import nearest
from lathesim.live.channel_names import MappedItem
from lathesim.live.connections import Address
from lathesim.live.even_clock import RowAssembly
from lathesim.live.mtconnect_publish import UNITS
from lathesim.live.samples import LiveError, SampleBlock, Signal

_LARGEST = 1 << 24
"""Bytes of a document at most."""
_COUNT = 10_000
_PATIENCE = 10.0
"""Longest time of an agent for a whole answer [s] (assumed)."""
_QUIET = 1.5
_LARGEST_SEQUENCE = 1 << 64


class AgentAwayError(Exception):
    """The agent does not answer, or its answer is not an MTConnect document; the message says which."""


@dataclass(frozen=True)
class Header:
    """What a client leans on in a header."""

    instance: str
    first: int
    last: int
    following: int
    size: int


class MTConnectSource:
    """Values of ``items`` (by id or name of a data item) from the agent at ``address``, asked for every ``interval`` [s].

    An agent that is away is asked again every ``again`` [s] at most.

    The cursor goes on from nextSequence. When it fell out of the buffer it goes on at firstSequence and the note says how many observations
    were lost; with another instanceId the agent started anew, /probe is read again and everything begins at its first observation.
    """

    def __init__(self, address: Address, items: Sequence[MappedItem], interval: float = 0.1, again: float = 0.25) -> None:
        self.address, self.items, self.interval, self.again = address, list(items), interval, again
        self.remarks: list[str] = []
        self._origin: float | None = None
        self._order: dict[str, int] = {}

    @property
    def name(self) -> str:
        """Return the address."""
        return f"http://{self.address.host}:{self.address.port}/"

    @property
    def signals(self) -> tuple[Signal, ...]:
        """Return the channels of the map."""
        return tuple(item.signal for item in self.items)

    async def blocks(self) -> AsyncIterator[SampleBlock]:
        """Return rows of values, for ever; raises :class:`LiveError` where no agent answers at first or an item is not there."""
        await self._first_probe()
        rows = RowAssembly(len(self.items))
        instance, cursor, quiet, count = "", -1, 0.0, 100
        notes: list[str] = []
        away = ""
        while True:
            try:
                root = await fetch(self.address, "/current" if cursor < 0 else f"/sample?from={cursor}&count={count}")
                header = _header(root)
                if header is None or _error_code(root) or (instance and header.instance != instance):
                    header, sentence, is_new = await self._again(instance, cursor)
                    if is_new:
                        yield _noted(rows.restart(), notes)
                        notes = []
                    instance, cursor = header.instance, header.first
                    notes.append(sentence)
                    await asyncio.sleep(0.01)
                    continue
                fresh = self._take(root, rows)
            except AgentAwayError as error:
                if str(error) != away:
                    yield _noted(rows.whole(), [*notes, f"the agent went away: {error}"])
                    notes, away = [], str(error)
                await asyncio.sleep(max(self.again, self.interval))
                continue
            if away:
                notes.append("the agent was away")
                away = ""
            instance, count = header.instance, max(1, min(_COUNT, header.size))
            cursor = header.following
            quiet = 0.0 if fresh else quiet + self.interval
            block = rows.quiet() if quiet > _QUIET else rows.whole()
            if len(block):
                yield _noted(block, notes)
                notes = []
            if cursor >= header.last:
                await asyncio.sleep(self.interval)

    async def _again(self, instance: str, cursor: int) -> tuple[Header, str, bool]:
        """Return the header to continue from after an error or a new instance, a sentence, and whether the instance is new."""
        header = _header(await fetch(self.address, "/current"))
        if header is None or not instance:
            raise AgentAwayError("it answers /current with an error")
        if header.instance != instance:
            await self._probe()
            return header, "the agent started anew", True
        return header, f"{max(0, header.first - cursor)} observations were lost: the cursor fell out of the agent's buffer", False

    def _take(self, root: ElementTree.Element, rows: RowAssembly) -> int:
        count = 0
        observed = sorted(
            (element for element in root.iter() if "dataItemId" in element.attrib), key=lambda element: _sequence(element, "sequence")
        )
        for element in observed:
            at = self._order.get(str(element.get("dataItemId")))
            if at is None:
                continue
            try:
                value = float(element.text or "")
                time = datetime.fromisoformat(str(element.get("timestamp")).replace("Z", "+00:00"))
                seconds = (time if time.tzinfo is not None else time.replace(tzinfo=UTC)).timestamp()
            except (ValueError, OverflowError):
                continue  # UNAVAILABLE, or no number
            if not np.isfinite(value):
                continue
            if self._origin is None:
                self._origin = seconds
            rows.add(at, round(seconds - self._origin, 6), value * self.items[at].factor)
            count += 1
        return count

    async def _first_probe(self) -> None:
        try:
            await self._probe()
        except AgentAwayError as error:
            raise _nobody(self.address, error) from None

    async def _probe(self) -> None:
        """Read which items there are and match the map with them."""
        root = await fetch(self.address, "/probe")
        known: dict[str, str] = {}
        for element in root.iter():
            if element.tag.endswith("DataItem"):
                for key in (element.get("name"), element.get("id")):
                    if key:
                        known[key] = str(element.get("id"))
        self._order = {}
        for at, item in enumerate(self.items):
            if item.at not in known:
                remedy = nearest(item.at, known) or f"It has {', '.join(list(known)[:8])}."
                raise LiveError(f"the agent has no data item '{item.at}'.", place=self.name, remedy=remedy)
            self._order[known[item.at]] = at


def _noted(block: SampleBlock, notes: Sequence[str]) -> SampleBlock:
    return SampleBlock(block.time, block.values, tuple(notes))


def _header(root: ElementTree.Element) -> Header | None:
    """Return the header with sequence numbers, or None without a header. Raises :class:`AgentAwayError` for wrong numbers."""
    for element in root.iter():
        if element.tag.endswith("Header") and "firstSequence" in element.attrib:
            first, last, following, size = (
                _sequence(element, key) for key in ("firstSequence", "lastSequence", "nextSequence", "bufferSize")
            )
            return Header(str(element.get("instanceId")), first, last, following, size)
    return None


def _sequence(element: ElementTree.Element, key: str) -> int:
    text = element.get(key, "0")
    if not re.fullmatch(r"\d{1,20}", text, re.ASCII) or int(text) >= _LARGEST_SEQUENCE:
        raise AgentAwayError(f"{key} is {text[:20]!r}, not a number")
    return int(text)


def _error_code(root: ElementTree.Element) -> str:
    return next((str(element.get("errorCode")) for element in root.iter() if "errorCode" in element.attrib), "")


async def fetch(address: Address, target: str) -> ElementTree.Element:
    """Return the document that answers a request. Raises :class:`AgentAwayError` if none arrived whole within ``_PATIENCE``."""
    try:
        async with asyncio.timeout(_PATIENCE):
            return ElementTree.fromstring(await _body(address, target))
    except TimeoutError:
        raise AgentAwayError(f"no whole answer within {_PATIENCE:g} s") from None
    except OSError as error:
        raise AgentAwayError(os.strerror(error.errno).lower() if error.errno else "the connection broke") from None
    except (asyncio.IncompleteReadError, asyncio.LimitOverrunError, ValueError, ElementTree.ParseError):
        raise AgentAwayError("its answer is not an MTConnect document") from None


async def _body(address: Address, target: str) -> bytes:
    reader, writer = await asyncio.open_connection(address.host, address.port)
    try:
        writer.write(f"GET {target} HTTP/1.1\r\nHost: {address.host}\r\nAccept: text/xml\r\nConnection: close\r\n\r\n".encode())
        head = (await reader.readuntil(b"\r\n\r\n")).lower()
        length = re.search(rb"\r\ncontent-length:[ \t]*(\d{1,9})[ \t]*\r\n", head)
        if re.search(rb"\r\ntransfer-encoding:[^\r]*chunked", head):
            return await _chunks(reader)
        if length is not None:
            return await reader.readexactly(_bounded(int(length[1])))
        body = b""
        while piece := await reader.read(1 << 16):
            body += piece
            _bounded(len(body))
        return body
    finally:
        writer.transport.abort()
        with contextlib.suppress(OSError):
            await writer.wait_closed()


async def _chunks(reader: asyncio.StreamReader) -> bytes:
    """Return a body sent in chunks. Source: RFC 9112, section 7.1."""
    body = b""
    while size := int((await reader.readuntil(b"\r\n")).partition(b";")[0].strip() or b"-", 16):
        _bounded(len(body) + size)
        body += await reader.readexactly(size)
        await reader.readexactly(2)
    return body


def _bounded(size: int) -> int:
    if not 0 <= size <= _LARGEST:
        raise ValueError(f"a body of {size} bytes")
    return size


def _nobody(address: Address, error: AgentAwayError) -> LiveError:
    return LiveError(f"no MTConnect agent answers at http://{address.host}:{address.port}/: {error}.", remedy="Is it running?")


async def probe_items(address: Address) -> list[tuple[str, str]]:
    """Return the name and the unit of every number of an agent: its samples, and its variables without a type."""
    try:
        root = await fetch(address, "/probe")
    except AgentAwayError as error:
        raise _nobody(address, error) from None
    found = []
    for element in root.iter():
        if element.tag.endswith("DataItem") and (element.get("category") == "SAMPLE" or element.get("type") == "VARIABLE"):
            found.append((str(element.get("name") or element.get("id")), UNITS.get(str(element.get("units")), "1")))
    return found
