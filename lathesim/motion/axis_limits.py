"""Limits of the axes and of the feed at the tool, as data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from lathesim.errors import nearest
from lathesim.motion.joint_path import FloatArray, MotionError
from lathesim.units import quantity

_KEYS = ("axes", "feed", "kinematics")
_AXIS_KEYS = ("velocity", "acceleration", "jerk")


@dataclass(frozen=True, eq=False)
class AxisLimits:
    """Largest speeds of each axis, (axes,): ``velocity`` [m/s or rad/s], ``acceleration`` and ``jerk`` in SI; ``feed`` at the tool [m/s].

    ``jerk`` and ``feed`` may be infinite. Raises :class:`MotionError` where a limit is not above 0.
    """

    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray
    feed: float = float("inf")

    def __post_init__(self) -> None:
        for name in _AXIS_KEYS:
            values = np.asarray(getattr(self, name), dtype=np.float64)
            object.__setattr__(self, name, values)
            if not (values > 0.0).all():
                raise MotionError(f"a limit of {name} is not above 0.", remedy="Give every axis limits above 0.")
        if not self.feed > 0.0:
            raise MotionError("the feed is not above 0.", remedy="Give a feed above 0, or leave it out.")

    def scaled(self, share: float) -> AxisLimits:
        """Return the limits with ``share`` of the accelerations, the rest kept free; ``share`` in (0, 1]."""
        return AxisLimits(self.velocity, share * self.acceleration, self.jerk, self.feed)


def limits_from(data: Mapping[str, Any], names: Sequence[str], units: Sequence[str], place: str) -> AxisLimits:
    """Return the limits of a mapping ``{axes: {x: {velocity: 40 mm/s, acceleration: 1 m/s^2, jerk: 20 m/s^3}}, feed: 30 mm/s}``.

    Every axis of the path needs velocity and acceleration. Raises :class:`MotionError` with the nearest name.
    """
    _check_keys(data, _KEYS, place)
    axes = data.get("axes")
    if not isinstance(axes, Mapping):
        raise MotionError("the file has no 'axes:'.", place=place, remedy="Write axes: {x: {velocity: 40 mm/s, acceleration: 1 m/s^2}}.")
    rows = []
    for name, unit in zip(names, units, strict=True):
        entry = axes.get(name)
        if not isinstance(entry, Mapping):
            raise MotionError(f"the axis '{name}' has no limits.", place=place, remedy=nearest(name, axes) or "Add it under axes.")
        _check_keys(entry, _AXIS_KEYS, f"{place}: {name}")
        rows.append(_axis(entry, unit, f"{place}: {name}"))
    feed = _number(data["feed"], "m/s", f"{place}: feed") if "feed" in data else float("inf")
    columns = np.array(rows).T
    return AxisLimits(columns[0], columns[1], columns[2], feed)


def _axis(entry: Mapping[str, Any], unit: str, place: str) -> list[float]:
    row = []
    for order, key in enumerate(_AXIS_KEYS, start=1):
        power = "s" if order == 1 else f"s^{order}"
        if key not in entry and key != "jerk":
            raise MotionError(f"there is no {key}.", place=place, remedy=f"Add one, for example {key}: 1 {unit}/{power}.")
        row.append(_number(entry[key], f"{unit}/{power}", place) if key in entry else float("inf"))
    return row


def _number(value: object, unit: str, place: str) -> float:
    from lathesim.errors import UnitError

    try:
        return quantity(str(value), unit)
    except UnitError as error:
        raise MotionError(error.fact, place=place, remedy=error.remedy) from None


def _check_keys(data: Mapping[str, Any], known: Sequence[str], place: str) -> None:
    for key in data:
        if key not in known:
            raise MotionError(f"there is no key '{key}'.", place=place, remedy=nearest(str(key), known) or f"Known are {', '.join(known)}.")
