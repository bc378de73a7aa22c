"""An MTConnect agent as a source: it reads /probe, keeps a cursor, follows /sample, and says what it lost."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from xml.etree import ElementTree

import numpy as np

from lathesim.errors import nearest
from lathesim.live.mtconnect.mtconnect_publish import UNITS
from lathesim.live.recording.name_map import MappedItem
from lathesim.live.sources.addresses import Address
from lathesim.live.sources.row_assembly import RowAssembly
from lathesim.live.sources.samples import Block, LiveError, Signal

_LARGEST = 1 << 24
"""Bytes of a document at most."""
_COUNT = 10_000
_PATIENCE = 10.0
_QUIET = 1.5


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

    The cursor goes on from nextSequence. When it fell out of the buffer it goes on at firstSequence and the note says how many observations
    were lost; with another instanceId the agent started anew, /probe is read again and everything begins at its first observation.
    """

    def __init__(self, address: Address, items: Sequence[MappedItem], interval: float = 0.1) -> None:
        self.address, self.items, self.interval = address, list(items), interval
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

    async def blocks(self) -> AsyncIterator[Block]:
        """Return rows of values, for ever; raises :class:`LiveError` where no agent answers at first or an item is not there."""
        await self._probe()
        rows = RowAssembly(len(self.items))
        instance, cursor, away, quiet = "", -1, False, 0.0
        notes: list[str] = []
        count = 100
        while True:
            try:
                root = await self._document("/current" if cursor < 0 else f"/sample?from={cursor}&count={count}")
                if away:
                    notes.append("the agent was away")
                    away = False
            except (OSError, TimeoutError, asyncio.IncompleteReadError, ElementTree.ParseError):
                away = True
                await asyncio.sleep(max(0.25, self.interval))
                continue
            header = _header(root)
            code = _error_code(root)
            if code or header is None or (instance and header.instance != instance):
                cursor, sentence = await self._again(instance, cursor)
                instance = sentence[1]
                if sentence[2]:
                    yield _noted(rows.restart(), notes)
                    notes = []
                notes.append(sentence[0])
                await asyncio.sleep(0.01)
                continue
            instance, count = header.instance, max(1, min(_COUNT, header.size))
            fresh = self._take(root, rows)
            cursor = header.following
            quiet = 0.0 if fresh else quiet + self.interval
            block = rows.quiet() if quiet > _QUIET else rows.whole()
            if len(block):
                yield _noted(block, notes)
                notes = []
            if cursor >= header.last:
                await asyncio.sleep(self.interval)

    async def _again(self, instance: str, cursor: int) -> tuple[int, tuple[str, str, bool]]:
        """Return where to go on after an error or a new instance, with (sentence, instance, whether it is a new one)."""
        root = await self._document("/current")
        header = _header(root)
        if header is None:
            raise LiveError("the agent answers with an error to /current.", place=self.name)
        if header.instance != instance:
            await self._probe()
            return header.first, ("the agent started anew", header.instance, True)
        lost = max(0, header.first - cursor)
        return header.first, (f"{lost} observations were lost: the cursor fell out of the agent's buffer", instance, False)

    def _take(self, root: ElementTree.Element, rows: RowAssembly) -> int:
        count = 0
        observed = sorted(
            (element for element in root.iter() if "dataItemId" in element.attrib), key=lambda element: int(element.get("sequence", "0"))
        )
        for element in observed:
            at = self._order.get(str(element.get("dataItemId")))
            if at is None:
                continue
            try:
                value = float(element.text or "")
                seconds = datetime.fromisoformat(str(element.get("timestamp")).replace("Z", "+00:00")).timestamp()
            except ValueError:
                continue  # UNAVAILABLE, or no number
            if not np.isfinite(value):
                continue
            if self._origin is None:
                self._origin = seconds
            rows.add(at, round(seconds - self._origin, 6), value * self.items[at].factor)
            count += 1
        return count

    async def _probe(self) -> None:
        """Read which items there are and match the map with them."""
        try:
            root = await self._document("/probe")
        except (OSError, TimeoutError, asyncio.IncompleteReadError, ElementTree.ParseError):
            raise LiveError(f"no MTConnect agent answers at {self.name}.", remedy="Is it running?") from None
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

    async def _document(self, target: str) -> ElementTree.Element:
        return ElementTree.fromstring(await fetch(self.address, target))


def _noted(block: Block, notes: Sequence[str]) -> Block:
    return Block(block.time, block.values, tuple(notes))


def _header(root: ElementTree.Element) -> Header | None:
    for element in root.iter():
        if element.tag.endswith("Header") and "firstSequence" in element.attrib:
            numbers = [int(element.get(key, "0")) for key in ("firstSequence", "lastSequence", "nextSequence", "bufferSize")]
            return Header(str(element.get("instanceId")), *numbers)
    return None


def _error_code(root: ElementTree.Element) -> str:
    return next((str(element.get("errorCode")) for element in root.iter() if "errorCode" in element.attrib), "")


async def fetch(address: Address, target: str) -> bytes:
    """Return the body of the answer to a request."""
    reader, writer = await asyncio.wait_for(asyncio.open_connection(address.host, address.port), _PATIENCE)
    try:
        writer.write(f"GET {target} HTTP/1.1\r\nHost: {address.host}\r\nAccept: text/xml\r\nConnection: close\r\n\r\n".encode())
        head = await asyncio.wait_for(reader.readuntil(b"\r\n\r\n"), _PATIENCE)
        body = b""
        while piece := await asyncio.wait_for(reader.read(1 << 16), _PATIENCE):
            body += piece
            if len(body) > _LARGEST:
                raise LiveError(f"the agent sends more than {_LARGEST} bytes.", remedy="Ask for fewer items.")
        return _unchunked(body) if b"chunked" in head.lower() else body
    finally:
        writer.close()


def _unchunked(body: bytes) -> bytes:
    whole = b""
    while body:
        size, _, body = body.partition(b"\r\n")
        length = int(size.partition(b";")[0] or b"0", 16)
        if not length:
            break
        whole, body = whole + body[:length], body[length + 2 :]
    return whole


async def probe_items(address: Address) -> list[tuple[str, str]]:
    """Return the name and the unit of every sample an agent has."""
    try:
        root = ElementTree.fromstring(await fetch(address, "/probe"))
    except (OSError, TimeoutError, asyncio.IncompleteReadError, ElementTree.ParseError):
        raise LiveError(f"no MTConnect agent answers at {address.host}:{address.port}.", remedy="Is it running?") from None
    found = []
    for element in root.iter():
        if element.tag.endswith("DataItem") and element.get("category") == "SAMPLE":
            found.append((str(element.get("name") or element.get("id")), UNITS.get(str(element.get("units")), "1")))
    return found
