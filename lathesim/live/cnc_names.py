"""Names of OPC 40502 for what a lesson records: which axis, which scale, which spindle.

Source: OPC 40502, OPC UA for Computerized Numerical Control Systems (CNC), release 1.0.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from lathesim.engine.assembly import SIDES, Assembly, Part, Place
from lathesim.live.samples import Signal

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
    parts = {part.name: part for part in assembly.parts}
    sources = {wire.target: wire.source for wire in assembly.wires if wire.source}
    by_motion = _sensors(parts, sources)
    found = []
    for signal in signals:
        path = _standard(signal, parts, sources, by_motion) or ("Signals", signal.name)
        found.append(PublishedName(signal.name, path, "mm" if path[0] == "CncAxisList" and signal.unit == "m" else signal.unit))
    taken: set[tuple[str, ...]] = set()
    for at, entry in enumerate(found):
        if entry.path in taken:
            found[at] = PublishedName(entry.channel, ("Signals", entry.channel), _unit(signals, entry.channel))
        taken.add(found[at].path)
    return found


def _unit(signals: Sequence[Signal], name: str) -> str:
    return next(signal.unit for signal in signals if signal.name == name)


def _sensors(parts: Mapping[str, Part], sources: Mapping[str, str]) -> dict[str, list[str]]:
    """Return for each motion (``part.output``) the outputs of its sensors; at the motor, then used by a controller, come first."""
    found: dict[str, list[str]] = {}
    closing = set(sources.values())
    for part in parts.values():
        ports = part.component.ports
        if "measured" in ports and "reading" in ports and "drive" not in ports:
            seen = _behind_effects(f"{part.name}.{ports['measured']}", sources)
            found.setdefault(seen, []).append(f"{part.name}.{ports['reading']}")
    side = {name: SIDES.index(part.side) for name, part in parts.items()}
    return {motion: sorted(outputs, key=lambda name: (side[Place.of(name).part], name not in closing)) for motion, outputs in found.items()}


def _behind_effects(target: str, sources: Mapping[str, str]) -> str:
    source = sources.get(target, "")
    while source.endswith(".outgoing"):
        source = sources.get(f"{Place.of(source).part}.incoming", "")
    return source


def _standard(
    signal: Signal, parts: Mapping[str, Part], sources: Mapping[str, str], by_motion: Mapping[str, list[str]]
) -> tuple[str, ...] | None:
    part, item = Place.of(signal.name)
    if part not in parts:
        return None
    for motion, sensors in by_motion.items():
        if signal.name in sensors and signal.unit in ("m", "rad"):
            indirect = len(sensors) > 1 and sensors.index(signal.name) == 0
            return ("CncAxisList", Place.of(motion).part, "PosIndirect" if indirect else "PosDirect", "ActPos")
    ports = parts[part].component.ports
    if "drive" in ports and "measured" in ports and item == ports["drive"] and signal.unit == "m":
        return ("CncAxisList", _axis_of(part, parts, sources, by_motion), "PosDirect", "CmdPos")
    if "flow" in ports and signal.unit == "rad/s" and item == ports["flow"]:
        return ("CncSpindleList", part, "ActSpeed")
    return None


def _axis_of(controller: str, parts: Mapping[str, Part], sources: Mapping[str, str], by_motion: Mapping[str, list[str]]) -> str:
    measured = sources.get(f"{controller}.{parts[controller].component.ports['measured']}", "")
    for motion, sensors in by_motion.items():
        if measured in sensors:
            return Place.of(motion).part
    return controller
