"""What an interpreted program is: moves, events and warnings. Everything SI, X is a radius, angles by atan2(x - cx, z - cz).

Seen with +Z to the right and +X up, a positive sweep runs counterclockwise. Geometry reckons with places as complex numbers ``z + x j``.

Tools as a program or a person gives them: nose radius, orientation 1 to 9, and offsets.
"""

from __future__ import annotations

import cmath
import math
from array import array
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple, overload

from lathesim.program.words import Warned

LEFT, RIGHT = 1, -1
"""The side of the contour on which the tool goes: left with G41, right with G42, seen along the motion."""

_FROM_CENTRE = {0: (0, 0), 1: (1, 1), 2: (1, -1), 3: (-1, -1), 4: (-1, 1), 5: (0, 1), 6: (1, 0), 7: (0, -1), 8: (-1, 0), 9: (0, 0)}
"""Where the imaginary tool point lies from the centre of the nose, in nose radii along (x, z), by orientation.

Source: Fanuc 0i-T operator's manual, imaginary tool nose; Haas lathe operator's manual, tip direction.
"""
ORIENTATIONS = tuple(_FROM_CENTRE)


@dataclass(frozen=True)
class Tool:
    """A tool: ``radius`` of its nose [m], ``orientation`` of its tool point, offsets [m, X as a radius]."""

    radius: float = 0.0
    orientation: int = 0
    x: float = 0.0
    z: float = 0.0


@dataclass(frozen=True)
class Nose:
    """The compensation in force: ``side`` is LEFT or RIGHT; the tool point lies ``(point_x, point_z)`` [m] from the centre of the nose.

    With ``starts_beside`` the first move ends beside the beginning of the next one, as on Fanuc; else the two meet in an inner corner.
    """

    side: int
    radius: float
    point_x: float
    point_z: float
    starts_beside: bool = False


def nose(side: int, tool: Tool, *, front: bool, starts_beside: bool = False) -> Nose:
    """Return the compensation with a tool; with ``front`` orientations count as on a lathe with its tool in front (X mirrored)."""
    x, z = _FROM_CENTRE[tool.orientation]
    return Nose(side, tool.radius, tool.radius * (-x if front else x), tool.radius * z, starts_beside)


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

    @property
    def centre(self) -> complex:
        """The centre in the plane [m]."""
        return complex(self.centre_z, self.centre_x)

    def at(self, angle: float) -> complex:
        """Return the place at an angle [rad]."""
        return self.centre + cmath.rect(self.radius, angle)


def turned(centre: complex, start: complex, end: complex, *, clockwise: bool) -> float:
    """Return by what angle, from 0 to below a turn [rad], an arc about a centre goes from start to end."""
    begin, finish = cmath.phase(start - centre), cmath.phase(end - centre)
    return (begin - finish if clockwise else finish - begin) % (2.0 * math.pi)


@dataclass(frozen=True)
class Corner:
    """A corner at the end of a move: ``size`` [m] is the radius of a rounding, else what a chamfer takes off both moves.

    ``sign`` says which way the next move goes, along ``axis`` where that is named; 0 where nothing says so.
    """

    rounds: bool
    size: float
    text: str
    line: int
    axis: str = ""
    sign: float = 0.0


class MoveMode(NamedTuple):
    """The values of a move that many moves share.

    The feed is ``per_revolution`` or else per time; ``seconds`` belong to a dwell.
    """

    spindle: Spindle = Spindle()
    per_revolution: bool = False
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


@dataclass(frozen=True, slots=True)
class Move:
    """One motion or dwell, on a physical ``line`` of the source.

    ``feed`` is [m/s], or by its ``mode`` [m] per revolution (of a ``thread``: its lead along the path).
    """

    kind: MoveKind
    line: int
    start_x: float
    start_z: float
    end_x: float
    end_z: float
    mode: MoveMode
    feed: float | None = None
    arc: Arc | None = None

    @property
    def start(self) -> complex:
        """The start in the plane [m]."""
        return complex(self.start_z, self.start_x)

    @property
    def end(self) -> complex:
        """The end in the plane [m]."""
        return complex(self.end_z, self.end_x)

    def in_mode(self, **changes: object) -> Move:
        """Return the move with other values of its mode."""
        return replace(self, mode=self.mode._replace(**changes))  # type: ignore[arg-type]

    def between(self, start: complex, end: complex, **changes: object) -> Move:
        """Return the move between other places."""
        ends = {"start_x": start.imag, "start_z": start.real, "end_x": end.imag, "end_z": end.real}
        return replace(self, **ends, **changes)  # type: ignore[arg-type]

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
    before_move: int = 0
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


KINDS: tuple[MoveKind, ...] = ("rapid", "feed", "arc", "thread", "dwell")
CUTTING: tuple[MoveKind, ...] = ("feed", "arc", "thread")
_NUMBER: dict[str, int] = {kind: number for number, kind in enumerate(KINDS)}
_NO_FEED = -1.0
_NO_ARC = -1
_ARC_VALUES = 6


