"""Whether a dialect has the words of a program, and the sentence that says which dialect does.

A code that means different things in different dialects (G71: millimetres, or a roughing cycle) is never guessed at: a refusal names
both readings.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from lathesim.errors import Fault, listed
from lathesim.program.dialects import DIALECTS, Dialect, not_interpreted
from lathesim.program.meanings import CODES_ELSEWHERE, HOLES, NOT_INTERPRETED, SINUMERIK, Group, Meaning, foreign_program
from lathesim.program.words import Block, Blocks, Warned, Word

if TYPE_CHECKING:
    from lathesim.program.flow import Flow

_BUILDERS = ((10, 69), (80, 96), (100, 999))
"""M codes that builders of machines give to chucks, tailstocks, catchers and doors.

Source: Haas lathe operator's manual, list of M codes."""
_NAMES_A_PLACE = (Meaning.TURNING_CYCLE_SIMPLE, Meaning.THREADING_CYCLE_SIMPLE, Meaning.FACING_CYCLE_SIMPLE, Meaning.SHIFT)
"""Codes whose block names a place; without one, G90, G92 and G94 are codes of another dialect."""
AXES = "XZUW"
"""Letters of positions."""
_FOREIGN_AXES = "YABCV"
"""Axes that a two-axis lathe does not have, unless the dialect has the letter for something else."""


@dataclass(slots=True)
class Sorted:
    """One block taken apart: its codes with their meanings, and its other words by letter, of which steps have ``used`` some.

    ``builders`` are M codes of the machine's builder, which do nothing here; ``flow`` runs the program that the block stands in.
    """

    line: int
    codes: Mapping[Meaning, Word]
    words: dict[str, Word]
    comments: tuple[str, ...]
    builders: tuple[Word, ...]
    groups: Mapping[Group, Meaning]
    number: str
    flow: Flow
    used: set[str] = field(default_factory=set)

    def of_group(self, group: Group) -> Meaning | None:
        """Return the meaning of this group in the block, if there is one."""
        return self.groups.get(group)

    def has(self, meaning: Meaning) -> bool:
        """Return whether the block has a code of this meaning."""
        return meaning in self.codes

    def take(self, letter: str) -> Word | None:
        """Return the word of this letter, marked as used."""
        word = self.words.get(letter)
        if word is not None:
            self.used.add(letter)
        return word

    def takes(self, letters: Iterable[str]) -> dict[str, Word]:
        """Return the words of these letters that the block has, marked as used."""
        return {letter: word for letter in letters if (word := self.take(letter)) is not None}

    @property
    def moves_an_axis(self) -> bool:
        """Whether the block has a position that no step has used."""
        return any(letter in self.words and letter not in self.used for letter in AXES)

    def warn(self, sentence: str) -> None:
        """Note a warning once."""
        warnings = self.flow.warnings
        if all(warned.sentence != sentence for warned in warnings):
            warnings.append(Warned(self.line, sentence))

    def assume(self, what: str, value: str) -> None:
        """Note what the program leaves open, and how it is taken."""
        self.flow.assumed[what] = value


class Codes(NamedTuple):
    """The codes of a block by meaning and by group, and the codes of the machine builder."""

    codes: Mapping[Meaning, Word]
    groups: Mapping[Group, Meaning]
    builders: tuple[Word, ...]


def check_statements(blocks: Blocks, dialect: Dialect) -> None:
    """Raise :class:`Fault` for a statement that the dialect lacks, or a code of another control; words are checked when they run."""
    for block in blocks.shapes.values():
        if block.statement is not None:
            check_statement(block, dialect)
        for word in block.words:
            if word.letter == "G" and CODES_ELSEWHERE.get(word.code) == SINUMERIK and word.code not in dialect.codes:
                raise foreign_program(SINUMERIK, word.text, block.line)


def words_missing(blocks: Blocks, dialect: Dialect) -> int:
    """Return the number of block shapes that the dialect lacks, plus one each for a missing end, motion or plane."""
    missing = sum(not has_shape(block, dialect) for block in blocks.shapes.values())
    missing += dialect.program.end_required and not blocks.ending
    missing += dialect.cycles.drills_in_xy and drills(blocks, dialect) and Meaning.PLANE_XY not in _meanings(blocks, dialect)
    return missing + (dialect.start.motion is None and _moves_before_a_code(blocks, dialect))


