"""The XML documents of an MTConnect agent: devices, streams and errors.

Source: MTConnect standard 2.0, part 1 (headers, errors), and its XML schemas for devices, streams and errors.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from xml.etree import ElementTree

from lathesim.live.mtconnect.mtconnect_buffer import DataItem, Observation, ObservationBuffer

VERSION = "2.0"
_NO_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters that XML 1.0 does not allow."""
_MOST_STEPS = 40
"""Largest number of steps of an XPath (assumed); the tree of a machine has six levels."""
_SPACES = {kind: f"urn:mtconnect.org:MTConnect{kind}:{VERSION}" for kind in ("Devices", "Streams", "Error")}


@dataclass(frozen=True)
class Agent:
    """An agent: name of its device, instance (the second in which it started, UTC) and its buffer."""

    device: str
    instance: int
    buffer: ObservationBuffer


def stamp(time: datetime) -> str:
    """Return a time in UTC with Z, to the microsecond."""
    return time.astimezone(UTC).strftime("%Y-%m-%dT%H:%M:%S.%fZ")


def devices(agent: Agent) -> bytes:
    """Return the answer to ``/probe``."""
    root = _root("Devices", agent)
    device = ElementTree.SubElement(
        ElementTree.SubElement(root, "Devices"), "Device", {"id": "d1", "name": agent.device, "uuid": f"lathesim-{agent.device}"}
    )
    components = _tree(device, agent.buffer.items)
    for item in agent.buffer.items:
        attributes = {"id": item.id, "name": item.name, "category": item.category, "type": item.kind}
        for key, value in (("subType", item.sub_kind), ("units", item.units)):
            if value:
                attributes[key] = value
        if item.discrete:
            attributes["discrete"] = "true"
        ElementTree.SubElement(components[item.component], "DataItem", attributes)
    return _bytes(root)


def _tree(device: ElementTree.Element, items: Sequence[DataItem]) -> dict[tuple[str, str], ElementTree.Element]:
    """Add the components that hold items; return the element of each for its items."""
    found: dict[tuple[str, str], ElementTree.Element] = {}
    components = ElementTree.SubElement(device, "Components")
    axes: ElementTree.Element | None = None
    for kind, name in dict.fromkeys(item.component for item in items):
        parent = components
        if kind in ("Linear", "Rotary"):
            if axes is None:
                holder = ElementTree.SubElement(components, "Axes", {"id": "axes", "name": "axes"})
                axes = ElementTree.SubElement(holder, "Components")
            parent = axes
        component = ElementTree.SubElement(parent, kind, {"id": f"c_{name}", "name": name})
        found[(kind, name)] = ElementTree.SubElement(component, "DataItems")
    return found


def wanted_by(agent: Agent, path: str) -> set[str] | None:
    """Return the ids of the items below what an XPath selects, None where it cannot be read.

    Understood is the part of XPath of Python's ElementTree: steps, ``//``, ``*``, ``[@name='X']``, ``[@type="POSITION"]``.
    """
    root = ElementTree.fromstring(devices(agent))
    for element in root.iter():
        element.tag = element.tag.partition("}")[2]
    inner = path if path.startswith(".") else f".{path}" if path.startswith("/") else f".//{path}"
    if path.startswith("/MTConnectDevices"):
        inner = "." + path.removeprefix("/MTConnectDevices")
    if path.count("/") > _MOST_STEPS:
        return None
    try:
        chosen = [found for part in inner.split("|") for found in root.findall(part if part.startswith(".") else f".{part}")]
    except (SyntaxError, KeyError, ValueError, AttributeError):
        return None
    return {str(item.get("id")) for element in chosen for item in element.iter("DataItem")}


def streams(agent: Agent, entries: Iterable[Observation], following: int) -> bytes:
    """Return the answer to ``/current`` and ``/sample``; ``following`` is the number to go on from."""
    root = _root("Streams", agent, following)
    device = ElementTree.SubElement(
        ElementTree.SubElement(root, "Streams"), "DeviceStream", {"name": agent.device, "uuid": f"lathesim-{agent.device}"}
    )
    groups: dict[tuple[str, str], dict[str, list[Observation]]] = {}
    for entry in entries:
        groups.setdefault(entry.item.component, {}).setdefault(entry.item.category, []).append(entry)
    for (kind, name), by_category in groups.items():
        component = ElementTree.SubElement(device, "ComponentStream", {"component": kind, "name": name, "componentId": f"c_{name}"})
        for category, holder in (("SAMPLE", "Samples"), ("EVENT", "Events"), ("CONDITION", "Condition")):
            if category in by_category:
                place = ElementTree.SubElement(component, holder)
                for entry in by_category[category]:
                    _observation(place, entry)
    return _bytes(root)


def _observation(place: ElementTree.Element, entry: Observation) -> None:
    item = entry.item
    attributes = {"dataItemId": item.id, "name": item.name, "sequence": str(entry.sequence), "timestamp": stamp(entry.time)}
    if item.sub_kind:
        attributes["subType"] = item.sub_kind
    if item.category == "CONDITION":
        attributes["type"] = item.kind
        if entry.code:
            attributes["nativeCode"] = entry.code
        element = ElementTree.SubElement(place, entry.level or "Normal", attributes)
        if entry.value and entry.level not in ("Normal", "Unavailable"):
            element.text = entry.value
        return
    name = "".join(word.capitalize() for word in item.kind.split("_"))
    ElementTree.SubElement(place, name, attributes).text = entry.value


def error(agent: Agent, code: str, sentence: str) -> bytes:
    """Return an error as a document; ``code`` as OUT_OF_RANGE."""
    root = _root("Error", agent)
    ElementTree.SubElement(ElementTree.SubElement(root, "Errors"), "Error", {"errorCode": code}).text = _NO_XML.sub("?", sentence)
    return _bytes(root)


def _root(kind: str, agent: Agent, following: int | None = None) -> ElementTree.Element:
    root = ElementTree.Element(f"MTConnect{kind}", {"xmlns": _SPACES[kind]})
    header = {
        "creationTime": datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
        "sender": "lathesim",
        "instanceId": str(agent.instance),
        "version": VERSION,
        "bufferSize": str(agent.buffer.size),
    }
    if kind != "Error":
        header["deviceModelChangeTime"] = stamp(datetime.fromtimestamp(agent.instance, UTC))
    if kind == "Devices":  # there are no assets, but the schema requires a buffer of at least one
        header |= {"assetBufferSize": "1", "assetCount": "0"}
    if following is not None:
        header |= {
            "firstSequence": str(agent.buffer.first_sequence),
            "lastSequence": str(agent.buffer.last_sequence),
            "nextSequence": str(following),
        }
    ElementTree.SubElement(root, "Header", header)
    return root


def _bytes(root: ElementTree.Element) -> bytes:
    body: bytes = ElementTree.tostring(root, encoding="utf-8")
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + body
