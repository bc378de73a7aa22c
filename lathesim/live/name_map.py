"""MAP.yaml: which node or data item becomes which channel of a record."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from lathesim.errors import UnitError, nearest
from lathesim.live.samples import LiveError, Signal
from lathesim.units import si_factor

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
        if abs(si_factor(si_unit)[0] - 1.0) > 1e-12 or si_factor(si_unit)[1] != dimension:
            raise LiveError(f"{si_unit} is not the SI unit of {unit}.", place=place, remedy="Write si: with the SI unit.")
    except UnitError as error:
        raise LiveError(error.fact, place=place, remedy=error.remedy) from None
    return MappedItem(name, ways[0], str(entry[ways[0]]), unit, factor, si_unit)


@functools.cache
def _si_names() -> dict[str, str]:
    """Return the SI unit by dimension, for what machines publish."""
    return {si_factor(unit)[1]: unit for unit in ("m", "m/s", "m/s^2", "s", "V", "A", "N", "N*m", "W", "rad/s", "K", "kg", "rad")}
