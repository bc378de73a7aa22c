"""The simulated machine as an OPC UA server, with the names of OPC 40502 and time stamps from the source."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable, Sequence
from datetime import UTC, datetime, timedelta
from typing import Any

from lathesim.live.opcua.cnc_names import NAMESPACE, PublishedName
from lathesim.live.sources.samples import LiveError
from lathesim.live.watching.lap import Publisher, Row
from lathesim.units import from_si

LARGEST_QUEUE = 10_000
_STATUS = {"ActStatus": 0, "ActOperationMode": 2, "ActProgramStatus": 1}
"""Channel active, automatic, program running (OPC 40502)."""


async def publish_opcua(
    publisher: Publisher, names: Sequence[PublishedName], host: str, port: int, stop: asyncio.Event, ready: Callable[[str], None]
) -> int:
    """Publish rows at their times until ``stop`` is set or all laps are done; return how many rows were published.

    Values of one instant are written with the same source time stamp. Raises :class:`LiveError` where asyncua is missing or the port cannot
    be taken.
    """
    ua, server_class = _library()
    server = server_class()
    await server.init()
    server.set_endpoint(f"opc.tcp://{host}:{port}/")
    server.set_server_name("lathesim")
    server.set_security_policy([ua.SecurityPolicyType.NoSecurity])
    nodes, number_node = await _address_space(server, ua, publisher.lap.name, names)
    factors = [from_si(1.0, name.unit) for name in names]
    try:
        await server.start()
    except OSError as error:
        raise LiveError(f"{host}:{port} cannot be taken: {error.strerror}.", remedy="Choose another with --opcua.") from None
    try:
        ready(f"opc.tcp://{host}:{port}/")
        return await _publish(server, ua, publisher, [*zip(nodes, factors, strict=True)], number_node, stop)
    finally:
        await server.stop()


async def _publish(
    server: Any, ua: Any, publisher: Publisher, nodes: list[tuple[Any, float]], number_node: Any, stop: asyncio.Event
) -> int:
    write = server.iserver.aspace.write_attribute_value
    value, double, counter = ua.AttributeIds.Value, ua.VariantType.Double, ua.VariantType.UInt64
    begun, origin, count = time.perf_counter(), datetime.now(UTC), 0
    while not stop.is_set() and not publisher.finished:
        for row in publisher.due(time.perf_counter() - begun):
            stamp = _stamp(origin, row)
            for (node, factor), number in zip(nodes, row.values, strict=True):
                data = ua.DataValue(ua.Variant(float(number) * factor, double), SourceTimestamp=stamp, ServerTimestamp=stamp)
                await write(node, value, data)
            data = ua.DataValue(ua.Variant(row.number, counter), SourceTimestamp=stamp, ServerTimestamp=stamp)
            await write(number_node, value, data)
            count += 1
            if count % 50 == 0:
                await asyncio.sleep(0)
        await asyncio.sleep(min(0.01, publisher.lap.period))
    await asyncio.sleep(0.2)  # subscribers take what waits in their queues
    return count


def _stamp(origin: datetime, row: Row) -> datetime:
    return origin + timedelta(microseconds=round(1e6 * row.time))


async def _address_space(server: Any, ua: Any, title: str, names: Sequence[PublishedName]) -> tuple[list[Any], Any]:
    """Return the node ids of the channels and of the sample number; objects stand where OPC 40502 has them."""
    index = await server.register_namespace(NAMESPACE)
    machine = await server.nodes.objects.add_object(ua.NodeId("CncInterface", index), ua.QualifiedName("CncInterface", index))
    for name, value in (("VendorName", "lathesim"), ("VendorRevision", title), ("Version", "1.0")):
        await machine.add_property(ua.NodeId(f"CncInterface.{name}", index), ua.QualifiedName(name, index), value)
    folders: dict[tuple[str, ...], Any] = {(): machine}
    for name in ("CncAxisList", "CncChannelList", "CncSpindleList"):
        folders[(name,)] = await machine.add_object(ua.NodeId(name, index), ua.QualifiedName(name, index))
    channel = await folders[("CncChannelList",)].add_object(ua.NodeId("Channel1", index), ua.QualifiedName("Channel1", index))
    for name, number in _STATUS.items():
        await channel.add_variable(ua.NodeId(f"Channel1.{name}", index), ua.QualifiedName(name, index), number)
    program = await channel.add_variable(ua.NodeId("Channel1.Program", index), ua.QualifiedName("ActMainProgramName", index), title)
    assert program is not None
    nodes = []
    for entry in names:
        for depth in range(1, len(entry.path)):
            path = entry.path[:depth]
            if path not in folders:
                identifier = ua.NodeId("/".join(path), index)
                folders[path] = await folders[path[:-1]].add_object(identifier, ua.QualifiedName(path[-1], index))
        identifier = ua.NodeId("/".join(entry.path), index)
        node = await folders[entry.path[:-1]].add_variable(identifier, ua.QualifiedName(entry.path[-1], index), 0.0)
        await node.add_property(ua.NodeId(f"{'/'.join(entry.path)}/unit", index), ua.QualifiedName("EngineeringUnits", index), entry.unit)
        nodes.append(node.nodeid)
    number = await machine.add_variable(ua.NodeId("SampleNumber", index), ua.QualifiedName("SampleNumber", index), 0, ua.VariantType.UInt64)
    return nodes, number.nodeid


def _library() -> tuple[Any, Any]:
    try:
        from asyncua import ua
        from asyncua.server import Server
    except ModuleNotFoundError as error:
        remedy = "Install it with: python -m pip install 'lathesim[live]'"
        raise LiveError(f"OPC UA needs the package '{error.name}'.", remedy=remedy) from None
    logging.getLogger("asyncua").setLevel(logging.CRITICAL)
    return ua, Server
