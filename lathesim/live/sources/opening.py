"""Opening a machine on the network by its address."""

from __future__ import annotations

from pathlib import Path

from lathesim.lessons.simulate import Prepared
from lathesim.lessons.yaml_source import read_source
from lathesim.live.mtconnect.mtconnect_source import MTConnectSource, probe_items
from lathesim.live.opcua.opcua_source import OpcUaSource, browse
from lathesim.live.recording.name_map import MappedItem, map_from
from lathesim.live.recording.record_mapping import map_for
from lathesim.live.sources.addresses import read_address
from lathesim.live.sources.samples import LiveError
from lathesim.live.sources.until_stopped import run_until_stopped

_AGENT_PORT = 5000


def open_machine(
    url: str, map_file: Path | None, prepared: Prepared | None, every: float = 0.0, queue: int = 5000
) -> OpcUaSource | MTConnectSource:
    """Return the source at ``opc.tcp://host:port`` or ``http://host:port``: what a map names, a lesson knows, or is offered.

    ``every`` [s] is the sampling that is asked for, ``queue`` the values the server keeps. Raises :class:`LiveError` where nothing answers.
    """
    if not url.startswith(("opc.tcp:", "http:")):
        raise LiveError(f"'{url}' is no address of a machine.", remedy="Write opc.tcp://127.0.0.1:4840 or http://127.0.0.1:5000.")
    opcua = url.startswith("opc.tcp:")
    items = _items(url, map_file, prepared, opcua)
    if opcua:
        return OpcUaSource(url, items, interval=every, queue=queue)
    return MTConnectSource(read_address(url, "http", _AGENT_PORT), items, every or 0.1)


def _items(url: str, map_file: Path | None, prepared: Prepared | None, opcua: bool) -> list[MappedItem]:
    if map_file is not None:
        return map_from(read_source(map_file, what="map").data, str(map_file))
    way = "path" if opcua else "item"
    if opcua:
        offered = dict(run_until_stopped(lambda stop: browse(url))[0])
    else:
        address = read_address(url, "http", _AGENT_PORT)
        offered = dict(run_until_stopped(lambda stop: probe_items(address))[0])
    if prepared is not None:
        return map_for(prepared, offered, way)
    channels = {name.removeprefix("Signals/").replace("/", "."): {way: name, "unit": unit} for name, unit in offered.items()}
    return map_from({"channels": channels}, "what is offered")
