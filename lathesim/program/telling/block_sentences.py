"""Words of a block in plain language: speeds with their units, what cycles are told, statements and assignments."""

from __future__ import annotations

from collections.abc import Mapping

from lathesim.program.dialects import Dialect
from lathesim.program.macros.statements import Kind, Statement
from lathesim.program.meanings import HOLES, Meaning
from lathesim.program.words import Block, Word

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
    Kind.SUB: "the subprogram {0} begins; it runs when it is called", Kind.END_SUB: "the subprogram {0} ends", Kind.CALL: "calls {0}{1}",
    Kind.RETURN: "returns from {0}", Kind.IF: "what follows is done only if{1} holds",
    Kind.ELSE_IF: "else, only if{1} holds", Kind.ELSE: "else",
    Kind.END_IF: "the end of the condition {0}", Kind.DO: "the loop {0} begins", Kind.WHILE: "as long as{1} holds, loop {0}",
    Kind.END_WHILE: "the end of the loop {0}", Kind.REPEAT: "repeat {0}{1} times", Kind.END_REPEAT: "the end of the loop {0}",
    Kind.BREAK: "leaves the loop {0}", Kind.CONTINUE: "goes on with the next round of {0}", Kind.GO_TO: "goes to N{1}",
    Kind.IF_THEN: "", Kind.LOOP: "the loop {0} begins", Kind.LOOP_END: "the end of the loop {0}",
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
    if dialect.o_words and meaning is Meaning.FINISHING_CYCLE:
        table = _PROFILE
    elif dialect.o_words:
        table = (
            _DRIVE_LINE if meaning is Meaning.THREADING_CYCLE else _PROFILE if _FULL.get(meaning) is _CONTOUR else _FULL.get(meaning, {})
        )
    elif meaning in _FIRST and not letters & ({"P", "Q"} if meaning in _CONTOURED else {"X", "Z", "U", "W"}):
        table = _FIRST[meaning]
    else:
        table = _FULL.get(meaning, {})
    steps = meaning not in _CONTOURED and not dialect.o_words
    told = [table[word.letter].format(_number(word, steps=steps)) for word in block.words if word.letter in table]
    if meaning is Meaning.THREADING_CYCLE and table is _FIRST[meaning]:
        told = [_passes(word.value) if word.letter == "P" else words for word, words in zip(_of(block, table), told, strict=True)]
    return ", ".join(told)


def _of(block: Block, table: Mapping[str, str]) -> list[Word]:
    return [word for word in block.words if word.letter in table]


def _number(word: Word, *, steps: bool) -> str:
    """Return the number of a word; without a decimal point P, Q, D, K and I of some cycles count in the least steps of the control."""
    text = word.text[1:]
    in_steps = steps and word.letter in "PQDKI" and "." not in text and word.expression is None and word.value >= 10.0
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
    assignments = block.assignments if block.statement is None else block.statement.assignments
    for assignment in assignments:
        name = f"#<{assignment.name.lower()}>" if assignment.number is None else f"#{assignment.number.text}"
        found.append(f"{name} becomes {assignment.value.text}")
    return found


def _statement(statement: Statement) -> str:
    values = "".join(f" {value.text}" for value in statement.values)
    if statement.kind is Kind.GO_TO:
        return f"{f'if {statement.condition.text} holds, ' if statement.condition else ''}goes to N{values.strip()}"
    if statement.kind is Kind.IF_THEN and statement.condition is not None:
        return f"if {statement.condition.text} holds"
    if statement.kind is Kind.LOOP and statement.condition is not None:
        return f"as long as {statement.condition.text} holds, loop {statement.label}"
    with_values = f" with{values}" if statement.kind is Kind.CALL and values else values
    return _STATEMENTS[statement.kind].format(f"O{statement.label.lower()}", with_values)
