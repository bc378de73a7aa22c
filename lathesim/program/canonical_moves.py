"""A program as canonical moves: in JSON, and as plain LinuxCNC blocks that read back to the same moves.

A program as canonical moves in JSON, schema ``lathe-canon/1``: millimetres, X as a radius, what every interpreter can be held against.

Feeds are mm/min (``per_min``) or mm per revolution (``per_rev``), speeds rpm, or m/min in mode ``css``; dwells are in seconds.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from typing import Any

from lathesim.program.moves import Event, Move, Program, Spindle

SCHEMA = "lathe-canon/1"
UNITS = {"length": "mm", "x": "radius", "feed": "mm/min (per_min) or mm/rev (per_rev)", "speed": "rpm, or m/min when mode=css", "time": "s"}

_DIGITS = 9  # decimals written: 1e-9 mm is far below the noise of the arithmetic and keeps 0.1 + 0.2 readable
_RPM = 60.0 / (2.0 * math.pi)


def canon(program: Program) -> dict[str, Any]:
    """Return the program as the dictionary that ``lathesim program FILE --json`` prints."""
    return {**_frame(program), "moves": [_move(index, move) for index, move in enumerate(program.moves)]}


def canon_text(program: Program) -> Iterator[str]:
    """Yield the JSON text of :func:`canon` move by move, so that a long program needs no more memory than a short one."""
    head, moves, tail = json.dumps(_frame(program), indent=1, ensure_ascii=False).partition('\n "moves": []')
    between = moves[:-1]
    yield head
    for index, move in enumerate(program.moves):
        yield f"{between}\n  " + json.dumps(_move(index, move), indent=1, ensure_ascii=False).replace("\n", "\n  ")
        between = ","
    yield f"\n ]{tail}" if len(program.moves) else f"{moves}{tail}"


def _frame(program: Program) -> dict[str, Any]:
    """Return the JSON object of a program without its moves."""
    summary = program.summary
    return {
        "schema": SCHEMA,
        "program": program.name,
        "dialect": program.dialect,
        "assumed": dict(program.assumed),
        "units": UNITS,
        "summary": {
            "counts": dict(summary.counts),
            "cut_path_mm": _mm(summary.cut_path),
            "rapid_path_mm": _mm(summary.rapid_path),
            "final": [_mm(summary.final_x), _mm(summary.final_z)],
        },
        "moves": [],
        "events": [_event(event) for event in program.events],
        "warnings": [{"line": warned.line, "text": warned.sentence} for warned in program.warnings],
    }


def _rounded(value: float) -> float:
    return round(value, _DIGITS) + 0.0  # + 0.0 turns -0.0 into 0.0


def _mm(value: float) -> float:
    return _rounded(1e3 * value)


def _direction(direction: int) -> str:
    return {1: "cw", -1: "ccw"}.get(direction, "off")


def _spindle(spindle: Spindle) -> dict[str, Any]:
    return {
        "dir": _direction(spindle.direction),
        "mode": "css" if spindle.surface else "rpm",
        "speed": _rounded(spindle.speed * (60.0 if spindle.surface else _RPM)),
        "max_rpm": None if spindle.limit is None else _rounded(spindle.limit * _RPM),
    }


def _move(index: int, move: Move) -> dict[str, Any]:
    item: dict[str, Any] = {
        "i": index,
        "line": move.line,
        "type": move.kind,
        "from": [_mm(move.start_x), _mm(move.start_z)],
        "x": _mm(move.end_x),
        "z": _mm(move.end_z),
    }
    if move.kind == "thread":
        item["lead"] = _mm(move.feed or 0.0)
        if move.mode.start_angle:
            item["start_angle_deg"] = _rounded(math.degrees(move.mode.start_angle))
        if move.mode.spin_back:
            item["spindle_reverses"] = True
    elif move.feed is not None:
        item["feed"] = _rounded(move.feed * (1e3 if move.mode.per_revolution else 6e4))
        item["feed_mode"] = "per_rev" if move.mode.per_revolution else "per_min"
    if move.kind == "dwell":
        item["seconds"] = _rounded(move.mode.seconds)
    if move.arc is not None:
        item["arc"] = {
            "dir": "cw" if move.arc.clockwise else "ccw",
            "cx": _mm(move.arc.centre_x),
            "cz": _mm(move.arc.centre_z),
            "r": _mm(move.arc.radius),
            "r_end": _mm(move.arc.end_radius),
            "sweep_deg": _rounded(math.degrees(move.arc.sweep)),
        }
    item["spindle"] = _spindle(move.mode.spindle)
    item["tool"] = move.mode.tool
    if move.mode.cycle:
        item["cycle"], item["cycle_line"] = move.mode.cycle, move.mode.cycle_line
    return item


def _event(event: Event) -> dict[str, Any]:
    item: dict[str, Any] = {"type": event.kind, "line": event.line, "before_move": event.before_move}
    if event.kind == "spindle":
        item["dir"] = _direction(event.direction)
    if event.kind == "tool":
        item["tool"] = event.tool
    if event.kind == "message":
        item["text"] = event.text
    return item


_SAME = 1e-10


def linuxcnc_text(program: Program) -> str:
    """Return the moves of a program as text in the dialect ``linuxcnc``; cycles stand as the moves they expand to.

    Numbers have seven decimals of a millimetre. Left out: the comments, the lines the moves came from, and rapids without a length.
    """
    lines = ["(dialect: linuxcnc)", f"(moves of {in_comment(program.name)})", "G21 G18 G90 G91.1 G8 G40"]
    written = _WrittenMoves()
    events = sorted(program.events, key=lambda event: event.before_move)
    place = 0
    for index, move in enumerate(program.moves):
        while place < len(events) and events[place].before_move <= index:
            lines += written.event(events[place])
            place += 1
        if move.mode.spin_back or (move.kind == "rapid" and move.length < _SAME):
            continue
        lines += written.spindle(move.mode.spindle)
        following = program.moves[index + 1] if index + 1 < len(program.moves) else None
        lines += written.tap(move, following) if following is not None and following.mode.spin_back else written.move(move)
    for event in events[place:]:
        lines += written.event(event)
    if not lines[-1].startswith("M2"):
        lines.append("M2")
    return "\n".join(lines) + "\n"


class _WrittenMoves:
    """What stands in force in the text so far."""

    def __init__(self) -> None:
        self._spindle: Spindle | None = None
        self._per_revolution: bool | None = None
        self._feed: float | None = None

    def spindle(self, spindle: Spindle) -> list[str]:
        """Return the block that brings the spindle to what a move needs; none where it is so."""
        if spindle == self._spindle:
            return []
        self._spindle = spindle
        if spindle.direction == 0:
            return ["M5"]
        turn = "M3" if spindle.direction > 0 else "M4"
        if spindle.surface:
            limit = f" D{_number(spindle.limit * _RPM)}" if spindle.limit else ""
            return [f"G96 S{_number(spindle.speed * 60.0)}{limit} {turn}"]
        return [f"G97 S{_number(spindle.speed * _RPM)} {turn}"]

    def move(self, move: Move) -> list[str]:
        """Return the blocks of a move."""
        end = f"X{_number(1e3 * move.end_x)} Z{_number(1e3 * move.end_z)}"
        if move.kind == "dwell":
            return [f"G4 P{_number(move.mode.seconds)}"]
        if move.kind == "rapid":
            return [f"G0 {end}"]
        if move.kind == "thread":
            angle = f" D{_number(math.degrees(move.mode.start_angle))}" if move.mode.start_angle else ""
            return [f"G33 {end} K{_number(1e3 * (move.feed or 0.0))}{angle}"]
        lines = []
        if move.mode.per_revolution != self._per_revolution:
            self._per_revolution, self._feed = move.mode.per_revolution, None
            lines.append("G95" if move.mode.per_revolution else "G94")
        feed = ""
        if move.feed is not None and move.feed != self._feed:
            self._feed = move.feed
            feed = f" F{_number(move.feed * (1e3 if move.mode.per_revolution else 6e4))}"
        if move.arc is None:
            return [*lines, f"G1 {end}{feed}"]
        arc = move.arc
        centre = f"I{_number(1e3 * (arc.centre_x - move.start_x))} K{_number(1e3 * (arc.centre_z - move.start_z))}"
        return [*lines, f"{'G2' if arc.clockwise else 'G3'} {end} {centre}{feed}"]

    def tap(self, move: Move, back: Move) -> list[str]:
        """Return the block for both ways of a tapped hole."""
        faster = back.mode.spindle.speed / move.mode.spindle.speed
        factor = "" if math.isclose(faster, 1.0) else f" I{_number(faster)}"
        return [f"G33.1 X{_number(1e3 * move.end_x)} Z{_number(1e3 * move.end_z)} K{_number(1e3 * (move.feed or 0.0))}{factor}"]

    def event(self, event: Event) -> list[str]:
        """Return the block of an event; the spindle stands with the moves."""
        words = {
            "flood_on": "M8", "flood_off": "M9", "mist_on": "M7", "mist_off": "M9", "program_stop": "M0", "optional_program_stop": "M1",
            "program_end": "M2",
        }  # fmt: skip
        if event.kind == "tool":
            self._spindle = None  # LinuxCNC stops the spindle to change the tool
            return [f"T{event.tool} M6"] if event.tool else []
        if event.kind == "message":
            return [f"(MSG, {in_comment(event.text)})"]
        return [words[event.kind]] if event.kind in words else []


def _number(value: float) -> str:
    text = f"{value:.7f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def in_comment(text: str) -> str:
    """Return a text as it may stand in a comment of a program."""
    return text.replace("(", "[").replace(")", "]")