class PlannedMove(NamedTuple):
    """A move in the making, from ``start`` to ``end`` (x, z) [m]; a ``corner`` is still to be broken between it and the next one."""

    kind: MoveKind
    line: int
    start: tuple[float, float]
    end: tuple[float, float]
    feed: float | None
    arc: Arc | None
    mode: MoveMode
    corner: Corner | None = None


Made = Sequence[PlannedMove | Event]
"""What a step of a block makes: moves, and events between them."""


def planned(move: Move) -> PlannedMove:
    """Return a move in the making."""
    return PlannedMove(move.kind, move.line, (move.start_x, move.start_z), (move.end_x, move.end_z), move.feed, move.arc, move.mode)


class Moves(Sequence[Move]):
    """A sequence of moves, which become objects only when they are read.

    The columns are ``kinds`` (indices into ``KINDS``), ``lines``, ``ends`` (start x, start z, end x and end z of each move [m]) and
    ``feeds``, below 0 for none; ``mode_numbers`` are indices into ``modes``.
    """

    def __init__(self, moves: Iterable[Move] = ()) -> None:
        self.kinds = array("B")
        self.lines = array("I")
        self.ends = array("d")
        self.feeds = array("d")
        self.mode_numbers = array("I")
        self.modes: list[MoveMode] = []
        self._known: dict[MoveMode, int] = {}
        self._arc_numbers = array("i")
        self._arc_values = array("d")
        self.extend(moves)

    def add(self, motion: PlannedMove) -> None:
        """Append a move in the making."""
        kind, line, start, end, feed, arc, mode, _ = motion
        self._arc_numbers.append(_NO_ARC if arc is None else len(self._arc_values))
        if arc is not None:
            self._arc_values.extend((arc.centre_x, arc.centre_z, arc.radius, arc.end_radius, arc.start_angle, arc.sweep))
        self.kinds.append(_NUMBER[kind])
        self.lines.append(line)
        self.ends.extend((*start, *end))
        self.feeds.append(_NO_FEED if feed is None else feed)
        number = self._known.get(mode)
        if number is None:
            number = self._known[mode] = len(self.modes)
            self.modes.append(mode)
        self.mode_numbers.append(number)

    def extend(self, moves: Iterable[Move]) -> None:
        """Append several moves."""
        for move in moves:
            self.add(planned(move))

    def replace_last(self, count: int, moves: Iterable[Move]) -> None:
        """Replace the last ``count`` moves by others."""
        for _ in range(count):
            self.kinds.pop()
            self.lines.pop()
            self.feeds.pop()
            self.mode_numbers.pop()
            self._arc_numbers.pop()
        del self.ends[-4 * count :]
        self.extend(moves)

    def __len__(self) -> int:
        return len(self.kinds)

    @overload
    def __getitem__(self, index: int) -> Move: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[Move, ...]: ...

    def __getitem__(self, index: int | slice) -> Move | tuple[Move, ...]:
        if isinstance(index, slice):
            return tuple([self[place] for place in range(*index.indices(len(self)))])
        place = index if index >= 0 else index + len(self)
        if not 0 <= place < len(self):
            raise IndexError(index)
        x, z, end_x, end_z = self.ends[4 * place : 4 * place + 4]
        feed, mode = self.feeds[place], self.modes[self.mode_numbers[place]]
        first = self._arc_numbers[place]
        arc = None if first == _NO_ARC else Arc(*self._arc_values[first : first + _ARC_VALUES])
        return Move(KINDS[self.kinds[place]], self.lines[place], x, z, end_x, end_z, mode, None if feed < 0.0 else feed, arc)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Sequence) and len(self) == len(other) and all(a == b for a, b in zip(self, other, strict=True))

    __hash__ = None  # type: ignore[assignment]

    @property
    def counts(self) -> dict[str, int]:
        """The number of moves of each kind."""
        return {KINDS[number]: count for number, count in Counter(self.kinds).items()}

    def where(self, wanted: Callable[[MoveKind, MoveMode, float], bool]) -> Iterator[Move]:
        """Yield the moves for which ``wanted(kind, mode, feed)`` is true; it is called once for each set of values. No feed is below 0."""
        known: dict[tuple[int, int, float], bool] = {}
        for place, key in enumerate(zip(self.kinds, self.mode_numbers, self.feeds, strict=True)):
            chosen = known.get(key)
            if chosen is None:
                chosen = known[key] = wanted(KINDS[key[0]], self.modes[key[1]], key[2])
            if chosen:
                yield self[place]

    def ways(self) -> Iterator[tuple[MoveKind, float]]:
        """Yield kind and length [m] of each move."""
        ends = self.ends
        for place, number in enumerate(self.kinds):
            first = self._arc_numbers[place]
            if first != _NO_ARC:
                yield KINDS[number], abs(self._arc_values[first + 5]) * self._arc_values[first + 2]
            else:
                k = 4 * place
                yield KINDS[number], math.hypot(ends[k + 2] - ends[k], ends[k + 3] - ends[k + 1])
