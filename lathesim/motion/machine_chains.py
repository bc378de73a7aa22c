"""The kinematics that ship, and the reading of others from a file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from lathesim.errors import UnitError, nearest
from lathesim.motion.joint_path import MotionError
from lathesim.motion.kinematics import Chain, RotaryAxis
from lathesim.units import quantity

_X, _Y, _Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
_NAMED = {"x": _X, "y": _Y, "z": _Z}
_XYZ = ("x", "y", "z")

CHAINS: dict[str, Chain] = {
    "trunnion": Chain("trunnion", _XYZ, (RotaryAxis("a", _X, (0.0, 0.0, -30e-3)), RotaryAxis("b", _Y, (0.0, 0.0, 10e-3)))),
    "table_table": Chain("table_table", _XYZ, (RotaryAxis("a", _X, (0.0, 0.0, -50e-3)), RotaryAxis("c", _Z, (0.0, 0.0, 20e-3)))),
    "head_table": Chain("head_table", _XYZ, (RotaryAxis("c", _Z),), (RotaryAxis("b", _Y),), tool=(0.0, 0.0, -120e-3)),
    "lathe": Chain("lathe", ("x", "", "z"), tool_axis=_X),
    "lathe_with_c": Chain("lathe_with_c", ("x", "", "z"), (RotaryAxis("c", _Z),), tool_axis=_X),
}
"""Machines by name. Offsets are assumed: a table of a desktop machine, a head with a tool of 120 mm; a lathe's holder lies at larger X."""

_KEYS = ("linear", "table", "head", "tool", "tool_axis")


def chain_from(data: object, place: str) -> Chain:
    """Return the chain a file names, or describes as ``{linear: [x, y, z], table: [{axis: a, about: x, pivot: [0 mm, 0 mm, -30 mm]}]}``.

    Raises :class:`MotionError` with the nearest name.
    """
    if isinstance(data, str):
        if data not in CHAINS:
            remedy = nearest(data, CHAINS) or f"Known are {', '.join(CHAINS)}."
            raise MotionError(f"there is no kinematics '{data}'.", place=place, remedy=remedy)
        return CHAINS[data]
    if not isinstance(data, Mapping):
        raise MotionError("the kinematics are neither a name nor a mapping.", place=place, remedy=f"Known names are {', '.join(CHAINS)}.")
    _known(data, _KEYS, place)
    linear = data.get("linear", list(_XYZ))
    if not isinstance(linear, list) or len(linear) != 3 or not all(name is None or isinstance(name, str) for name in linear):
        raise MotionError(
            "'linear' is no list of three names.", place=place, remedy="Write linear: [x, y, z], null where there is no axis."
        )
    table = tuple(_rotary(entry, f"{place}: table") for entry in _listed(data.get("table", []), place))
    head = tuple(_rotary(entry, f"{place}: head") for entry in _listed(data.get("head", []), place))
    tool = _vector(data.get("tool", ["0 m"] * 3), place)
    direction = _direction(data.get("tool_axis", "z"), place)
    chain = Chain("of the file", tuple(name or "" for name in linear), table, head, tool, direction)  # type: ignore[arg-type]
    if len(set(chain.axes)) != len(chain.axes):
        raise MotionError("two axes have the same name.", place=place, remedy="Name each axis once.")
    return chain


def _rotary(entry: Any, place: str) -> RotaryAxis:
    if not isinstance(entry, Mapping) or not isinstance(entry.get("axis"), str):
        raise MotionError("an axis has no name.", place=place, remedy="Write {axis: a, about: x, pivot: [0 mm, 0 mm, -30 mm]}.")
    _known(entry, ("axis", "about", "pivot"), place)
    return RotaryAxis(entry["axis"], _direction(entry.get("about"), place), _vector(entry.get("pivot", ["0 m"] * 3), place))


def _listed(entries: Any, place: str) -> list[Any]:
    if not isinstance(entries, list):
        raise MotionError("'table' and 'head' are lists of axes.", place=place, remedy="Write table: [{axis: a, about: x}].")
    return entries


def _direction(entry: Any, place: str) -> tuple[float, float, float]:
    if isinstance(entry, str) and entry in _NAMED:
        return _NAMED[entry]
    if isinstance(entry, list) and len(entry) == 3 and all(isinstance(part, (int, float)) for part in entry):
        length = float(np.linalg.norm(entry))
        if length > 0.0:
            return (entry[0] / length, entry[1] / length, entry[2] / length)
    raise MotionError("a direction is missing.", place=place, remedy="Write about: x, y or z, or three numbers [0, 0.7, 0.7].")


def _vector(entry: Any, place: str) -> tuple[float, float, float]:
    if not isinstance(entry, list) or len(entry) != 3:
        raise MotionError("a position is no list of three lengths.", place=place, remedy="Write [0 mm, 0 mm, -30 mm].")
    try:
        first, second, third = (quantity(str(part), "m") for part in entry)
    except UnitError as error:
        raise MotionError(error.fact, place=place, remedy=error.remedy) from None
    return first, second, third


def _known(data: Mapping[str, Any], keys: tuple[str, ...], place: str) -> None:
    for key in data:
        if key not in keys:
            raise MotionError(f"there is no key '{key}'.", place=place, remedy=nearest(str(key), keys) or f"Known are {', '.join(keys)}.")
