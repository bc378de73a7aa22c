"""What each line of a part program does, in one plain sentence in the dialect in force."""

from __future__ import annotations

import itertools
import math
from array import array
from bisect import bisect_left, bisect_right
from collections.abc import Iterator

from lathesim.program.dialects import Dialect, dialect_named
from lathesim.program.meanings import Meaning
from lathesim.program.moves import Event, Move, Program
from lathesim.program.telling.block_sentences import cycle_words, speed_words, statement_words
from lathesim.program.words import Block, Blocks

_MOST = 4
"""Moves of one line that are listed within its sentence."""
_MOTION = {Meaning.RAPID, Meaning.LINE, Meaning.ARC_CLOCKWISE, Meaning.ARC_COUNTERCLOCKWISE, Meaning.DWELL, Meaning.THREAD}
"""Codes that the moves themselves tell."""
_SPEEDS = {Meaning.SURFACE_SPEED, Meaning.SPINDLE_SPEED, Meaning.SPINDLE_LIMIT}
"""Codes that are told together with their S word."""


def explain(blocks: Blocks, program: Program, *, every: bool = False) -> Iterator[tuple[int, str]]:
    """Yield physical line and sentence for each block: the codes in words, the moves with their ends, what happens between them.

    Many moves of one block are counted; with ``every`` each move has a line of its own after the sentence.
    """
    told = _Told(program, dialect_named(program.dialect), every)
    for block in itertools.chain(blocks.blocks, _further(blocks)):
        sentence = told.sentence(block)
        yield block.line, f"{sentence[0].upper()}{sentence[1:]}."


def _further(blocks: Blocks) -> list[Block]:
    """Return the blocks of subprograms behind the main program, each once, in the order of their lines."""
    main = {block.line for block in blocks.blocks}
    every = [block for group in (*blocks.subprograms.values(), *blocks.locals.values()) for block in group]
    return sorted({block.line: block for block in every if block.line not in main}.values(), key=lambda block: block.line)


class _Told:
    """Sentences about blocks; ``inch`` follows the units that the blocks choose."""

    def __init__(self, program: Program, dialect: Dialect, every: bool) -> None:
        self.dialect = dialect
        self.every = every
        self.inch = False
        self.moves = program.moves
        self.events: dict[int, list[Event]] = {}
        self.contours: dict[int, list[Move]] = {}
        lines = [
            self.moves.modes[number].cycle_line or line for line, number in zip(self.moves.lines, self.moves.mode_numbers, strict=True)
        ]
        self.places = array("I", sorted(range(len(lines)), key=lines.__getitem__))  # indices of the moves, in the order of their blocks
        self.lines = array("I", [lines[place] for place in self.places])
        cycles: dict[int, int] = {}  # line of a contour block -> line of the first cycle that ran it
        for move in self.moves.where(lambda kind, mode, feed: mode.cycle_line > 0):
            if move.line != move.cycle_line and cycles.setdefault(move.line, move.cycle_line) == move.cycle_line:
                self.contours.setdefault(move.line, []).append(move)
        walked: dict[int, list[Move]] = {}
        for move in program.contours:
            walked.setdefault(move.line, []).append(move)
        self.contours = {**walked, **self.contours}
        for event in program.events:
            self.events.setdefault(event.line, []).append(event)

    def sentence(self, block: Block) -> str:
        """Return the sentence about a block, without its capital letter and its stop."""
        meanings = {word.code: self.dialect.codes.get(word.code) for word in block.words if word.letter in "GM" and word.expression is None}
        self.inch = (self.inch or Meaning.INCH in meanings.values()) and Meaning.MILLIMETRE not in meanings.values()
        told = [self._code(code, meaning, block) for code, meaning in meanings.items()]
        told += speed_words(block, meanings, self.inch)
        told += statement_words(block)
        told += [f"tool {event.tool}" for event in self.events.get(block.line, []) if event.kind == "tool"]
        told += [f"message '{event.text}'" for event in self.events.get(block.line, []) if event.kind == "message"]
        told = list(dict.fromkeys(words for words in told if words))
        own = self.places[bisect_left(self.lines, block.line) : bisect_right(self.lines, block.line)]
        told += self._moves([self.moves[place] for place in own])
        if block.line in self.contours and not own:
            first, *rest = self._moves(self.contours[block.line])
            told += [f"part of the contour: {first}", *rest]
        if not told and not block.words and block.comments:
            told = [f"a remark: {block.comments[0]}"]
        values = [f"{word.text} is {self.dialect.letters[word.letter]}" for word in block.words if word.letter in self.dialect.letters]
        return "; ".join(told) or "; ".join(values) or "nothing is done"

    def _code(self, code: str, meaning: Meaning | None, block: Block) -> str:
        if meaning is None:
            return f"{code}: a code of the machine's builder, which does nothing here"
        if meaning in _MOTION or meaning in _SPEEDS:
            return ""
        words = cycle_words(meaning, block, self.dialect)
        return f"{code}: {meaning}{', ' if words else ''}{words}"

    def _moves(self, moves: list[Move]) -> list[str]:
        if len(moves) <= _MOST:
            return [move_sentence(move, self.dialect) for move in moves]
        kinds = {kind: sum(move.kind == kind for move in moves) for kind in ("rapid", "feed", "arc", "thread", "dwell")}
        counted = ", ".join(f"{count} {kind}" for kind, count in kinds.items() if count)
        words = f"{len(moves)} moves ({counted}), the last one to {_end(moves[-1], self.dialect)}"
        return ["".join([words, *(f"\n      {move_sentence(move, self.dialect)}" for move in moves)]) if self.every else words]


def move_sentence(move: Move, dialect: Dialect) -> str:
    """Return one move in words, in mm; X as the dialect counts it."""
    if move.kind == "dwell":
        return f"dwell of {move.seconds:g} s"
    if move.kind == "rapid":
        return f"rapid to {_end(move, dialect)}"
    if move.kind == "thread":
        back = "the spindle turns back, and on it " if move.spin_back else ""
        begun = f", begun {math.degrees(move.start_angle):.4g} degrees behind the index," if move.start_angle else ""
        return f"{back}thread with a lead of {1e3 * (move.feed or 0.0):.4g} mm{begun} to {_end(move, dialect)}"
    feed = ""
    if move.feed is not None:
        feed = f" at {move.feed * 1e3:.4g} mm/rev" if move.per_revolution else f" at {move.feed * 6e4:.4g} mm/min"
    if move.arc is not None:
        turn = "clockwise" if move.arc.clockwise else "counterclockwise"
        angle = math.degrees(abs(move.arc.sweep))
        return f"{turn} arc of radius {move.arc.radius * 1e3:.4g} mm, {angle:.4g} degrees, to {_end(move, dialect)}{feed}"
    return f"straight line to {_end(move, dialect)}{feed}"


def _end(move: Move, dialect: Dialect) -> str:
    if dialect.x_is_diameter:
        return f"X {move.end_x * 2e3:.6g} mm (diameter), Z {move.end_z * 1e3:.6g} mm"
    return f"X {move.end_x * 1e3:.6g} mm (radius), Z {move.end_z * 1e3:.6g} mm"
