"""What stays in force from block to block: the one place where a program has memory. SI, X as a radius.

The variables in which a control tells where it stands: position, tool, offsets, modes.

Source: LinuxCNC 2.9 manual, chapter Parameters (numbered and predefined named); Fanuc 0i operator's manual, custom macro, system variables.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import lru_cache

from lathesim.program.dialects import Dialect
from lathesim.program.meanings import Group, Meaning
from lathesim.program.moves import Nose, Spindle, Tool

_spindle = lru_cache(64)(Spindle)


@dataclass
class Modal:
    """The modal state while a program is interpreted.

    ``feed`` is [m/s] or, with ``per_revolution``, [m]; ``feed_lost`` tells the line whose feed a change of feed mode dropped.
    ``speed`` is [rad/s] or, with ``surface``, [m/s]. ``taper`` to ``thread_allowance`` [m, rad] are what blocks tell later cycles.
    ``shift_x`` and ``shift_z`` come with G92 or G50, ``local`` with G52, ``offsets`` and ``tools`` from G10 or from whoever runs the
    program; ``nose`` is the compensation in force, ``side`` its side. ``level``, ``cycle_words`` and ``returns_to_plane`` (none
    without a code) belong to drilling cycles.
    ``said`` are the groups the program has spoken of before its first move.
    """

    x: float
    z: float
    diameter: bool
    per_revolution: bool
    motion: Meaning | None = None
    motion_code: str = ""
    absolute: bool = True
    arc_absolute: bool = False
    inch: bool = False
    plane: Meaning = Meaning.PLANE_XZ
    feed: float | None = None
    feed_line: int = 0
    feed_lost: str = ""
    lead: float | None = None
    surface: bool = False
    speed: float | None = None
    limit: float | None = None
    direction: int = 0
    tool: int | None = None
    tool_ready: int | None = None
    shift_x: float = 0.0
    shift_z: float = 0.0
    shift_kept: tuple[float, float] = (0.0, 0.0)
    local: tuple[float, float] = (0.0, 0.0)
    offset_number: int = 1
    offsets: dict[int, tuple[float, float]] = field(default_factory=dict)
    tools: dict[int, Tool] = field(default_factory=dict)
    tool_offset: tuple[float, float] = (0.0, 0.0)
    offset_of_tool: int = 0
    homes: dict[Meaning, tuple[float, float]] = field(default_factory=dict)
    nose: Nose | None = None
    side: int = 0
    level: float | None = None
    returns_to_plane: bool | None = None
    cycle_words: dict[str, float] = field(default_factory=dict)
    taper: float = 0.0
    cycle_end: tuple[float, float] | None = None
    cycle_depth: float | None = None
    cycle_retract: float | None = None
    relief: tuple[float, float] = (0.0, 0.0)
    repeats: int = 1
    peck_retract: float | None = None
    has_thread_values: bool = False
    thread_finishing: int = 1
    thread_angle: float = 0.0
    thread_smallest: float = 0.0
    thread_allowance: float = 0.0
    thread_chamfer: float = 0.0
    said: set[Group] = field(default_factory=set)

    @property
    def zero(self) -> tuple[float, float]:
        """Where the coordinates of the program begin: work offset, tool offset, origin shift and local shift together (x, z) [m]."""
        x, z = self.offsets.get(self.offset_number, (0.0, 0.0))
        return x + self.tool_offset[0] + self.shift_x + self.local[0], z + self.tool_offset[1] + self.shift_z + self.local[1]

    @property
    def here(self) -> tuple[float, float]:
        """The present position in the coordinates of the program (x, z) [m], X as a radius."""
        return self.x - self.zero[0], self.z - self.zero[1]

    @property
    def turning(self) -> bool:
        """Whether the spindle turns."""
        return self.direction != 0 and bool(self.speed)

    @property
    def spindle(self) -> Spindle:
        """The spindle as the next move sees it."""
        return _spindle(self.direction, self.surface, self.speed or 0.0, self.limit if self.surface else None)

    def shown(self, length: float) -> float:
        """Return a length [m] in the unit of the program [mm or inch]."""
        return length * 1e3 / (25.4 if self.inch else 1.0)

    def metres(self, value: float) -> float:
        """Return a programmed length [mm or inch] in metres; the division keeps 0.03 the same number as 30/1000."""
        return (value * 25.4 if self.inch else value) / 1000.0

    def across(self, value: float) -> float:
        """Return a programmed length along X [mm or inch] as a radius [m]; it is a diameter if positions along X are."""
        return self.metres(value) * (0.5 if self.diameter else 1.0)


_RPM = 30.0 / math.pi


def system_value(key: int | str, modal: Modal, dialect: Dialect) -> float | None:
    """Return the value of a variable of the machine in the units of the program, or None where there is none of that number or name."""
    if isinstance(key, str):
        return _named(key, modal)
    if dialect.numbered_parameters:
        return _numbered(key, modal)
    return _macro(key, modal, dialect)


def _numbered(key: int, modal: Modal) -> float | None:
    x, z = modal.here
    table = {
        5211: modal.shown(modal.shift_x), 5213: modal.shown(modal.shift_z), 5220: float(modal.offset_number), 5400: float(modal.tool or 0),
        5420: modal.shown(x), 5422: modal.shown(z),
    }  # fmt: skip
    if 5221 <= key <= 5383 and (key - 5221) % 20 in (0, 2):
        offset = modal.offsets.get((key - 5221) // 20 + 1, (0.0, 0.0))
        return modal.shown(offset[0] if (key - 5221) % 20 == 0 else offset[1])
    return table.get(key)


def _named(key: str, modal: Modal) -> float | None:
    x, z = modal.here
    feed = 0.0 if modal.feed is None else modal.shown(modal.feed * (1.0 if modal.per_revolution else 60.0))
    return {
        "_X": modal.shown(x), "_Y": 0.0, "_Z": modal.shown(z), "_METRIC": float(not modal.inch), "_IMPERIAL": float(modal.inch),
        "_ABSOLUTE": float(modal.absolute), "_INCREMENTAL": float(not modal.absolute), "_LATHE_DIAMETER_MODE": float(modal.diameter),
        "_LATHE_RADIUS_MODE": float(not modal.diameter), "_FEED": feed, "_CURRENT_TOOL": float(modal.tool or 0),
        "_SELECTED_TOOL": float(modal.tool_ready or 0), "_CSS_MODE": float(modal.surface), "_RPM_MODE": float(not modal.surface),
        "_SPINDLE_ON": float(modal.direction != 0), "_SPINDLE_CW": float(modal.direction > 0), "_COORD_SYSTEM": float(modal.offset_number),
        "_UNITS_PER_MINUTE": float(not modal.per_revolution), "_UNITS_PER_REV": float(modal.per_revolution),
        "_RPM": 0.0 if modal.surface else _RPM * (modal.speed or 0.0), "_PI": math.pi,
    }.get(key)  # fmt: skip


def _macro(key: int, modal: Modal, dialect: Dialect) -> float | None:
    x, z = modal.here
    double = 2.0 if modal.diameter else 1.0
    machine = (modal.x - dialect.machine_zero[0], modal.z - dialect.machine_zero[1])
    table = {
        5001: double * modal.shown(x), 5002: modal.shown(z), 5021: double * modal.shown(machine[0]), 5022: modal.shown(machine[1]),
        5041: double * modal.shown(x), 5042: modal.shown(z), 4120: float(modal.tool or 0),
    }  # fmt: skip
    return table.get(key)
