"""Set-points: a timed path sampled at the period of the servos, as a record."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from lathesim.motion.joint_path import FloatArray
from lathesim.motion.timing import Timing
from lathesim.record import Channel, Record

_BLOCK = 16384
_ORDERS = (("position", ""), ("velocity", "/s"), ("acceleration", "/s^2"))


def sample_times(duration: float, period: float) -> FloatArray:
    """Return the instants k period from 0 up to the first at or after ``duration``; the last shows the axes at rest."""
    count = int(np.ceil(duration / period - 1e-9)) + 1
    return np.arange(count, dtype=np.float64) * period


def set_points(timing: Timing, period: float) -> Record:
    """Return positions, velocities and accelerations of the axes at every servo period [s], as channels ``x.position`` and so on."""
    time = sample_times(timing.duration, period)
    columns = timing.at(time)
    channels = {
        channel.name: Channel(channel.name, channel.unit, columns[place % 3][:, place // 3], channel.description)
        for place, channel in enumerate(_channels(timing))
    }
    return Record(time, channels, _meta(timing, period))


def save_set_points(timing: Timing, period: float, path: str | Path, more: Mapping[str, str | float | int] | None = None) -> int:
    """Write the set-points block by block, so that memory stays bounded; return their number."""
    from lathesim.record_writer import RecordWriter

    time = sample_times(timing.duration, period)
    with RecordWriter(path, _channels(timing), block=min(len(time), _BLOCK)) as writer:
        for begin in range(0, len(time), _BLOCK):
            here = time[begin : begin + _BLOCK]
            columns = timing.at(here)
            writer.write(here, [columns[place % 3][:, place // 3] for place in range(3 * len(timing.path.names))])
        writer.finish({**_meta(timing, period), **(more or {})})
    return len(time)


def _channels(timing: Timing) -> list[Channel]:
    empty = np.zeros(0)
    return [
        Channel(f"{name}.{order}", f"{unit}{per}", empty, f"{order} of the axis {name}")
        for name, unit in zip(timing.path.names, timing.path.units, strict=True)
        for order, per in _ORDERS
    ]


def _meta(timing: Timing, period: float) -> dict[str, str | float | int]:
    return {"sample_period": period, "status": "complete", "duration": timing.duration, "kind": "set-points"}
