"""Moves of a designed program as a part program in the words of a dialect."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from lathesim.experiments.design.room import Room
from lathesim.program.dialects import DIALECTS

_IDLE_WAY = 5e-3
"""How far an idle axis goes while the others rest [m]; assumed."""


@dataclass(frozen=True)
class Move:
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


def program_text(title: Sequence[str], moves: Sequence[Move], room: Room) -> str:
    """Return the part program of moves, in millimetres and millimetres per minute, absolute, X as the dialect means it."""
    dialect = DIALECTS[room.dialect]
    lines = ["%"] if dialect.program_number else []
    lines += ["O0001"] if dialect.program_number else []
    lines += [f"({_plain(line)})" for line in title]
    codes = {meaning.name: code for code, meaning in reversed(list(dialect.codes.items()))}
    head = ["PLANE_XZ", "ABSOLUTE", "PER_MINUTE", "MILLIMETRE", "X_RADIUS"]
    lines.append(" ".join(codes[name] for name in head if name in codes))
    place = {axis.letter: axis.start for axis in (*room.axes, *([room.idle] if room.idle else []))}
    standing: dict[str, float] = dict(place)
    last_feed, turning, per_turn = 0.0, 0.0, False
    for move in moves:
        if move.turn is not None and abs(move.turn - turning) > 1e-9:
            turning = move.turn
            lines.append(f"{codes['SPINDLE_SPEED']} S{_number(abs(turning) * 30.0 / math.pi)} {_way_to_turn(turning, codes)}")
        if move.rest > 0.0:
            lines += _rest(move.rest, room, standing)
            if room.idle is not None and not room.dwells:
                last_feed = 0.0
            continue
        words = [f"{letter}{_number(1e3 * _shown(letter, value, dialect.x_is_diameter))}" for letter, value in move.to.items()]
        if not any(abs(standing[letter] - value) > 5e-8 for letter, value in move.to.items()):
            continue
        standing |= move.to
        if bool(move.per_turn) != per_turn:
            per_turn, last_feed = bool(move.per_turn), 0.0
            lines.append(codes["PER_REVOLUTION" if per_turn else "PER_MINUTE"])
        code = "G1" if not move.radius else "G2" if move.clockwise else "G3"
        if move.radius:
            words.append(f"R{_number(1e3 * move.radius)}")
        feed = 1e3 * move.per_turn if per_turn else 6e4 * move.speed
        if abs(feed - last_feed) > 1e-9:
            words.append(f"F{_number(feed)}")
            last_feed = feed
        lines.append(" ".join([code, *words]))
    if turning:
        lines.append(codes["SPINDLE_OFF"])
    lines.append("M30")
    lines += ["%"] if dialect.program_number else []
    return "\n".join(lines) + "\n"


def _way_to_turn(turning: float, codes: Mapping[str, str]) -> str:
    return codes["SPINDLE_FORWARD" if turning >= 0.0 else "SPINDLE_REVERSE"]


def _rest(seconds: float, room: Room, standing: dict[str, float]) -> list[str]:
    """Return the block of a rest: a dwell, or a move of an axis that nothing follows; none where there is neither."""
    dialect = DIALECTS[room.dialect]
    if dialect.dwell:
        letter, unit = ("P", dialect.dwell["P"]) if "P" in dialect.dwell else next(iter(dialect.dwell.items()))
        return [f"G4 {letter}{_number(seconds / unit)}"]
    if room.idle is None:
        return []
    way = round(min(_IDLE_WAY, room.feed * seconds), 7)
    target = room.idle.start if standing[room.idle.letter] != room.idle.start else room.idle.start + way
    standing[room.idle.letter] = target
    shown = _shown(room.idle.letter, target, dialect.x_is_diameter)
    return [f"G1 {room.idle.letter}{_number(1e3 * shown)} F{_number(6e4 * way / seconds)}"]


def _shown(letter: str, value: float, diameter: bool) -> float:
    return 2.0 * value if letter == "X" and diameter else value


def _number(value: float) -> str:
    text = f"{value:.4f}".rstrip("0").rstrip(".")
    return "0.0" if text in ("-0", "0", "") else text if "." in text else f"{text}.0"


def _plain(text: str) -> str:
    return text.replace("(", "[").replace(")", "]")