def has_shape(block: Block, dialect: Dialect) -> bool:
    """Return whether a dialect has and carries out the words of a block."""
    if block.statement is not None and block.statement.kind not in dialect.program.statements:
        return False
    if (block.assignments or block.computed) and not dialect.program.variables:
        return False
    motions = 0
    for word in block.words:
        if word.letter not in "GM":
            if word.letter not in dialect.letters:
                return False
        elif word.expression is None:
            meaning = dialect.codes.get(word.code)
            if meaning is None or not_interpreted(meaning, dialect):
                return False
            if meaning in _NAMES_A_PLACE and not any(other.letter in "XZUW" for other in block.words):
                return False
            motions += meaning.group is Group.MOTION and not (dialect.cycles.cancels_beside_motion and meaning is Meaning.MOTION_OFF)
    return motions <= 1


def drills(blocks: Blocks, dialect: Dialect) -> bool:
    """Return whether a program has drilling cycles."""
    return not HOLES.isdisjoint(_meanings(blocks, dialect))


def _meanings(blocks: Blocks, dialect: Dialect) -> set[Meaning | None]:
    return {dialect.codes.get(word.code) for block in blocks.shapes.values() for word in block.words if word.letter == "G"}


def _moves_before_a_code(blocks: Blocks, dialect: Dialect) -> bool:
    """Return whether the first axis word of a program comes before any motion code."""
    for block in blocks.blocks:
        meanings = [dialect.codes.get(word.code) for word in block.words if word.letter in "GM"]
        if block.statement is not None or any(meaning is None or meaning.group in (Group.MOTION, Group.ONCE) for meaning in meanings):
            return False
        if any(word.letter in "XZ" for word in block.words):
            return True
    return False


def is_builders(word: Word, dialect: Dialect) -> bool:
    """Return whether an M code that the dialect does not have may belong to the builder of the machine."""
    return (
        dialect.program.builder_codes
        and word.letter == "M"
        and any(first <= word.value <= last for first, last in _BUILDERS)
        and word.value % 1.0 == 0.0
    )


def check_statement(block: Block, dialect: Dialect) -> None:
    """Raise :class:`Fault` for a statement, an expression or an assignment that the dialect lacks or writes otherwise."""
    statement = block.statement
    if not dialect.program.variables:
        shown = next((word.text for word in block.words if word.expression is not None), "The statement" if statement else "The assignment")
        having = _quoted(without_variants([other.name for other in DIALECTS.values() if other.program.variables]))
        fact = f"{shown} computes with expressions or variables, and the dialect '{dialect.name}' has none; {having} have them."
        raise Fault(fact, "Choose the dialect the program is written in, or write the numbers themselves.", block.line)
    if statement is not None and statement.kind not in dialect.program.statements:
        having = _quoted(without_variants([other.name for other in DIALECTS.values() if statement.kind in other.program.statements]))
        fact = f"{statement.kind} is written so in {having}, and not in the dialect '{dialect.name}'."
        raise Fault(fact, "Choose the dialect the program is written in.", block.line)


def sort_block(block: Block, flow: Flow) -> Sorted:
    """Return a block sorted by codes and letters.

    Raises :class:`Fault` for words that the dialect lacks or does not interpret, a repeated letter, and two codes of one modal group.
    """
    blocks, dialect, known = flow.blocks, flow.dialect, flow.known
    words: dict[str, Word] = {}
    own = []
    for word in block.words:
        letter = word.letter
        if letter in "GM":
            own.append(word)
        elif letter in words:
            raise Fault(f"The block has two {letter} words, {words[letter].text} and {word.text}.", "Keep one of them.")
        elif letter not in dialect.letters:
            _codes(tuple(own), blocks, dialect)  # a faulty code before it is reported first
            raise _foreign_letter(word, block, blocks, dialect)
        else:
            words[letter] = word
    key = tuple(own)
    found = known.get(key)
    if found is None:
        found = known[key] = _codes(key, blocks, dialect)
    for letter, axis in dialect.roles.incremental.items():
        if letter in words and axis in words:
            raise Fault(f"{words[axis].text} and {words[letter].text} both move {axis}.", "Keep the absolute or the incremental one.")
    return Sorted(block.line, found.codes, words, block.comments, found.builders, found.groups, block.number.lstrip("0"), flow)


