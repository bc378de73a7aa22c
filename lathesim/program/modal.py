"""What stays in force from block to block: the one place where a program has memory. SI, X as a radius.

The variables in which a control says where it stands: position, tool, offsets, modes.

Source: LinuxCNC 2.9 manual, chapter Parameters (numbered and predefined named); Fanuc 0i operator's manual, custom macro, system variables.
"""

from __future__ import annotations

import math
from copy import copy
from dataclasses import dataclass, field, replace
from functools import lru_cache

from lathesim.program.dialects import Dialect
from lathesim.program.meanings import Group, Meaning
from lathesim.program.moves import Nose, Spindle, Tool

Point = tuple[float, float]
"""(x, z) [m], X as a radius."""

_spindle = lru_cache(64)(Spindle)


@dataclass
class FeedInForce:
    """The feed [m/s] or, with ``per_revolution``, [m], and the ``lead`` of threads [m]; ``lost`` says which line dropped the feed."""

    per_revolution: bool
    value: float | None = None
    line: int = 0
    lost: str = ""
    lead: float | None = None


@dataclass
class SpindleInForce:
    """The spindle: ``speed`` [rad/s] or, with ``surface``, [m/s]; ``limit`` [rad/s] and ``direction`` as in ``moves.Spindle``."""

    surface: bool = False
    speed: float | None = None
    limit: float | None = None
    direction: int = 0

    @property
    def turns(self) -> bool:
        """Whether the spindle turns."""
        return self.direction != 0 and bool(self.speed)

    @property
    def now(self) -> Spindle:
        """The spindle of the next move."""
        return _spindle(self.direction, self.surface, self.speed or 0.0, self.limit if self.surface else None)


@dataclass
class Origin:
    """Where coordinates begin, each part (x, z) [m]: ``shift`` of G92 or G50, ``local`` of G52, work ``offsets`` by number, and the tool.

    ``kept`` is the shift that G92.3 restores, ``number`` that of the work offset in force, ``homes`` are reference points that were set.
    """

    shift: Point = (0.0, 0.0)
    kept: Point = (0.0, 0.0)
    local: Point = (0.0, 0.0)
    tool: Point = (0.0, 0.0)
    number: int = 1
    offsets: dict[int, Point] = field(default_factory=dict)
    homes: dict[Meaning, Point] = field(default_factory=dict)

    @property
    def zero(self) -> Point:
        """All parts together."""
        x, z = self.offsets.get(self.number, (0.0, 0.0))
        return x + self.tool[0] + self.shift[0] + self.local[0], z + self.tool[1] + self.shift[1] + self.local[1]


@dataclass
class Turret:
    """The tools by number: the one in ``use``, the one made ``ready``, whose ``offset`` counts; ``nose`` is the compensation in force."""

    stations: int
    tools: dict[int, Tool] = field(default_factory=dict)
    use: int | None = None
    ready: int | None = None
    offset: int = 0
    side: int = 0
    nose: Nose | None = None


@dataclass
class RoughingWords:
    """Words of contour cycles: depth, retract, relief of G73 with its number of passes, and the retract of grooving [m]."""

    depth: float = 0.0
    retract: float | None = None
    relief: Point = (0.0, 0.0)
    passes: int = 1
    peck_retract: float | None = None


@dataclass
class ThreadWords:
    """Words of the first block of G76, and of single passes: their ``taper`` and where the last one ended [m, rad, leads]."""

    given: bool = False
    finishing: int = 1
    angle: float = 0.0
    smallest: float = 0.0
    allowance: float = 0.0
    chamfer: float = 0.0
    taper: float = 0.0
    end: Point | None = None


@dataclass
class HoleWords:
    """Words of drilling cycles as numbers, the ``level`` along Z [m] where the first began, and whether they return to the R plane."""

    words: dict[str, float] = field(default_factory=dict)
    level: float | None = None
    returns_to_plane: bool | None = None


@dataclass
class ModesInForce:
    """The codes in force: how places are given, in which plane, and the motion of blocks that name none."""

    diameter: bool
    absolute: bool = True
    arc_absolute: bool = False
    inch: bool = False
    plane: Meaning = Meaning.PLANE_XZ
    motion: Meaning | None = None
    motion_code: str = ""


