"""The simulated machine as an MTConnect device: its channels as data items, its rows as observations."""

from __future__ import annotations

import asyncio
import math
import re
import time
from collections.abc import Callable, Sequence
from datetime import UTC, datetime, timedelta

from lathesim.live.mtconnect.mtconnect_agent import AgentServer
from lathesim.live.mtconnect.mtconnect_buffer import UNAVAILABLE, DataItem, ObservationBuffer
from lathesim.live.mtconnect.mtconnect_documents import Agent
from lathesim.live.mtconnect.shdr import Adapter, write_line
from lathesim.live.opcua.cnc_names import PublishedName
from lathesim.live.watching.lap import Publisher, Row
from lathesim.units import from_si

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
    buffer: ObservationBuffer, adapter: Adapter, items: Sequence[DataItem], factors: Sequence[float], origin: datetime, row: Row
) -> None:
    when = origin + timedelta(microseconds=round(1e6 * row.time))
    pairs = [
        (item, f"{float(value) * factor:.10g}" if math.isfinite(value) else UNAVAILABLE)
        for item, factor, value in zip(items, factors, row.values, strict=False)
    ]
    for item, text in pairs:
        buffer.observe(item, when, text)
    adapter.send(write_line(when, [(item.name, text) for item, text in pairs]))