def _codes(words: tuple[Word, ...], blocks: Blocks, dialect: Dialect) -> Codes:
    codes: dict[Meaning, Word] = {}
    builders: list[Word] = []
    groups: dict[Group, Meaning] = {}
    for word, meaning in [(word, _meaning(word, blocks, dialect)) for word in words]:
        if meaning is None:
            builders.append(word)
            continue
        group = meaning.group
        groups.setdefault(group, meaning)
        for earlier, first in codes.items():
            if earlier.group is group and not _may_stand_together(earlier, meaning, dialect):
                told = _apart(first, word, dialect)
                raise Fault(f"{first.text} and {word.text} exclude each other ({group}){told}.", "Keep one, or write two blocks.")
        codes[meaning] = word
    if dialect.cycles.cancels_beside_motion and sum(meaning.group is Group.MOTION for meaning in codes) > 1:
        codes.pop(Meaning.MOTION_OFF, None)
        groups[Group.MOTION] = next(meaning for meaning in codes if meaning.group is Group.MOTION)
    return Codes(codes, groups, tuple(builders))


def _meaning(word: Word, blocks: Blocks, dialect: Dialect) -> Meaning | None:
    """Return the meaning of a code, or None for a code of the machine builder. Raises :class:`Fault` for all others."""
    if word.value < 0.0:
        raise Fault(f"{word.text} is negative; codes are not.", f"Write {word.letter}{-word.value:g}.")
    meaning = dialect.codes.get(word.code)
    if meaning is None:
        if not is_builders(word, dialect):
            raise _foreign_code(word, blocks, dialect)
    elif not_interpreted(meaning, dialect):
        raise _not_interpreted(word, meaning, blocks, dialect)
    return meaning


def _apart(first: Word, second: Word, dialect: Dialect) -> str:
    """Return the other readings of two codes that exclude each other here and stand together in another dialect."""
    for other in DIALECTS.values():
        one, two = other.codes.get(first.code), other.codes.get(second.code)
        if one is not None and two is not None and one.group is not two.group:
            return "".join(f"; {word.text}: {told}" for word in (first, second) if (told := other_readings(word.code, dialect)))
    return ""


def _may_stand_together(first: Meaning, second: Meaning, dialect: Dialect) -> bool:
    if first is second:
        return False
    if dialect.cycles.cancels_beside_motion and Meaning.MOTION_OFF in (first, second):
        return True
    group = first.group
    return group is Group.OTHER or (group is Group.COOLANT and Meaning.COOLANT_OFF not in (first, second))


def _quoted(names: list[str]) -> str:
    return listed([f"'{name}'" for name in names])


def _readings(code: str, leave_out: Dialect) -> list[tuple[Meaning, list[str]]]:
    """What a code means in the other dialects, dialects of one meaning together."""
    found: dict[Meaning, list[str]] = {}
    for other in DIALECTS.values():
        if other.name != leave_out.name and code in other.codes:
            found.setdefault(other.codes[code], []).append(other.name)
    return [(meaning, without_variants(names)) for meaning, names in found.items()]


def without_variants(names: list[str]) -> list[str]:
    """Return the names of dialects without rarer forms, unless there are only these."""
    return [name for name in names if not DIALECTS[name].variant_of] or names


def other_readings(code: str, dialect: Dialect) -> str:
    """``in the dialect 'paper' it means millimetres``, or nothing where all dialects agree."""
    differing = [(meaning, names) for meaning, names in _readings(code, dialect) if meaning is not dialect.codes[code]]
    return ", and ".join(
        f"in the dialect{'s' if len(names) > 1 else ''} {_quoted(names)} it means {meaning}" for meaning, names in differing
    )