@dataclass
class Modal:
    """The modal state of a program: position, and groups of what belongs together.

    ``said`` are the groups of codes that the program has used before its first move.
    """

    x: float
    z: float
    modes: ModesInForce
    feed: FeedInForce
    turret: Turret
    said: set[Group] = field(default_factory=set)
    spindle: SpindleInForce = field(default_factory=SpindleInForce)
    origin: Origin = field(default_factory=Origin)
    roughing: RoughingWords = field(default_factory=RoughingWords)
    thread: ThreadWords = field(default_factory=ThreadWords)
    hole: HoleWords = field(default_factory=HoleWords)

    def copied(self) -> Modal:
        """Return a state that changes without this one."""
        groups = ("modes", "feed", "turret", "spindle", "origin", "roughing", "thread", "hole")
        return replace(self, **{name: copy(getattr(self, name)) for name in groups})

    @property
    def place(self) -> Point:
        """Where the tool stands (x, z) [m]."""
        return self.x, self.z

    @property
    def here(self) -> Point:
        """The present position in the coordinates of the program (x, z) [m], X as a radius."""
        zero = self.origin.zero
        return self.x - zero[0], self.z - zero[1]

    def shown(self, length: float) -> float:
        """Return a length [m] in the unit of the program [mm or inch]."""
        return length * 1e3 / (25.4 if self.modes.inch else 1.0)

    def metres(self, value: float) -> float:
        """Return a programmed length [mm or inch] in metres; the division keeps 0.03 the same number as 30/1000."""
        return (value * 25.4 if self.modes.inch else value) / 1000.0

    def across(self, value: float) -> float:
        """Return a programmed length along X [mm or inch] as a radius [m]; it is a diameter if positions along X are."""
        return self.metres(value) * (0.5 if self.modes.diameter else 1.0)


_RPM = 30.0 / math.pi
_OFFSETS, _PER_OFFSET = range(5221, 5384), 20
"""Parameters of the work offsets, and how many each of them has. Source: LinuxCNC 2.9 manual, Numbered Parameters."""


def system_value(key: int | str, modal: Modal, dialect: Dialect) -> float | None:
    """Return the value of a variable of the machine in the units of the program, or None where there is none of that number or name."""
    if isinstance(key, str):
        return _named(key, modal)
    return _numbered(key, modal) if dialect.program.numbered_parameters else _macro(key, modal, dialect)


def _numbered(key: int, modal: Modal) -> float | None:
    x, z = modal.here
    origin = modal.origin
    if key in _OFFSETS and (key - _OFFSETS.start) % _PER_OFFSET in (0, 2):
        number, axis = divmod(key - _OFFSETS.start, _PER_OFFSET)
        return modal.shown(origin.offsets.get(number + 1, (0.0, 0.0))[axis // 2])
    return {
        5211: modal.shown(origin.shift[0]), 5213: modal.shown(origin.shift[1]), 5220: float(origin.number),
        5400: float(modal.turret.use or 0), 5420: modal.shown(x), 5422: modal.shown(z),
    }.get(key)  # fmt: skip


def _named(key: str, modal: Modal) -> float | None:
    x, z = modal.here
    spindle, modes, per_revolution = modal.spindle, modal.modes, modal.feed.per_revolution
    feed = 0.0 if modal.feed.value is None else modal.shown(modal.feed.value * (1.0 if per_revolution else 60.0))
    return {
        "_X": modal.shown(x), "_Y": 0.0, "_Z": modal.shown(z), "_METRIC": float(not modes.inch), "_IMPERIAL": float(modes.inch),
        "_ABSOLUTE": float(modes.absolute), "_INCREMENTAL": float(not modes.absolute), "_LATHE_DIAMETER_MODE": float(modes.diameter),
        "_LATHE_RADIUS_MODE": float(not modes.diameter), "_FEED": feed, "_CURRENT_TOOL": float(modal.turret.use or 0),
        "_SELECTED_TOOL": float(modal.turret.ready or 0), "_CSS_MODE": float(spindle.surface), "_RPM_MODE": float(not spindle.surface),
        "_SPINDLE_ON": float(spindle.direction != 0), "_SPINDLE_CW": float(spindle.direction > 0),
        "_COORD_SYSTEM": float(modal.origin.number), "_UNITS_PER_MINUTE": float(not per_revolution),
        "_UNITS_PER_REV": float(per_revolution), "_RPM": 0.0 if spindle.surface else _RPM * (spindle.speed or 0.0), "_PI": math.pi,
    }.get(key)  # fmt: skip


def _macro(key: int, modal: Modal, dialect: Dialect) -> float | None:
    x, z = modal.here
    double = 2.0 if modal.modes.diameter else 1.0
    machine = (modal.x - dialect.origin.machine_zero[0], modal.z - dialect.origin.machine_zero[1])
    return {
        5001: double * modal.shown(x), 5002: modal.shown(z), 5021: double * modal.shown(machine[0]), 5022: modal.shown(machine[1]),
        5041: double * modal.shown(x), 5042: modal.shown(z), 4120: float(modal.turret.use or 0),
    }.get(key)  # fmt: skip
