"""What each line of a part program does, in one plain sentence in the dialect in force."""

from __future__ import annotations

import itertools
import math
from array import array
from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Mapping

from lathesim.program.dialects import Dialect, dialect_named
from lathesim.program.meanings import HOLES, Meaning
from lathesim.program.moves import Event, Move, Program
from lathesim.program.statements import Keyword, Statement
from lathesim.program.words import Block, Blocks, Word
from lathesim.units import in_unit

_FIRST = {
    Meaning.ROUGHING_CYCLE: {"U": "depth of cut {} (radius)", "R": "retract {}"},
    Meaning.FACING_CYCLE: {"W": "depth of cut {}", "R": "retract {}"},
    Meaning.REPEATING_CYCLE: {"U": "first pass {} away along X (radius)", "W": "{} away along Z", "R": "{} passes"},
    Meaning.FACE_GROOVING_CYCLE: {"R": "retract {}"},
    Meaning.GROOVING_CYCLE: {"R": "retract {}"},
    Meaning.THREADING_CYCLE: {"P": "{}", "Q": "smallest depth {}", "R": "finishing allowance {}"},
}
"""What the first of two blocks tells a cycle, by letter."""
_CONTOUR = {
    "P": "from N{}", "Q": "to N{}", "U": "{} left on the diameter", "W": "{} left along Z", "D": "depth of cut {}", "F": "feed {}",
}  # fmt: skip
_FULL = {
    Meaning.ROUGHING_CYCLE: _CONTOUR,
    Meaning.FACING_CYCLE: _CONTOUR,
    Meaning.REPEATING_CYCLE: _CONTOUR,
    Meaning.FINISHING_CYCLE: {"P": "from N{}", "Q": "to N{}"},
    Meaning.POCKETS_LATER: _CONTOUR,
    Meaning.POCKETS_ONLY: _CONTOUR,
    Meaning.FACE_POCKETS_LATER: _CONTOUR,
    Meaning.FACE_POCKETS_ONLY: _CONTOUR,
    Meaning.FACE_GROOVING_CYCLE: {"Q": "pecks of {}", "K": "pecks of {}", "P": "{} to the side", "I": "{} to the side"},
    Meaning.GROOVING_CYCLE: {"P": "pecks of {}", "I": "pecks of {}", "Q": "{} to the side", "K": "{} to the side"},
    Meaning.THREADING_CYCLE: {
        "P": "height {}", "K": "height {}", "Q": "first depth {}", "D": "first depth {}", "F": "lead {}", "R": "taper {}", "I": "taper {}",
    },
    **{meaning: {"R": "plane {}", "Q": "pecks of {}", "F": "feed {}", "L": "{} holes"} for meaning in HOLES},
    Meaning.RIGID_TAPPING: {"K": "lead {}", "I": "{} times as fast on the way out"},
    Meaning.THREADING_CYCLE_SIMPLE: {"F": "lead {}", "R": "taper {}"},
    Meaning.TURNING_CYCLE_SIMPLE: {"R": "taper {}"},
    Meaning.FACING_CYCLE_SIMPLE: {"R": "taper {}"},
}  # fmt: skip
_PROFILE = {
    "Q": "contour O{}", "D": "{} left on the contour", "I": "depth of cut {} (radius)", "R": "retract {}", "P": "{} passes",
    "E": "last pass at {} from the contour",
}  # fmt: skip
_DRIVE_LINE = {
    "P": "pitch {}", "I": "crest {} from the drive line (counted as X)", "J": "first depth {} (counted as X)",
    "K": "full depth {} (counted as X)", "R": "degression {}",
    "Q": "slide angle {} degrees", "H": "{} spring passes",
}  # fmt: skip
_STATEMENTS = {
    Keyword.SUB: "the subprogram {0} begins; it runs when it is called", Keyword.END_SUB: "the subprogram {0} ends",
    Keyword.CALL: "calls {0}{1}",
    Keyword.RETURN: "returns from {0}", Keyword.IF: "what follows is done only if{1} holds",
    Keyword.ELSE_IF: "else, only if{1} holds", Keyword.ELSE: "else",
    Keyword.END_IF: "the end of the condition {0}", Keyword.DO: "the loop {0} begins", Keyword.WHILE: "as long as{1} holds, loop {0}",
    Keyword.END_WHILE: "the end of the loop {0}", Keyword.REPEAT: "repeat {0}{1} times", Keyword.END_REPEAT: "the end of the loop {0}",
    Keyword.BREAK: "leaves the loop {0}", Keyword.CONTINUE: "goes on with the next round of {0}", Keyword.GO_TO: "goes to N{1}",
    Keyword.IF_THEN: "", Keyword.LOOP: "the loop {0} begins", Keyword.LOOP_END: "the end of the loop {0}",
}  # fmt: skip


def speed_words(block: Block, meanings: Mapping[str, Meaning | None], inch: bool) -> list[str]:
    """Return what S says with G50, G96 or G97, with its unit."""
    s = next((word for word in block.words if word.letter == "S"), None)
    present = {meaning: code for code, meaning in meanings.items()}
    number = None if s is None else s.text[1:]
    if Meaning.SPINDLE_LIMIT in present:
        code = present[Meaning.SPINDLE_LIMIT]
        return [f"{code}: the spindle turns at most at {number} rpm" if number else f"{code}: the position gets other coordinates"]
    if Meaning.SURFACE_SPEED in present:
        limit = next((f", at most {word.text[1:]} rpm" for word in block.words if word.letter == "D"), "")
        return [f"{present[Meaning.SURFACE_SPEED]}: constant surface speed of {number} {'feet' if inch else 'm'}/min{limit}"]
    if Meaning.SPINDLE_SPEED in present:
        return [f"{present[Meaning.SPINDLE_SPEED]}: constant spindle speed{f' of {number} rpm' if number else ''}"]
    return [f"speed {number}"] if number else []


