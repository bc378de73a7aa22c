"""What an MTConnect agent keeps and sends: numbered observations, and XML documents of them.

The observations of an MTConnect agent: numbered, bounded, and nothing that is said twice.

Sequence numbers rise by one for each observation over all data items. A value that did not change is not repeated. Time stamps never go
backwards.

The XML documents of an MTConnect agent: devices, streams and errors.

Source: MTConnect standard 2.0, part 1 (headers, errors), and its XML schemas for devices, streams and errors. Left out: discrete items, and
conditions with several active entries: the simulation has neither.
"""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from itertools import islice, takewhile
from xml.etree import ElementTree

UNAVAILABLE = "UNAVAILABLE"


@dataclass(frozen=True)
class DataItem:
    """One data item: ``id`` and ``name``, ``category`` SAMPLE, EVENT or CONDITION, ``kind`` (as POSITION), units, sub type, component."""

    id: str
    name: str
    category: str
    kind: str
    units: str = ""
    sub_kind: str = ""
    component: tuple[str, str] = ("Controller", "controller")


@dataclass(frozen=True)
class Observation:
    """What was observed: number, item, time [UTC] and value; for a condition its ``level`` (Normal, Unavailable)."""

    sequence: int
    item: DataItem
    time: datetime
    value: str
    level: str = ""


@dataclass
class ObservationBuffer:
    """Keeps the last ``size`` observations, and for each item the state before the first of them, so that ``current?at`` can be told."""

    items: Sequence[DataItem]
    size: int = 131_072
    next_sequence: int = 1
    _kept: deque[Observation] = field(default_factory=deque)
    _before: dict[str, Observation] = field(default_factory=dict)
    _now: dict[str, Observation] = field(default_factory=dict)
    _latest: datetime = datetime(1970, 1, 1, tzinfo=UTC)

    @property
    def first_sequence(self) -> int:
        """Return the number of the oldest observation that is kept."""
        return self.next_sequence - len(self._kept)

    @property
    def last_sequence(self) -> int:
        """Return the number of the newest observation."""
        return self.next_sequence - 1

    def observe(self, item: DataItem, time: datetime, value: str, level: str = "") -> bool:
        """Take an observation; return False where it says nothing new. Its time stamp is no earlier than the last one's."""
        now = self._now.get(item.id)
        if now is not None and (now.value, now.level) == (value, level):
            return False
        self._latest = max(self._latest, time)
        new = Observation(self.next_sequence, item, self._latest, value, level)
        self.next_sequence += 1
        self._now[item.id] = new
        self._kept.append(new)
        if len(self._kept) > self.size:
            gone = self._kept.popleft()
            self._before[gone.item.id] = gone
        return True

    def unavailable(self, time: datetime) -> None:
        """Take that the source is lost: every item is UNAVAILABLE, once."""
        for item in self.items:
            self.observe(item, time, UNAVAILABLE, "Unavailable" if item.category == "CONDITION" else "")

    def since(self, sequence: int, count: int, wanted: set[str] | None) -> tuple[list[Observation], int]:
        """Return up to ``count`` observations of the wanted items from a number on, and the number after the last that was looked at.

        With a negative count the last ones up to ``sequence`` are returned, in the order of their numbers.
        """
        begin = max(0, sequence - self.first_sequence)
        if count < 0:
            back = (self._kept[at] for at in range(min(begin, len(self._kept) - 1), -1, -1))
            last = [*islice((entry for entry in back if wanted is None or entry.item.id in wanted), -count)][::-1]
            return last, last[0].sequence if last else self.first_sequence
        found: list[Observation] = []
        following = sequence
        for entry in self._from(begin):
            if len(found) == count:
                break
            following = entry.sequence + 1
            if wanted is None or entry.item.id in wanted:
                found.append(entry)
        return found, following

    def _from(self, begin: int) -> Iterator[Observation]:
        """Return what is kept from a place on, looked for from the nearer end."""
        if begin > len(self._kept) // 2:
            return reversed([*islice(reversed(self._kept), max(0, len(self._kept) - begin))])
        return islice(self._kept, begin, None)

    def current(self, at: int | None, wanted: set[str] | None) -> list[Observation]:
        """Return the state of each wanted item, now or after the observation ``at``."""
        states = self._now
        if at is not None:
            states = {**self._before, **{entry.item.id: entry for entry in takewhile(lambda entry: entry.sequence <= at, self._kept)}}
        return [states[item.id] for item in self.items if item.id in states and (wanted is None or item.id in wanted)]


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
                axes = ElementTree.SubElement(ElementTree.SubElement(components, "Axes", {"id": "axes", "name": "axes"}), "Components")
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
        ElementTree.SubElement(place, entry.level, attributes)
        return
    ElementTree.SubElement(place, "".join(word.capitalize() for word in item.kind.split("_")), attributes).text = entry.value


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
