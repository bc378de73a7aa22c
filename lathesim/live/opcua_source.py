"""An OPC UA server as a source: monitored items with queues, time stamps from the source, and another try when the server goes away."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import time as clock
from collections.abc import AsyncIterator, Sequence
from typing import Any

import numpy as np

from lathesim.live.channel_names import MappedItem
from lathesim.live.even_clock import RowAssembly
from lathesim.live.samples import LiveError, SampleBlock, Signal

_QUIET = 1.0
"""Seconds without news after which rows that wait for a value are closed."""
_AGAIN = 0.25
"""Seconds between two tries to connect."""
_SLOWER = 1.01
"""Times the interval asked for from which on a server publishes more slowly: servers round intervals."""
_DEEPEST, _MOST_NODES = 6, 500
"""Folders within folders, and nodes, that are looked through."""
_ROOM = 200_000
"""Values that wait at most; then the oldest are dropped and the loss is told."""
_OVERFLOW = 0x480
"""Info bits of a status code that say that the server's queue overflowed (OPC UA part 4, 7.39)."""


class OpcUaSource:
    """Values of ``items`` from the server at ``url``, asked for every ``interval`` [s] with queues of ``queue`` values.

    Time is that of the source's stamps, in seconds since the first one. When the server goes away the source tries again; what was missed
    is a gap in the times, told in the notes. ``remarks`` are sentences about what the server changed of what was asked for.
    """

    def __init__(self, url: str, items: Sequence[MappedItem], *, interval: float = 0.0, queue: int = 5000, patience: float = 30.0) -> None:
        self.url, self.items, self.interval, self.queue, self.patience = url, list(items), interval, queue, patience
        self.remarks: list[str] = []
        self._library = opcua_library()
        self._ua = self._library.ua
        self._values: asyncio.Queue[tuple[int, float, float, bool]] = asyncio.Queue(_ROOM)
        self._origin: float | None = None
        self._dropped = 0
        self._connected_before = False

    @property
    def name(self) -> str:
        """Return the address."""
        return self.url

    @property
    def signals(self) -> tuple[Signal, ...]:
        """Return the channels of the map."""
        return tuple(item.signal for item in self.items)

    async def blocks(self) -> AsyncIterator[SampleBlock]:
        """Return rows of values that belong together, for ever; raises :class:`LiveError` where the server cannot be reached at all."""
        rows = RowAssembly(len(self.items))
        notes: list[str] = []
        tries = 0.0
        while True:
            client = self._library.Client(self.url, timeout=4.0)
            try:
                await client.connect()
            except (OSError, TimeoutError, self._ua.UaError) as error:
                tries += _AGAIN
                if not self._connected_before and tries > self.patience:
                    raise LiveError(f"no OPC UA server answers at {self.url}.", remedy="Is it running?") from error
                await asyncio.sleep(_AGAIN)
                continue
            try:
                await self._subscribe(client)
                if self._connected_before:
                    notes.append("the server was away")
                self._connected_before = True
                async for block in self._flow(client, rows):
                    notes += block.notes
                    if len(block):
                        yield SampleBlock(block.time, block.values, tuple(notes))
                        notes = []
            except (OSError, TimeoutError, ConnectionError, self._ua.UaError):
                notes.append("the server went away")
            finally:
                with contextlib.suppress(Exception):
                    await asyncio.wait_for(client.disconnect(), 0.5)
            block = rows.restart()
            if len(block) or notes:
                yield SampleBlock(block.time, block.values, tuple(notes))
                notes = []

    async def _subscribe(self, client: Any) -> None:
        ua = self._ua
        nodes = [await self._node(client, item) for item in self.items]
        handler = _Handler(self, {node.nodeid: at for at, node in enumerate(nodes)})
        publishing = min(100.0, max(20.0, 1e3 * self.interval))
        subscription = await client.create_subscription(publishing, handler)
        every = ua.DataChangeFilter(Trigger=ua.DataChangeTrigger.StatusValueTimestamp)
        requests = [
            subscription._make_monitored_item_request(
                node, ua.AttributeIds.Value, every, self.queue, ua.MonitoringMode.Reporting, 1e3 * self.interval
            )
            for node in nodes
        ]
        self._check(await subscription.create_monitored_items(requests), subscription, publishing)

    def _check(self, results: Sequence[Any], subscription: Any, publishing: float) -> None:
        """Report which items are refused, and what the server revised."""
        for item, result in zip(self.items, results, strict=True):
            if isinstance(result, self._ua.StatusCode):
                raise LiveError(f"the server refuses {item.way} '{item.at}': {result.name}.", place=self.url, remedy="Look at the map.")
        parameters = getattr(subscription, "parameters", None)
        revised = float(getattr(parameters, "RequestedPublishingInterval", publishing) or publishing)
        if revised > publishing * _SLOWER:
            remark = f"the server publishes every {revised:g} ms, and {publishing:g} ms was requested"
            self.remarks = list(dict.fromkeys([*self.remarks, remark]))

    async def _node(self, client: Any, item: MappedItem) -> Any:
        ua = self._ua
        try:
            return client.get_node(item.at) if item.way == "node" else await _by_path(client, item.at)
        except (ua.UaError, ValueError, TypeError) as error:
            raise LiveError(f"the server has no {item.way} '{item.at}'.", place=self.url, remedy="Look at the map.") from error

    async def _flow(self, client: Any, rows: RowAssembly) -> AsyncIterator[SampleBlock]:
        while True:
            try:
                first = await asyncio.wait_for(self._values.get(), _QUIET)
            except TimeoutError:
                yield rows.quiet()
                await client.check_connection()
                await asyncio.wait_for(client.nodes.server_state.read_value(), 4.0)
                continue
            notes = []
            waiting = [first]
            while not self._values.empty():
                waiting.append(self._values.get_nowait())
            for item, time, value, overflow in waiting:
                if overflow:
                    notes.append("the server's queue overflowed: values are lost")
                rows.add(item, time, value * self.items[item].factor)
            if self._dropped:
                notes.append(f"{self._dropped} values were dropped here, as nobody took them")
                self._dropped = 0
            block = rows.whole()
            if len(block) or notes:
                yield SampleBlock(block.time, block.values, tuple(dict.fromkeys(notes)))
            await asyncio.sleep(0.02)

    def take(self, item: int, value: Any, data: Any) -> None:
        """Take a notification: a value with the time stamp of its source."""
        stamp = data.SourceTimestamp or data.ServerTimestamp
        if stamp is None or not isinstance(value, (int, float)) or isinstance(value, bool) or not np.isfinite(value):
            return
        seconds = stamp.timestamp()
        if self._origin is None:
            self._origin = seconds
        status = getattr(data.StatusCode, "value", 0) or 0
        if self._values.full():
            self._values.get_nowait()
            self._dropped += 1
        self._values.put_nowait((item, round(seconds - self._origin, 6), float(value), (status & _OVERFLOW) == _OVERFLOW))


