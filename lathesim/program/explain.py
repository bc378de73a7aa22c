"""What each line of a part program does, in one plain sentence in the dialect in force."""

from __future__ import annotations

import math

from lathesim.program.dialects import Dialect, dialect_named
from lathesim.program.meanings import Meaning
from lathesim.program.moves import Event, Move, Program
from lathesim.program.words import Blocks

_MOST = 4
"""Moves of one line that are told one by one."""
_MOTION = {Meaning.RAPID, Meaning.LINE, Meaning.ARC_CLOCKWISE, Meaning.ARC_COUNTERCLOCKWISE, Meaning.DWELL}
"""Codes that the moves themselves tell."""


def explain(blocks: Blocks, program: Program) -> list[tuple[int, str]]:
    """Return physical line and sentence for each block: the codes in words, the moves with their ends, what happens between them."""
    dialect = dialect_named(program.dialect)
    moves: dict[int, list[Move]] = {}
    events: dict[int, list[Event]] = {}
    for move in program.moves:
        moves.setdefault(move.cycle_line or move.line, []).append(move)
    for event in program.events:
        events.setdefault(event.line, []).append(event)
    contours = {move.line for move in program.moves if move.cycle and move.line != move.cycle_line}
    found = []
    for block in blocks.blocks:
        words = [_code_words(word.code, dialect) for word in block.words if word.letter in "GM"]
        words = [word for word in words if word]
        words += _event_words(events.get(block.line, []))
        words += _move_words(moves.get(block.line, []))
        if not words and block.line in contours:
            words = ["part of the contour of a cycle"]
        if not words and block.comments:
            words = [f"a remark: {block.comments[0]}"]
        values = [f"{word.text} is {dialect.letters[word.letter]}" for word in block.words if word.letter in dialect.letters]
        sentence = "; ".join(dict.fromkeys(words)) or "; ".join(values) or "no motion"
        found.append((block.line, f"{sentence[0].upper()}{sentence[1:]}."))
    return found


def _code_words(code: str, dialect: Dialect) -> str:
    meaning = dialect.codes.get(code)
    return "" if meaning is None or meaning in _MOTION else f"{code}: {meaning}"


def _event_words(events: list[Event]) -> list[str]:
    return [f"tool {event.tool}" for event in events if event.kind == "tool"] + [
        f"message '{event.text}'" for event in events if event.kind == "message"
    ]


def _move_words(moves: list[Move]) -> list[str]:
    if len(moves) <= _MOST:
        return [move_sentence(move) for move in moves]
    kinds = {kind: sum(move.kind == kind for move in moves) for kind in ("rapid", "feed", "arc", "thread", "dwell")}
    counted = ", ".join(f"{count} {kind}" for kind, count in kinds.items() if count)
    return [f"{len(moves)} moves ({counted}), the last one to {_end(moves[-1])}"]


def move_sentence(move: Move) -> str:
    """Return one move in words: X as a radius, mm."""
    if move.kind == "dwell":
        return f"dwell of {move.seconds:g} s"
    if move.kind == "rapid":
        return f"rapid to {_end(move)}"
    if move.kind == "thread":
        return f"thread with a lead of {1e3 * (move.feed or 0.0):.4g} mm to {_end(move)}"
    feed = ""
    if move.feed is not None:
        feed = f" at {move.feed * 1e3:.4g} mm/rev" if move.per_revolution else f" at {move.feed * 6e4:.4g} mm/min"
    if move.arc is not None:
        turn = "clockwise" if move.arc.clockwise else "counterclockwise"
        return (
            f"{turn} arc of radius {move.arc.radius * 1e3:.4g} mm, {math.degrees(abs(move.arc.sweep)):.4g} degrees, to {_end(move)}{feed}"
        )
    return f"straight line to {_end(move)}{feed}"


def _end(move: Move) -> str:
    return f"X {move.end_x * 1e3:.6g} mm (radius), Z {move.end_z * 1e3:.6g} mm"
