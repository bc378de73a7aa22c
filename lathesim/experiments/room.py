"""What a part program of a lesson may do, and its moves in the words of a dialect."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from lathesim import path_columns as at
from lathesim.component import Parameter
from lathesim.engine.assembly import Part
from lathesim.errors import LatheSimError
from lathesim.lessons.program_path import limits_of, path_of_program, start_of
from lathesim.lessons.simulate import Prepared
from lathesim.limit import Limit
from lathesim.program.canonical_moves import in_comment
from lathesim.program.dialects import DIALECTS

_CLEARANCE = 1e-3
"""How far from a stock a program in air stays [m]; assumed."""
_USUAL_FEED = 0.05
"""Largest feed [m/s] where neither the machine nor a program of the lesson tells one; assumed."""
SAME_NUMBER = Limit(1e-9, "m, m/s, rad/s", "places, feeds or speeds that differ by less are one", "derived", "programs have 1e-7 m")
_WRITTEN = Limit(5e-8, "m", "a move that goes no further is not written", "derived", "half of the last digit of a program")
_USUAL_STROKE = 0.02
"""Travel [m] where neither tells one; assumed."""
_AXES = {"X": ("x_reference", 0), "Z": ("z_reference", 1)}


@dataclass(frozen=True)
class FreeAxis:
    """A free axis: its word, where it begins, and its travel [m] (X is a radius)."""

    letter: str
    start: float
    low: float
    high: float

    @property
    def stroke(self) -> float:
        """The length of the travel [m]."""
        return self.high - self.low


@dataclass(frozen=True)
class Turning:
    """How a lesson's program may turn: the largest spindle speed [rad/s], feed [m a turn] and depth [m] of its own program.

    The stock has a ``radius``, and is cut from its ``face`` to ``face_end``, down to ``smallest_radius`` [m], where ``cuts`` says that the
    lesson's program does so.
    """

    speed: float
    cuts: bool = False
    feed: float = 0.0
    depth: float = 0.0
    radius: float = 0.0
    face: float = 0.0
    face_end: float = 0.0
    smallest_radius: float = 0.0


@dataclass(frozen=True)
class Room:
    """The limits of a lesson's programs. ``idle`` is an axis that no part follows: its moves are rests of the others.

    ``acceleration`` [m/s^2] is infinite where the interpolator knows none; ``duration`` tells whether the lesson must say how long it runs.
    """

    interpolator: Part
    axes: tuple[FreeAxis, ...]
    idle: FreeAxis | None
    feed: float
    acceleration: float
    dialect: str
    needs_duration: bool
    turning: Turning | None = None

    @property
    def dwells(self) -> bool:
        """Whether the dialect has a word for a rest."""
        return DIALECTS[self.dialect].roles.dwell is not None

    def time(self, way: float, speed: float) -> float:
        """Return how long a block takes [s]."""
        if way <= 0.0:
            return 0.0
        if math.isinf(self.acceleration):
            return way / speed
        peak = min(speed, math.sqrt(way * self.acceleration))
        return way / peak + peak / self.acceleration


def room_of(prepared: Prepared) -> Room:
    """Return what a part program of the lesson may do.

    Limits are those of the machine's travel; where it has none, the programs of the lesson say how far and how fast it goes. A machine
    with a stock is moved beside it, in air. Raises :class:`LatheSimError` where no part program moves the machine.
    """
    lesson = prepared.case.lesson
    walking = [part for part in prepared.machinery.parts if "path" in part.tables]
    followed = {wire.source for wire in prepared.machinery.wires}
    letters = [letter for letter, (output, _) in _AXES.items() if any(f"{part.name}.{output}" in followed for part in walking)]
    if not letters:
        fact = "no part program moves this machine: nothing follows the reference of an interpolator."
        remedy = "Add an interpolator in the lesson's 'add:' and wire a controller's reference to it."
        raise LatheSimError(fact, place=str(lesson.path), remedy=remedy)
    interpolator = walking[0]
    spans, feed = _of_programs(prepared)
    limits = limits_of(lesson.machine)
    given = start_of(lesson.machine) or DIALECTS[lesson.settings.dialect].start.place
    bounds = {"X": (limits.x_low, limits.x_high), "Z": (limits.z_low, limits.z_high)}
    axes = []
    for letter in ("X", "Z"):
        low, high = (limit if math.isfinite(limit) else span for limit, span in zip(bounds[letter], spans[_AXES[letter][1]], strict=True))
        if letter == "X":
            stock = _of_stock(prepared, "stock_radius")
            low = max(low, stock + _CLEARANCE) if stock else low
            high = max(high, low + (_USUAL_STROKE if stock and not math.isfinite(bounds["X"][1]) else 0.0))
        if high - low < SAME_NUMBER and letter in letters:
            fact = f"the {letter} axis has no travel: the machine gives no limits and the lesson's program does not move it."
            raise LatheSimError(fact, place=str(lesson.path), remedy="Write 'travel:' in the machine template.")
        axes.append(FreeAxis(letter, given[_AXES[letter][1]], low, high if high - low > SAME_NUMBER else low + _USUAL_STROKE))
    return Room(
        interpolator,
        tuple(axis for axis in axes if axis.letter in letters),
        next((axis for axis in axes if axis.letter not in letters), None),
        limits.feed if math.isfinite(limits.feed) else feed,
        _acceleration(interpolator),
        lesson.settings.dialect,
        not prepared.machinery.finish,
        _turning(prepared, interpolator, followed),
    )


def _turning(prepared: Prepared, interpolator: Part, followed: set[str]) -> Turning | None:
    """Return how a program may turn: within what the lesson's own one does. None where no spindle follows it, or it turns none."""
    case = prepared.case
    if case.program is None or f"{interpolator.name}.spindle_reference" not in followed:
        return None
    table = path_of_program(case.program, case.lesson.settings.dialect, start=start_of(case.lesson.machine)).table
    speed = float(np.abs(table[table[:, at.SPINDLE_MODE] == at.CONSTANT_SPEED, at.SPINDLE_SPEED]).max(initial=0.0))
    radius, face, length = (_of_stock(prepared, name) for name in ("stock_radius", "face", "stock_length"))
    inside = np.minimum(table[:, at.START_X], table[:, at.END_X]) < radius
    cutting = table[(table[:, at.KIND] == at.LINE_MOVE) & (table[:, at.FEED_MODE] == at.PER_REVOLUTION) & inside]
    cutting = cutting[cutting[:, at.END_Z] > face]
    if speed <= 0.0:
        return None
    if not len(cutting):
        return Turning(speed)
    smallest = float(cutting[:, at.END_X].min())
    end = min(face + length, float(cutting[:, at.END_Z].max()))
    return Turning(speed, True, float(cutting[:, at.FEED].max()), radius - smallest, radius, face, end, smallest)


