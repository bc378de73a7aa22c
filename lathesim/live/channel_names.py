"""Which node or data item is which channel: the names of OPC 40502 for what a lesson records, and MAP.yaml for any other.

Source: OPC 40502, OPC UA for Computerized Numerical Control Systems (CNC), release 1.0.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from lathesim.engine.assembly import SIDES, Assembly, Place
from lathesim.errors import UnitError, nearest
from lathesim.identification.roles import behind_effects
from lathesim.live.samples import LiveError, Signal
from lathesim.units import si_factor

NAMESPACE = "http://opcfoundation.org/UA/CNC"
UNITS_NAMESPACE = "http://www.opcfoundation.org/UA/units/un/cefact"

TYPES: Mapping[str, tuple[int, str]] = {
    "CncComponentType": (1001, ""), "CncChannelType": (1002, "CncComponentType"), "CncDriveType": (1003, "CncComponentType"),
    "CncAxisType": (1004, "CncDriveType"), "CncSpindleType": (1005, "CncDriveType"), "CncInterfaceType": (1007, ""),
    "CncAxisListType": (1008, ""), "CncSpindleListType": (1009, ""), "CncChannelListType": (1010, ""),
}  # fmt: skip
"""Number of each object type in the namespace of the standard, and its base type."""
POSITION_TYPE = 2001
"""Number of CncPositionVariableType."""

_UNIT_CODES = {
    "m": "MTR", "mm": "MMT", "um": "4H", "m/s": "MTS", "mm/s": "C16", "m/s^2": "MSK", "rad": "C81", "deg": "DD", "rad/s": "2A",
    "rpm": "RPM", "N": "NEW", "N*m": "NU", "V": "VLT", "A": "AMP", "W": "WTT", "Hz": "HTZ", "s": "SEC", "Pa": "PAL", "K": "KEL", "1": "C62",
}  # fmt: skip
"""Common code of each unit. Source: UNECE Recommendation 20, codes for units of measure used in international trade."""


def unit_number(unit: str) -> int:
    """Return the number of a unit in EUInformation: the bytes of its common code, -1 where it has none.

    Source: OPC 10000-8, 5.6.3, EUInformation.
    """
    code = _UNIT_CODES.get(unit)
    return -1 if code is None else int.from_bytes(code.encode("ascii"), "big")


def type_of(path: tuple[str, ...]) -> str:
    """Return the object type of a path below the machine, or an empty text if the standard has none."""
    lists = {"CncAxisList": "CncAxisType", "CncSpindleList": "CncSpindleType", "CncChannelList": "CncChannelType"}
    if path[0] not in lists or len(path) > 2:
        return ""
    return f"{path[0]}Type" if len(path) == 1 else lists[path[0]]


@dataclass(frozen=True)
class PublishedName:
    """Where a channel is found: ``path`` of browse names below the machine, and the ``unit`` it has there."""

    channel: str
    path: tuple[str, ...]
    unit: str


def published_names(assembly: Assembly, signals: Sequence[Signal]) -> list[PublishedName]:
    """Return the standard place of each channel, and ``Signals / part.output`` for what the standard has no name for.

    A sensor that a controller closes its loop on is the motor's (PosIndirect) where another sensor sees the same motion, which is then the
    scale (PosDirect); a single sensor is PosDirect.
    """
    by_motion = _sensors(assembly)
    found = []
    for signal in signals:
        path = _standard(signal, assembly, by_motion) or ("Signals", signal.name)
        found.append(PublishedName(signal.name, path, "mm" if path[0] == "CncAxisList" and signal.unit == "m" else signal.unit))
    taken: set[tuple[str, ...]] = set()
    for at, entry in enumerate(found):
        if entry.path in taken:
            found[at] = PublishedName(entry.channel, ("Signals", entry.channel), _unit(signals, entry.channel))
        taken.add(found[at].path)
    return found


def _unit(signals: Sequence[Signal], name: str) -> str:
    return next(signal.unit for signal in signals if signal.name == name)


def _sensors(assembly: Assembly) -> dict[str, list[str]]:
    """Return for each motion (``part.output``) the outputs of its sensors; at the motor, then used by a controller, come first."""
    found: dict[str, list[str]] = {}
    closing = set(assembly.sources.values())
    for part in assembly.parts:
        ports = part.component.ports
        if "measured" in ports and "reading" in ports and "drive" not in ports:
            seen = behind_effects(assembly, f"{part.name}.{ports['measured']}")
            found.setdefault(seen, []).append(f"{part.name}.{ports['reading']}")
    side = {part.name: SIDES.index(part.side) for part in assembly.parts}
    return {motion: sorted(outputs, key=lambda name: (side[Place.of(name).part], name not in closing)) for motion, outputs in found.items()}


def _standard(signal: Signal, assembly: Assembly, by_motion: Mapping[str, list[str]]) -> tuple[str, ...] | None:
    part, item = Place.of(signal.name)
    if part not in assembly.by_name:
        return None
    for motion, sensors in by_motion.items():
        if signal.name in sensors and signal.unit in ("m", "rad"):
            indirect = len(sensors) > 1 and sensors.index(signal.name) == 0
            return ("CncAxisList", Place.of(motion).part, "PosIndirect" if indirect else "PosDirect", "ActPos")
    ports = assembly.ports(part)
    if "drive" in ports and "measured" in ports and item == ports["drive"] and signal.unit == "m":
        return ("CncAxisList", _axis_of(part, assembly, by_motion), "PosDirect", "CmdPos")
    if "flow" in ports and signal.unit == "rad/s" and item == ports["flow"]:
        return ("CncSpindleList", part, "ActSpeed")
    return None


def _axis_of(controller: str, assembly: Assembly, by_motion: Mapping[str, list[str]]) -> str:
    measured = assembly.sources.get(f"{controller}.{assembly.ports(controller)['measured']}", "")
    for motion, sensors in by_motion.items():
        if measured in sensors:
            return Place.of(motion).part
    return controller


_ROUNDING = 1e-12
_KEYS = ("node", "path", "item", "unit", "si")
_WAYS = ("node", "path", "item")


@dataclass(frozen=True)
class MappedItem:
    """One channel: its ``name``, where it is found (``way`` node, path or item, and ``at``), the ``unit`` there, its ``factor`` to SI."""

    name: str
    way: str
    at: str
    unit: str
    factor: float
    si_unit: str

    @property
    def signal(self) -> Signal:
        """Return the channel as a signal of a stream."""
        return Signal(self.name, self.si_unit, f"{self.way} {self.at}")


def map_from(data: Mapping[str, Any], place: str) -> list[MappedItem]:
    """Return the items of ``{channels: {x_scale.position: {path: CncAxisList/x_axis/PosDirect/ActPos, unit: mm, si: m}}}``.

    ``node`` is an OPC UA node id, ``path`` a path of browse names below Objects or the CncInterface, ``item`` an id or name of an
    MTConnect data item. ``si`` is the SI unit of the channel where it is not clear. Raises :class:`LiveError` with the nearest name.
    """
    channels = data.get("channels")
    if not isinstance(channels, Mapping) or not channels:
        remedy = "Write channels: {x_scale.position: {path: CncAxisList/x_axis/PosDirect/ActPos, unit: mm}}."
        raise LiveError("the map names no channels.", place=place, remedy=remedy)
    for key in data:
        if key != "channels":
            raise LiveError(f"there is no key '{key}'.", place=place, remedy=nearest(str(key), ["channels"]) or "Known is channels.")
    return [_item(str(name), entry, f"{place}: {name}") for name, entry in channels.items()]


def _item(name: str, entry: Any, place: str) -> MappedItem:
    if not isinstance(entry, Mapping):
        raise LiveError("the channel is not described.", place=place, remedy="Write {node: 'ns=2;s=X', unit: mm}.")
    for key in entry:
        if key not in _KEYS:
            raise LiveError(f"there is no key '{key}'.", place=place, remedy=nearest(str(key), _KEYS) or f"Known are {', '.join(_KEYS)}.")
    ways = [way for way in _WAYS if way in entry]
    if len(ways) != 1:
        raise LiveError(f"the channel has {len(ways)} of {', '.join(_WAYS)}.", place=place, remedy="Give exactly one of them.")
    unit = str(entry.get("unit", "1"))
    try:
        factor, dimension = si_factor(unit)
        si_unit = str(entry.get("si", _si_names().get(dimension, "")))
        if not si_unit:
            raise LiveError(f"the SI unit of {unit} is not clear.", place=place, remedy="Add it, as in si: N.")
        if abs(si_factor(si_unit)[0] - 1.0) > _ROUNDING or si_factor(si_unit)[1] != dimension:
            raise LiveError(f"{si_unit} is not the SI unit of {unit}.", place=place, remedy="Write si: with the SI unit.")
    except UnitError as error:
        raise LiveError(error.fact, place=place, remedy=error.remedy) from None
    return MappedItem(name, ways[0], str(entry[ways[0]]), unit, factor, si_unit)


@functools.cache
def _si_names() -> dict[str, str]:
    """Return the SI unit by dimension, for what machines publish."""
    return {si_factor(unit)[1]: unit for unit in ("m", "m/s", "m/s^2", "s", "V", "A", "N", "N*m", "W", "rad/s", "K", "kg", "rad")}
