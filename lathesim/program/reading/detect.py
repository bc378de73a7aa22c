"""Which dialect a program is written in: as its header says, else as its words tell; the reason is always said.

A header is a comment such as ``(dialect: fanuc)`` before the first word. Else the dialects that have, and carry out, every word of the
program are held against each other by words that only one of them uses so.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from lathesim.errors import ProgramError
from lathesim.program.dialects import DIALECTS, Dialect, dialect_named, not_interpreted
from lathesim.program.macros.statements import FANUC_KINDS
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
                return Detected(_named(header[1].lower(), blocks.place(block.line)), f"line {block.line} says so")
    fitting = [dialect for dialect in DIALECTS.values() if _has_all(blocks, dialect)]
    names = {dialect.name for dialect in fitting}
    fitting = [dialect for dialect in fitting if not dialect.variant_of or (dialect.variant_of not in names and _signs(blocks, dialect))]
    if len(fitting) == 1:
        return Detected(fitting[0], "no other dialect has all its words")
    common = [dialect for dialect in DIALECTS.values() if not dialect.variant_of]
    signs = {dialect.name: _signs(blocks, dialect) for dialect in (fitting or common)}
    best = max(signs.values(), default=0)
    found = [name for name, count in signs.items() if count == best]
    chosen = dialect_named(found[0])
    if best and len(found) == 1:
        return Detected(chosen, "its words are used as there" if fitting else "most of its words are used as there")
    return Detected(chosen, f"nothing tells it from {' or '.join(found[1:])}" if fitting and found[1:] else "no dialect has all its words")


def _named(name: str, place: str) -> Dialect:
    try:
        return dialect_named(name)
    except ProgramError as error:
        raise ProgramError(error.fact, place=place, remedy=error.remedy) from error


def _has_all(blocks: Blocks, dialect: Dialect) -> bool:
    if dialect.end_required and not blocks.ending:
        return False
    for block in blocks.blocks:
        if block.statement is not None and (not dialect.variables or dialect.o_words == (block.statement.kind in FANUC_KINDS)):
            return False
        if (block.assignments or block.computed) and not dialect.variables:
            return False
        for word in block.words:
            if word.letter not in "GM":
                if word.letter not in dialect.letters:
                    return False
            elif word.expression is None and (word.code not in dialect.codes or not_interpreted(dialect.codes[word.code], dialect)):
                return False
    return True


def _signs(blocks: Blocks, dialect: Dialect) -> int:
    """Return how many blocks are written as only this dialect writes them."""
    return sum(_is_sign(block, dialect) for block in blocks.blocks)


def _is_sign(block: Block, dialect: Dialect) -> bool:
    if block.statement is not None:
        return dialect.variables and dialect.o_words != (block.statement.kind in FANUC_KINDS)
    codes = {word.code for word in block.words if word.letter in "GM" and word.expression is None}
    letters = {word.letter: word for word in block.words}
    if dialect.tool_changes_at_t:
        moves = not letters.keys().isdisjoint("XZUW")
        long_tool = "T" in letters and letters["T"].value >= 100
        cycle = bool(codes & {"G70", "G71", "G72", "G73", "G75"}) and bool(letters.keys() & {"P", "U", "R"})
        simple = bool(codes & {"G90", "G92", "G94"}) and moves and "F" in letters
        own = bool(letters.keys() & {"U", "W", "O"}) or bool(codes & {"G32", "G50", "G99", "G65", "M97", "M98"})
        return long_tool or cycle or simple or own
    if dialect.o_words:
        return bool(codes & {"G7", "G8", "G33", "G64", "G41.1", "G42.1"}) or (bool(codes & {"G76"}) and "J" in letters)
    return bool(codes & {"G70", "G71"}) and not letters.keys() & {"P", "U", "R", "Q"}