def cycle_words(meaning: Meaning, block: Block, dialect: Dialect) -> str:
    """Return what the words of a block tell a cycle; lengths in the unit of the program."""
    letters = {word.letter for word in block.words}
    if dialect.cycles.contour_in_subprogram and meaning is Meaning.FINISHING_CYCLE:
        table = _PROFILE
    elif dialect.cycles.contour_in_subprogram:
        table = (
            _DRIVE_LINE if meaning is Meaning.THREADING_CYCLE else _PROFILE if _FULL.get(meaning) is _CONTOUR else _FULL.get(meaning, {})
        )
    elif meaning in _FIRST and not letters & ({"P", "Q"} if meaning in _CONTOURED else {"X", "Z", "U", "W"}):
        table = _FIRST[meaning]
    else:
        table = _FULL.get(meaning, {})
    steps = meaning not in _CONTOURED and dialect.cycles.whole_numbers_are_steps
    told = [table[word.letter].format(_number(word, steps=steps)) for word in block.words if word.letter in table]
    if meaning is Meaning.THREADING_CYCLE and table is _FIRST[meaning]:
        own = [word for word in block.words if word.letter in table]
        told = [_passes(word.value) if word.letter == "P" else words for word, words in zip(own, told, strict=True)]
    return ", ".join(told)


def _number(word: Word, *, steps: bool) -> str:
    """Return the number of a word; without a decimal point P, Q, D, K and I of some cycles count in the least steps of the control."""
    text = word.text[1:]
    in_steps = steps and word.letter in "PQDKI" and "." not in text and word.expression is None and word.value >= _STEPS_FROM
    return f"{text} least steps" if in_steps else text.rstrip(".")


def _passes(value: float) -> str:
    """Return P of the first block of Fanuc's G76 in words: finishing passes, run-out in tenths of a lead, angle."""
    digits = int(value) if value == value else 0
    count, run_out, angle = digits // 10000, digits // 100 % 100, digits % 100
    return f"{count} finishing pass{'es' if count != 1 else ''}, run-out over {0.1 * run_out:g} leads, angle of {angle} degrees"


_CONTOURED = (Meaning.ROUGHING_CYCLE, Meaning.FACING_CYCLE, Meaning.REPEATING_CYCLE, Meaning.FINISHING_CYCLE)


def statement_words(block: Block) -> list[str]:
    """Return what the statement and the assignments of a block do."""
    found = [] if block.statement is None else [_statement(block.statement)]
    for assignment in block.assignments if block.statement is None else block.statement.assignments:
        name = f"#<{assignment.name.lower()}>" if assignment.number is None else f"#{assignment.number.text}"
        found.append(f"{name} becomes {assignment.value.text}")
    return found


def _statement(statement: Statement) -> str:
    values = "".join(f" {value.text}" for value in statement.values)
    if statement.kind is Keyword.GO_TO:
        return f"{f'if {statement.condition.text} holds, ' if statement.condition else ''}goes to N{values.strip()}"
    if statement.kind is Keyword.IF_THEN and statement.condition is not None:
        return f"if {statement.condition.text} holds"
    if statement.kind is Keyword.LOOP and statement.condition is not None:
        return f"as long as {statement.condition.text} holds, loop {statement.label}"
    with_values = f" with{values}" if statement.kind is Keyword.CALL and values else values
    return _STATEMENTS[statement.kind].format(f"O{statement.label.lower()}", with_values)


_STEPS_FROM = 10.0
"""A number without a decimal point counts in least steps from here on; a smaller one is rather a count."""
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
            if move.line != move.mode.cycle_line and cycles.setdefault(move.line, move.mode.cycle_line) == move.mode.cycle_line:
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
        return f"dwell of {move.mode.seconds:g} s"
    if move.kind == "rapid":
        return f"rapid to {_end(move, dialect)}"
    if move.kind == "thread":
        back = "the spindle turns back, and on it " if move.mode.spin_back else ""
        begun = f", begun {math.degrees(move.mode.start_angle):.4g} degrees behind the index," if move.mode.start_angle else ""
        return f"{back}thread with a lead of {in_unit(move.feed or 0.0, 'mm')}{begun} to {_end(move, dialect)}"
    feed = ""
    if move.feed is not None:
        feed = f" at {move.feed * 1e3:.4g} mm/rev" if move.mode.per_revolution else f" at {move.feed * 6e4:.4g} mm/min"
    if move.arc is not None:
        turn = "clockwise" if move.arc.clockwise else "counterclockwise"
        angle = math.degrees(abs(move.arc.sweep))
        return f"{turn} arc of radius {in_unit(move.arc.radius, 'mm')}, {angle:.4g} degrees, to {_end(move, dialect)}{feed}"
    return f"straight line to {_end(move, dialect)}{feed}"


def _end(move: Move, dialect: Dialect) -> str:
    if dialect.start.x_is_diameter:
        return f"X {move.end_x * 2e3:.6g} mm (diameter), Z {in_unit(move.end_z, 'mm', '.6g')}"
    return f"X {in_unit(move.end_x, 'mm', '.6g')} (radius), Z {in_unit(move.end_z, 'mm', '.6g')}"