def _complete(blocks: Blocks, leave_out: Dialect) -> list[str]:
    """The other dialects that have and carry out every word of the program."""
    return [dialect.name for dialect in DIALECTS.values() if dialect.name != leave_out.name and not words_missing(blocks, dialect)]


def _choice(blocks: Blocks, dialect: Dialect) -> str:
    """Return ``the dialect the program is written in``, with those that have every word of the program and how one is chosen."""
    complete = without_variants(_complete(blocks, dialect))
    if not complete:
        return "the dialect the program is written in."
    having = f"{_quoted(complete)} {'has' if len(complete) == 1 else 'have'} all its words"
    first = complete[0]
    run = f"A run takes the one of its lesson: write dialect: {first} there."
    return f"the dialect the program is written in; {having}. A comment (dialect: {first}) at its head chooses one. {run}"


def _foreign_code(word: Word, blocks: Blocks, dialect: Dialect) -> Fault:
    readings = _readings(word.code, dialect)
    if not readings:
        return _code_elsewhere(word)
    told = "; ".join(f"{_quoted(names)} {'has' if len(names) == 1 else 'have'} it ({meaning})" for meaning, names in readings)
    meanings = [meaning for meaning, _ in readings if meaning not in NOT_INTERPRETED]
    own = next((code for code, meaning in dialect.codes.items() if meaning in meanings), "")
    here = f"Write {own} for it here, or choose" if own else "Choose"
    return Fault(f"{word.text} is not in the dialect '{dialect.name}'; {told}.", f"{here} {_choice(blocks, dialect)}")


def _code_elsewhere(word: Word) -> Fault:
    """Return the error for a code that no dialect has, with its meaning on other controls."""
    known = CODES_ELSEWHERE.get(word.code)
    if known is not None:
        return Fault(f"{word.text} is not supported here: {known}.", "Take it out, or write it in other codes.")
    return Fault(
        f"{word.text} is in no dialect known here ({', '.join(without_variants(list(DIALECTS)))}).", "Look the code up and correct it."
    )


def _not_interpreted(word: Word, meaning: Meaning, blocks: Blocks, dialect: Dialect) -> Fault:
    others = other_readings(word.code, dialect)
    fact = f"{word.text} means {meaning} in the dialect '{dialect.name}', and that is not interpreted here"
    if not others or not _complete(blocks, dialect):
        fact = f"{fact}; {others}" if others else fact
        return Fault(f"{fact}.", NOT_INTERPRETED[meaning])
    return Fault(f"{fact}; {others}.", f"{NOT_INTERPRETED[meaning][:-1]}, or choose {_choice(blocks, dialect)}")


def _foreign_letter(word: Word, block: Block, blocks: Blocks, dialect: Dialect) -> Fault:
    codes = [other for other in block.words if other.letter in "GM"]
    if nowhere := [code for code in codes if not any(code.code in other.codes for other in DIALECTS.values())]:
        return _code_elsewhere(nowhere[0])
    if word.letter in _FOREIGN_AXES:
        return Fault(f"{word.text} names an axis this lathe does not have.", "It has X and Z.")
    having = without_variants([other.name for other in DIALECTS.values() if word.letter in other.letters])
    if not having:
        return Fault(
            f"{word.text} is in no dialect known here ({', '.join(without_variants(list(DIALECTS)))}).", "Take the word out or correct it."
        )
    carried: dict[str, list[str]] = {}
    for name in having:
        carried.setdefault(DIALECTS[name].letters[word.letter], []).append(name)
    told = ", ".join(f"{_quoted(names)} {'has' if len(names) == 1 else 'have'} it ({what})" for what, names in carried.items())
    fact = f"{word.text} is not in the dialect '{dialect.name}'; {told}."
    for code in [other for other in codes if other.code in dialect.codes]:
        others = other_readings(code.code, dialect)
        if others:
            fact += f" {code.text} means {dialect.codes[code.code]} in the dialect '{dialect.name}'; {others}."
    return Fault(fact, f"Choose {_choice(blocks, dialect)}")