def _of_stock(prepared: Prepared, name: str) -> float:
    """Return a size of the stock [m], 0 where there is none."""
    for part in prepared.machinery.parts:
        if "stock_radius" in part.component.declared(Parameter):
            return part.value(name)
    return 0.0


def _of_programs(prepared: Prepared) -> tuple[tuple[tuple[float, float], tuple[float, float]], float]:
    """Return the spans of X and Z [m] and the largest feed per minute [m/s] of the lesson's own program."""
    case = prepared.case
    if case.program is None:
        return ((0.0, _USUAL_STROKE), (0.0, _USUAL_STROKE)), _USUAL_FEED
    table = path_of_program(case.program, case.lesson.settings.dialect, start=start_of(case.lesson.machine)).table
    x, z = table[:, [at.START_X, at.END_X]], table[:, [at.START_Z, at.END_Z]]
    by_minute = table[(table[:, at.KIND] >= at.LINE_MOVE) & (table[:, at.FEED_MODE] == at.PER_MINUTE), at.FEED]
    fastest = float(by_minute.max()) if len(by_minute) and by_minute.max() > 0.0 else _USUAL_FEED
    return ((float(x.min()), float(x.max())), (float(z.min()), float(z.max()))), fastest


def _acceleration(interpolator: Part) -> float:
    return interpolator.value("acceleration") if "acceleration" in interpolator.component.declared(Parameter) else math.inf


_IDLE_WAY = 5e-3
"""How far an idle axis goes while the others rest [m]; assumed."""


