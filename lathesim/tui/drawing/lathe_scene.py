"""What the lathe view shows: the stock, the path that was asked for, and where the tool went."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from lathesim.analysis.metrics.metric import find_channel
from lathesim.analysis.part.nothing_cut import RawStock
from lathesim.record import FloatArray, Record
from lathesim.tui.drawing.carved_stock import CarvedStock

if TYPE_CHECKING:
    from lathesim.lessons.simulate import Prepared

_ARC_POINTS = 32
_NEAR = 0.5
"""Share of the length of the stock, beyond its ends, within which the path is always shown; across it is twice as much of the radius."""
_MOST_POINTS = 20_000


@dataclass
class LatheScene:
    """A stock, if there is one, and the path asked for: ``path_x`` (a radius) and ``path_z`` [m]."""

    stock: RawStock | None
    path_x: FloatArray
    path_z: FloatArray
    record: Record | None = None
    """A record of a cut in the loop, whose waves on the part are shown where there is no path."""
    carved: CarvedStock | None = field(init=False)

    def __post_init__(self) -> None:
        self.carved = CarvedStock(self.stock) if self.stock is not None else None

    @property
    def is_empty(self) -> bool:
        """Whether there is nothing to show."""
        return self.stock is None and not len(self.path_x)

    def bounds(self) -> tuple[float, float, float, float]:
        """Return the smallest and largest z and the smallest and largest x [m] of stock and path; the axis of the spindle is inside.

        Of a path that comes from far away only what lies near the stock counts.
        """
        usable = np.isfinite(self.path_x) & np.isfinite(self.path_z)
        if self.stock is not None:
            length, radius = self.stock.stock_length, self.stock.stock_radius
            near = (self.path_z > self.stock.face - _NEAR * length) & (self.path_z < self.stock.face + (1.0 + _NEAR) * length)
            usable &= near & (np.abs(self.path_x) < (1.0 + 2.0 * _NEAR) * radius)
        z = [*self.path_z[usable]]
        x = [0.0, *self.path_x[usable]]
        if self.stock is not None:
            z += [self.stock.face, self.stock.face + self.stock.stock_length]
            x.append(self.stock.stock_radius)
        if not z:
            return 0.0, 1.0, 0.0, 1.0
        return min(z), max(z), min(x), max(x)


@dataclass(frozen=True)
class Motion:
    """What was recorded of the tool up to a sample: actual and reference radius and place [m], each (samples,)."""

    x: FloatArray
    z: FloatArray
    x_reference: FloatArray
    z_reference: FloatArray

    @classmethod
    def of(cls, record: Record) -> Motion | None:
        """Return the motion in a record, or None where it has no two axes."""
        stock = RawStock.of(record)
        x = stock.x if stock is not None else find_channel(record, "x_axis.position", ".x_position")
        z = stock.z if stock is not None else find_channel(record, "z_axis.position", ".z_position")
        if x is None or z is None:
            return None
        x_reference, z_reference = find_channel(record, ".x_reference"), find_channel(record, ".z_reference")
        if x_reference is None or z_reference is None:
            return cls(record[x], record[z], record[x], record[z])
        return cls(record[x], record[z], record[x_reference], record[z_reference])

    def __len__(self) -> int:
        return len(self.x)


def scene_of_case(case: Prepared) -> LatheScene:
    """Return the scene before a run: the raw stock and the programmed path."""
    from lathesim.lessons.raw_stock import raw_stock
    from lathesim.path_columns import ARC_MOVE, CENTRE_X, CENTRE_Z, END_X, END_Z, KIND, RADIUS, START_ANGLE, START_X, START_Z, SWEEP

    table = next((part.tables["path"] for part in case.machinery.parts if "path" in part.tables), None)
    if table is None:
        return LatheScene(raw_stock(case.plan), np.empty(0), np.empty(0))
    x, z = [table[:1, START_X]], [table[:1, START_Z]]
    for row in table:
        if row[KIND] == ARC_MOVE:
            angle = row[START_ANGLE] + row[SWEEP] * np.linspace(0.0, 1.0, _ARC_POINTS)
            x.append(row[CENTRE_X] + row[RADIUS] * np.sin(angle))
            z.append(row[CENTRE_Z] + row[RADIUS] * np.cos(angle))
        else:
            x.append(row[[END_X]])
            z.append(row[[END_Z]])
    return LatheScene(raw_stock(case.plan), np.concatenate(x), np.concatenate(z))


def scene_of_record(record: Record) -> LatheScene:
    """Return the scene of a record: the stock it names and the reference it followed."""
    motion = Motion.of(record)
    if motion is None:
        has_waves = find_channel(record, "cut.wave", ".wave") is not None and find_channel(record, "spindle.angle", ".angle") is not None
        return LatheScene(None, np.empty(0), np.empty(0), record if has_waves else None)
    stride = max(1, len(motion) // _MOST_POINTS)
    return LatheScene(RawStock.of(record), motion.x_reference[::stride], motion.z_reference[::stride])
