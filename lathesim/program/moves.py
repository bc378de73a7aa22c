"""What an interpreted program is: moves, events and warnings. Everything SI, X is a radius, angles by atan2(x - cx, z - cz).

Seen with +Z to the right and +X up, a positive sweep runs counterclockwise.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

from lathesim.program.nose.tool_nose import Nose
from lathesim.program.words import Warned

if TYPE_CHECKING:
    from lathesim.program.move_table import Moves

MoveKind = Literal["rapid", "feed", "arc", "thread", "dwell"]
EventKind = Literal[
    "spindle", "tool", "flood_on", "flood_off", "mist_on", "program_stop", "optional_program_stop", "program_end", "message"
]


@dataclass(frozen=True, slots=True)
class Spindle:
    """The spindle in force during a move.

    ``direction`` is +1 for M03, -1 for M04, 0 for off. ``speed`` is [rad/s], with ``surface`` [m/s] at the tool; ``limit`` [rad/s] bounds
    the speed of a constant surface speed, None means no bound.
    """

    direction: int = 0
    surface: bool = False
    speed: float = 0.0
    limit: float | None = None


@dataclass(frozen=True, slots=True)
class Arc:
    """An arc: centre and radii [m], angles [rad]. ``end_radius`` differs from ``radius`` by at most the arc tolerance."""

    centre_x: float
    centre_z: float
    radius: float
    end_radius: float
    start_angle: float
    sweep: float

    @property
    def clockwise(self) -> bool:
        """Whether the arc is a G02."""
        return self.sweep < 0.0


@dataclass(frozen=True, slots=True)
class Move:
    """One motion or dwell.

    ``feed`` is [m/s], with ``per_revolution`` [m] per revolution (of a ``thread``: its lead along the path); ``seconds`` belongs to a
    dwell, ``line`` is the physical line of the source.
    """

    kind: MoveKind
    line: int
    start_x: float
    start_z: float
    end_x: float
    end_z: float
    spindle: Spindle
    feed: float | None = None
    per_revolution: bool = False
    arc: Arc | None = None
    seconds: float = 0.0
    tool: int | None = None
    cycle: str = ""
    """The code of the cycle that the move was expanded from, as ``G71``, and the line of its block."""
    cycle_line: int = 0
    nose: Nose | None = None
    """The nose compensation that is still to be carried out on the move."""
    start_angle: float = 0.0
    """Angle from the index of the spindle to the start of a thread [rad]."""
    spin_back: bool = False
    """Whether a thread is the way out of a tapped hole: the spindle reverses and the tool stays on the lead."""

    @property
    def length(self) -> float:
        """Length of the way of the tool point [m]."""
        if self.arc is not None:
            return abs(self.arc.sweep) * self.arc.radius
        return math.hypot(self.end_x - self.start_x, self.end_z - self.start_z)


@dataclass(frozen=True)
class Event:
    """Something that happens between moves: before the move of index ``before_move``."""

    kind: EventKind
    line: int
    before_move: int
    direction: int = 0
    tool: int | None = None
    text: str = ""


@dataclass(frozen=True)
class Summary:
    """How many moves of each kind, the cut and rapid ways [m] and the last position [m]."""

    counts: Mapping[str, int]
    cut_path: float
    rapid_path: float
    final_x: float
    final_z: float


@dataclass(frozen=True)
class Program:
    """An interpreted part program.

    ``assumed`` holds the values that the program leaves open; ``contours`` are the moves of contour blocks, from which cycles make their
    own moves.
    """

    name: str
    dialect: str
    moves: Moves
    events: tuple[Event, ...]
    warnings: tuple[Warned, ...] = ()
    assumed: Mapping[str, str] = field(default_factory=dict)
    contours: Sequence[Move] = ()

    @property
    def summary(self) -> Summary:
        """Counts and lengths; rapids of no length are not counted as ways."""
        ways: dict[bool, array[float]] = {True: array("d"), False: array("d")}
        for kind, length in self.moves.ways():
            if kind != "dwell":
                ways[kind == "rapid"].append(length)
        last = self.moves[-1] if self.moves else None
        return Summary(
            self.moves.counts, math.fsum(ways[False]), math.fsum(ways[True]), last.end_x if last else 0.0, last.end_z if last else 0.0
        )
