"""Which dialect a program is written in: as its header says, else as its words tell; the reason is always said.

A header is a comment such as ``(dialect: fanuc)`` before the first word. Else the dialects that have, and carry out, every word of the
program are held against each other by words that only one of them uses so.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from lathesim.program.dialects import DIALECTS, Dialect, dialect_named, not_interpreted
from lathesim.program.words import Block, Blocks

_HEADER = re.compile(r"dialect\s*[:=]\s*([\w-]+)", re.IGNORECASE)
_FIRST_LINES = 20
"""Lines in which a header is looked for."""


@dataclass(frozen=True)
class Detected:
    """A dialect, and why it was taken, as half a sentence."""

    dialect: Dialect
    reason: str


def detect_dialect(blocks: Blocks) -> Detected:
    """Return the dialect of a program; raises :class:`ProgramError` where its header names one that there is not."""
    for block in blocks.blocks:
        if block.line > _FIRST_LINES:
            break
        for comment in block.comments:
            header = _HEADER.search(comment)
            if header is not None:
                return Detected(dialect_named(header[1].lower()), f"line {block.line} says so")
    fitting = [dialect for dialect in DIALECTS.values() if _has_all(blocks, dialect)]
    if len(fitting) == 1:
        return Detected(fitting[0], "no other dialect has all its words")
    signs = {dialect.name: _signs(blocks, dialect) for dialect in (fitting or DIALECTS.values())}
    best = max(signs.values(), default=0)
    names = [name for name, count in signs.items() if count == best]
    chosen = dialect_named(names[0])
    if best and len(names) == 1:
        return Detected(chosen, "its words are used as there")
    return Detected(chosen, f"nothing tells it from {' or '.join(names[1:])}" if names[1:] else "no dialect has all its words")


def _has_all(blocks: Blocks, dialect: Dialect) -> bool:
    if dialect.end_required and not blocks.ending:
        return False
    words = [word for block in blocks.blocks for word in block.words]
    return all(
        (word.code in dialect.codes and not not_interpreted(dialect.codes[word.code], dialect))
        if word.letter in "GM"
        else word.letter in dialect.letters
        for word in words
    )


def _signs(blocks: Blocks, dialect: Dialect) -> int:
    """Return how many blocks are written as only this dialect writes them."""
    return sum(_is_sign(block, dialect) for block in blocks.blocks)


def _is_sign(block: Block, dialect: Dialect) -> bool:
    codes = {word.code for word in block.words if word.letter in "GM"}
    letters = {word.letter: word for word in block.words}
    moves = "X" in letters or "Z" in letters or "U" in letters or "W" in letters
    if dialect.tool_changes_at_t:
        long_tool = "T" in letters and letters["T"].value >= 100
        cycle = bool(codes & {"G70", "G71", "G72", "G73", "G75"}) and bool(letters.keys() & {"P", "U", "R"})
        simple = bool(codes & {"G90", "G92", "G94"}) and moves and "F" in letters
        return long_tool or cycle or simple or bool(letters.keys() & {"U", "W"}) or bool(codes & {"G99", "M98"})
    if dialect.thread_drive_line:
        return bool(codes & {"G7", "G8", "G33", "G64"}) or ("G76" in codes and "J" in letters)
    return bool(codes & {"G70", "G71"}) and not letters.keys() & {"P", "U", "R", "Q"}