class _Handler:
    """Takes what the subscription notifies."""

    def __init__(self, source: OpcUaSource, order: dict[Any, int]) -> None:
        self._source, self._order = source, order

    def datachange_notification(self, node: Any, value: Any, data: Any) -> None:
        """Hand a value on."""
        self._source.take(self._order[node.nodeid], value, data.monitored_item.Value)

    def status_change_notification(self, status: Any) -> None:
        """Take the news that the subscription ended; the connection is looked after elsewhere."""


async def _by_path(client: Any, path: str) -> Any:
    """Return the node at a path of browse names: below Objects, or below the CncInterface, whatever the namespaces."""
    node = client.nodes.objects
    names = [name for name in path.split("/") if name]
    first = {child.Name for child in [await found.read_browse_name() for found in await node.get_children()]}
    if names and names[0] not in first and "CncInterface" in first:
        names = ["CncInterface", *names]
    for name in names:
        for child in await node.get_children():
            if (await child.read_browse_name()).Name == name:
                node = child
                break
        else:
            raise ValueError(name)
    return node


async def browse(url: str, patience: float = 15.0) -> list[tuple[str, str]]:
    """Return the path and the unit of every number that a server publishes below its CncInterface, or below Objects without one.

    A server that is just starting is waited for; :class:`LiveError` where none answers.
    """
    library = opcua_library()
    ua = library.ua
    begun = clock.monotonic()
    while True:
        try:
            async with library.Client(url, timeout=4.0) as client:
                return await _numbers(ua, client)
        except (OSError, TimeoutError, ua.UaError) as error:
            if clock.monotonic() - begun > patience:
                raise LiveError(f"no OPC UA server answers at {url}.", remedy="Is it running?") from error
            await asyncio.sleep(_AGAIN)


async def _numbers(ua: Any, client: Any) -> list[tuple[str, str]]:
    children = {(await node.read_browse_name()).Name: node for node in await client.nodes.objects.get_children()}
    start = children.get("CncInterface")
    begins = [(start, "")] if start is not None else [(node, f"{name}/") for name, node in children.items() if name != "Server"]
    found: list[tuple[str, str]] = []
    for node, prefix in begins:
        await _walk(ua, node, prefix, found)
    return found


async def _walk(ua: Any, node: Any, prefix: str, found: list[tuple[str, str]], depth: int = 0) -> None:
    if depth > _DEEPEST or len(found) > _MOST_NODES:
        return
    for child in await node.get_children():
        name = (await child.read_browse_name()).Name
        unit = ""
        if await child.read_node_class() == ua.NodeClass.Variable:
            for own in await child.get_properties():
                if (await own.read_browse_name()).Name == "EngineeringUnits":
                    unit = _unit_text(ua, await own.read_value())
            if unit:
                found.append((f"{prefix}{name}", unit))
        if not unit:
            await _walk(ua, child, f"{prefix}{name}/", found, depth + 1)


def _unit_text(ua: Any, value: Any) -> str:
    """Return the unit of an EngineeringUnits property; some servers give plain text."""
    return str(value.DisplayName.Text or "") if isinstance(value, ua.EUInformation) else str(value)


def opcua_library() -> Any:
    """Return the package asyncua, its log off. Raises :class:`LiveError` where it is not installed."""
    try:
        import asyncua
    except ModuleNotFoundError as error:
        remedy = "Install it with: python -m pip install 'lathesim[live]'"
        raise LiveError(f"OPC UA needs the package '{error.name}'.", remedy=remedy) from None
    logging.getLogger("asyncua").setLevel(logging.CRITICAL)
    return asyncua
