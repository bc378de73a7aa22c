"""The simulated machine as an OPC UA server, with names and types of OPC 40502 and time stamps from the source.

Source: OPC 40502, OPC UA for Computerized Numerical Control Systems, release 1.0; OPC 10000-8 (AnalogItemType, EUInformation).
Left out: the members of axes, spindles and channels for which the simulation has no value, and the structured value of a position, whose
members carry it.
"""

from __future__ import annotations

import asyncio
import weakref
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from typing import Any

import numpy as np

from lathesim.live.channel_names import NAMESPACE, POSITION_TYPE, TYPES, UNITS_NAMESPACE, PublishedName, type_of, unit_number
from lathesim.live.opcua_source import opcua_library
from lathesim.live.publishing import PublishedRun, Publisher
from lathesim.live.samples import LiveError
from lathesim.units import from_si

LARGEST_MESSAGE = 1 << 22
"""Largest message of a client [bytes] (assumed)."""
MOST_CONNECTIONS = 32
MOST_SESSIONS = 64
_BUFFER = 65_535
_EVERY = 50
"""Rows after which others get their turn."""
_STATUS = {"ActStatus": 0, "ActOperationMode": 2, "ActProgramStatus": 1}
"""Channel active, automatic, program running (OPC 40502)."""


async def publish_opcua(
    publisher: Publisher, names: Sequence[PublishedName], host: str, port: int, stop: asyncio.Event, ready: Callable[[str], None]
) -> int:
    """Publish rows at their times until ``stop`` is set or all laps are done; return how many rows were published.

    Values of one instant are written with the same source time stamp. Raises :class:`LiveError` where asyncua is missing or the port cannot
    be taken.
    """
    library = opcua_library()
    ua, server = library.ua, library.Server()
    await server.init()
    server.set_endpoint(f"opc.tcp://{host}:{port}/")
    server.set_server_name("lathesim")
    server.set_security_policy([ua.SecurityPolicyType.NoSecurity])
    _bound(server, ua)
    nodes, number_node = await _address_space(server, ua, publisher.lap, names)
    factors = [from_si(1.0, name.unit) for name in names]
    try:
        await server.start()
    except OSError as error:
        raise LiveError(f"{host}:{port} cannot be opened: {error.strerror}.", remedy="Choose another with --opcua.") from None
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
    origin, count = datetime.now(UTC), 0
    async for rows in publisher.rows(stop):
        for row in rows:
            stamp = row.stamp(origin)
            for (node, factor), number in zip(nodes, row.values, strict=True):
                data = ua.DataValue(ua.Variant(float(number) * factor, double), SourceTimestamp=stamp, ServerTimestamp=stamp)
                await write(node, value, data)
            data = ua.DataValue(ua.Variant(row.number, counter), SourceTimestamp=stamp, ServerTimestamp=stamp)
            await write(number_node, value, data)
            count += 1
            if count % _EVERY == 0:
                await asyncio.sleep(0)
        for client in server.bserver.clients[MOST_CONNECTIONS:]:
            client.transport.abort()
    return count