@dataclass(frozen=True)
class DesignedMove:
    """One block: where it goes by axis [m], how fast [m/s]; with ``rest`` [s] it stands still instead.

    With ``radius`` [m] it is a quarter of a circle, clockwise or not. ``turn`` [rad/s] is the speed of the spindle, below 0 backwards, from
    this block on; with ``per_turn`` [m] the feed is one for each turn.
    """

    to: dict[str, float] = field(default_factory=dict)
    speed: float = 0.0
    rest: float = 0.0
    radius: float = 0.0
    clockwise: bool = True
    turn: float | None = None
    per_turn: float = 0.0


def program_text(title: Sequence[str], moves: Sequence[DesignedMove], room: Room) -> str:
    """Return the part program of moves, in millimetres and millimetres per minute, absolute, X as the dialect means it."""
    dialect = DIALECTS[room.dialect]
    lines = ["%"] if dialect.program.number else []
    lines += ["O0001"] if dialect.program.number else []
    lines += [f"({in_comment(line)})" for line in title]
    codes = {meaning.name: code for code, meaning in reversed(list(dialect.codes.items()))}
    head = ["PLANE_XZ", "ABSOLUTE", "PER_MINUTE", "MILLIMETRE", "X_RADIUS"]
    lines.append(" ".join(codes[name] for name in head if name in codes))
    place = {axis.letter: axis.start for axis in (*room.axes, *([room.idle] if room.idle else []))}
    standing: dict[str, float] = dict(place)
    last_feed, turning, per_turn = 0.0, 0.0, False
    for move in moves:
        if move.turn is not None and abs(move.turn - turning) > SAME_NUMBER:
            turning = move.turn
            way = codes["SPINDLE_FORWARD" if turning >= 0.0 else "SPINDLE_REVERSE"]
            lines.append(f"{codes['SPINDLE_SPEED']} S{_number(abs(turning) * 30.0 / math.pi)} {way}")
        if move.rest > 0.0:
            lines += _rest(move.rest, room, standing)
            if room.idle is not None and not room.dwells:
                last_feed = 0.0
            continue
        words = [f"{letter}{_number(1e3 * _shown(letter, value, dialect.start.x_is_diameter))}" for letter, value in move.to.items()]
        if not any(abs(standing[letter] - value) > _WRITTEN for letter, value in move.to.items()):
            continue
        standing |= move.to
        if bool(move.per_turn) != per_turn:
            per_turn, last_feed = bool(move.per_turn), 0.0
            lines.append(codes["PER_REVOLUTION" if per_turn else "PER_MINUTE"])
        code = "G1" if not move.radius else "G2" if move.clockwise else "G3"
        if move.radius:
            words.append(f"R{_number(1e3 * move.radius)}")
        feed = 1e3 * move.per_turn if per_turn else 6e4 * move.speed
        if abs(feed - last_feed) > SAME_NUMBER:
            words.append(f"F{_number(feed)}")
            last_feed = feed
        lines.append(" ".join([code, *words]))
    if turning:
        lines.append(codes["SPINDLE_OFF"])
    lines.append("M30")
    lines += ["%"] if dialect.program.number else []
    return "\n".join(lines) + "\n"


def _rest(seconds: float, room: Room, standing: dict[str, float]) -> list[str]:
    """Return the block of a rest: a dwell, or a move of an axis that nothing follows; none where there is neither."""
    dialect = DIALECTS[room.dialect]
    if dialect.roles.dwell:
        letter, unit = ("P", dialect.roles.dwell["P"]) if "P" in dialect.roles.dwell else next(iter(dialect.roles.dwell.items()))
        return [f"G4 {letter}{_number(seconds / unit)}"]
    if room.idle is None:
        return []
    way = round(min(_IDLE_WAY, room.feed * seconds), 7)
    target = room.idle.start if standing[room.idle.letter] != room.idle.start else room.idle.start + way
    standing[room.idle.letter] = target
    shown = _shown(room.idle.letter, target, dialect.start.x_is_diameter)
    return [f"G1 {room.idle.letter}{_number(1e3 * shown)} F{_number(6e4 * way / seconds)}"]


def _shown(letter: str, value: float, diameter: bool) -> float:
    return 2.0 * value if letter == "X" and diameter else value


def _number(value: float) -> str:
    text = f"{value:.4f}".rstrip("0").rstrip(".")
    return "0.0" if text in ("-0", "0", "") else text if "." in text else f"{text}.0"
