"""Publishing one machine in several ways at once."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from lathesim.live.opcua.cnc_names import PublishedName
from lathesim.live.watching.lap import Faults, Lap, Publisher


@dataclass(frozen=True)
class Places:
    """Where a machine is published: ``host`` and the ports; None for what is not wanted."""

    host: str
    opcua: int | None
    mtconnect: int | None
    shdr: int | None = None


async def publish_all(
    lap: Lap,
    faults: Faults,
    laps: int,
    names: Sequence[PublishedName],
    places: Places,
    stop: asyncio.Event,
    ready: Callable[[str], None],
) -> list[int]:
    """Publish until all laps are done or ``stop`` is set; return how many instants went out each way."""
    jobs = []
    if places.opcua is not None:
        from lathesim.live.opcua.opcua_server import publish_opcua

        jobs.append(publish_opcua(Publisher(lap, faults, laps), names, places.host, places.opcua, stop, ready))
    if places.mtconnect is not None:
        from lathesim.live.mtconnect.mtconnect_publish import publish_mtconnect

        publisher = Publisher(lap, faults, laps)
        jobs.append(publish_mtconnect(publisher, names, places.host, places.mtconnect, stop, ready, places.shdr))
    return list(await asyncio.gather(*jobs))