def _bound(server: Any, ua: Any) -> None:
    """Limit messages and sessions; a client that requests less changes nothing for the others."""
    from asyncua.common.connection import TransportLimits

    def limits() -> Any:
        return TransportLimits(_BUFFER, _BUFFER, LARGEST_MESSAGE // _BUFFER + 1, LARGEST_MESSAGE)

    server.limits = limits()
    server.limits.create_acknowledge_and_set_limits = lambda hello: limits().create_acknowledge_and_set_limits(hello)
    create, sessions = server.iserver.create_session, weakref.WeakSet[Any]()

    def create_session(*args: Any, **named: Any) -> Any:
        closed = type(server.iserver.isession.state).Closed
        if sum(session.state is not closed for session in sessions) >= MOST_SESSIONS:
            raise ua.UaStatusCodeError(ua.StatusCodes.BadTooManySessions)
        session = create(*args, **named)
        sessions.add(session)
        return session

    server.iserver.create_session = create_session


async def _types(server: Any, ua: Any, index: int) -> dict[str, Any]:
    """Return the object types of OPC 40502 by name, and ``CncPositionVariableType``."""
    found: dict[str, Any] = {"": server.nodes.base_object_type}
    for name, (number, base) in TYPES.items():
        found[name] = await found[base].add_object_type(ua.NodeId(number, index), ua.QualifiedName(name, index))
    found["position"] = await server.get_node(ua.NodeId(ua.ObjectIds.BaseDataVariableType)).add_variable_type(
        ua.NodeId(POSITION_TYPE, index), ua.QualifiedName("CncPositionVariableType", index), ua.NodeId(ua.ObjectIds.BaseDataType)
    )
    return found


async def _become(ua: Any, node: Any, kind: Any) -> None:
    """Set the type definition of a node."""
    relation = ua.ObjectIds.HasTypeDefinition
    for reference in await node.get_references(relation):
        await node.delete_reference(reference.NodeId, relation)
    await node.add_reference(kind, relation)


async def _address_space(server: Any, ua: Any, lap: PublishedRun, names: Sequence[PublishedName]) -> tuple[list[Any], Any]:
    """Return the node ids of the channels and of the sample number; objects stand where OPC 40502 has them, with its types."""
    index = await server.register_namespace(NAMESPACE)
    types = await _types(server, ua, index)
    data_item, analog_item = (server.get_node(ua.NodeId(number)) for number in (ua.ObjectIds.DataItemType, ua.ObjectIds.AnalogItemType))
    machine = await server.nodes.objects.add_object(ua.NodeId("CncInterface", index), ua.QualifiedName("CncInterface", index))
    await _become(ua, machine, types["CncInterfaceType"])
    for name, value in (("VendorName", "lathesim"), ("VendorRevision", lap.name), ("Version", "1.0")):
        await machine.add_property(ua.NodeId(f"CncInterface.{name}", index), ua.QualifiedName(name, index), value)
    holders: dict[tuple[str, ...], Any] = {(): machine}

    async def holder(path: tuple[str, ...]) -> Any:
        if path not in holders:
            above, identifier, name = await holder(path[:-1]), ua.NodeId("/".join(path), index), ua.QualifiedName(path[-1], index)
            if len(path) > 2:
                holders[path] = await above.add_variable(identifier, name, None, ua.VariantType.Null)
                await _become(ua, holders[path], types["position"])
            else:
                holders[path] = await above.add_object(identifier, name)
                await _become(ua, holders[path], types[type_of(path)])
        return holders[path]

    channel = await holder(("CncChannelList", "Channel1"))
    states: dict[str, int | str] = {**_STATUS, "ActMainProgramName": lap.name}
    for name, state in states.items():
        await _become(ua, await channel.add_variable(ua.NodeId(f"Channel1.{name}", index), ua.QualifiedName(name, index), state), data_item)
    nodes = []
    for entry, values in zip(names, lap.values, strict=True):
        identifier = ua.NodeId("/".join(entry.path), index)
        node = await (await holder(entry.path[:-1])).add_variable(identifier, ua.QualifiedName(entry.path[-1], index), 0.0)
        await _become(ua, node, analog_item)
        factor, finite = from_si(1.0, entry.unit), values[np.isfinite(values)]
        span = ua.Range(factor * float(np.min(finite, initial=0.0)), factor * float(np.max(finite, initial=0.0)))
        unit = ua.EUInformation(UNITS_NAMESPACE, unit_number(entry.unit), ua.LocalizedText(entry.unit), ua.LocalizedText(entry.unit))
        await node.add_property(ua.NodeId(f"{'/'.join(entry.path)}/unit", index), ua.QualifiedName("EngineeringUnits", 0), unit)
        await node.add_property(ua.NodeId(f"{'/'.join(entry.path)}/range", index), ua.QualifiedName("EURange", 0), span)
        nodes.append(node.nodeid)
    for name in ("CncAxisList", "CncSpindleList"):
        await holder((name,))
    number = await machine.add_variable(ua.NodeId("SampleNumber", index), ua.QualifiedName("SampleNumber", index), 0, ua.VariantType.UInt64)
    return nodes, number.nodeid
