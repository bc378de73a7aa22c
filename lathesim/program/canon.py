"""A program as canonical moves in JSON, schema ``lathe-canon/1``: millimetres, X as a radius, what every interpreter can be held against.

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
        if move.start_angle:
            item["start_angle_deg"] = _rounded(math.degrees(move.start_angle))
        if move.spin_back:
            item["spindle_reverses"] = True
    elif move.feed is not None:
        item["feed"] = _rounded(move.feed * (1e3 if move.per_revolution else 6e4))
        item["feed_mode"] = "per_rev" if move.per_revolution else "per_min"
    if move.kind == "dwell":
        item["seconds"] = _rounded(move.seconds)
    if move.arc is not None:
        item["arc"] = {
            "dir": "cw" if move.arc.clockwise else "ccw",
            "cx": _mm(move.arc.centre_x),
            "cz": _mm(move.arc.centre_z),
            "r": _mm(move.arc.radius),
            "r_end": _mm(move.arc.end_radius),
            "sweep_deg": _rounded(math.degrees(move.arc.sweep)),
        }
    item["spindle"] = _spindle(move.spindle)
    item["tool"] = move.tool
    if move.cycle:
        item["cycle"], item["cycle_line"] = move.cycle, move.cycle_line
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
