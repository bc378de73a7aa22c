"""Whether a dialect has the words of a program, and the sentence that says which dialect does.

A code that means different things in different dialects (G71: millimetres, or a roughing cycle) is never guessed at: a refusal names
both readings.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from lathesim.errors import ProgramError
from lathesim.program.dialects import DIALECTS, Dialect, not_interpreted
from lathesim.program.macros.statements import FANUC_KINDS
from lathesim.program.meanings import GROUP_OF, NOT_INTERPRETED, Group, Meaning
from lathesim.program.words import Block, Blocks, Word

_BUILDERS = ((10, 69), (80, 96), (100, 199))
"""M codes that builders of machines give to chucks, tailstocks, catchers and doors.

Source: Haas lathe operator's manual, list of M codes."""
_FOREIGN_AXES = "YABCV"
"""Axes that a two-axis lathe does not have, unless the dialect has the letter for something else."""


@dataclass(frozen=True)
class Sorted:
    """One block taken apart: its codes with their meanings, and its other words by letter. ``place`` is ``file:line``."""

    line: int
    place: str
    codes: dict[Meaning, Word]
    words: dict[str, Word]
    comments: tuple[str, ...]
    builders: tuple[Word, ...] = ()
    """M codes of the machine's builder, which do nothing here."""
    groups: dict[Group, Meaning] = field(default_factory=dict)

    def of_group(self, group: Group) -> Meaning | None:
        """The meaning of this group in the block, if there is one."""
        return self.groups.get(group)


def check_vocabulary(blocks: Blocks, dialect: Dialect) -> None:
    """Refuse the first word of the program that the dialect does not have, or that is not interpreted."""
    for block in (*blocks.blocks, *(block for blocks_of in blocks.subprograms.values() for block in blocks_of)):
        check_block(block, blocks, dialect)


def check_block(block: Block, blocks: Blocks, dialect: Dialect) -> None:
    """Refuse the first word of a block that the dialect does not have, or that is not interpreted; computed codes wait for their number."""
    if block.statement is not None or block.assignments or block.computed:
        _check_statement(block, blocks, dialect)
    codes, letters = dialect.codes, dialect.letters
    for word in block.words:
        if word.letter not in "GM":
            if word.letter not in letters:
                raise _foreign_letter(word, block, blocks, dialect, blocks.place(block.line))
            continue
        if word.value < 0.0:
            fact = f"{word.text} is negative; codes are not."
            raise ProgramError(fact, place=blocks.place(block.line), remedy=f"Write {word.letter}{-word.value:g}.")
        meaning = codes.get(word.code)
        if meaning is None:
            if word.value == word.value and not is_builders(word, dialect):
                raise _foreign_code(word, blocks, dialect, blocks.place(block.line))
        elif meaning in NOT_INTERPRETED and not_interpreted(meaning, dialect):
            raise _not_interpreted(word, meaning, blocks, dialect, blocks.place(block.line))


def is_builders(word: Word, dialect: Dialect) -> bool:
    """Return whether an M code that the dialect does not have may belong to the builder of the machine."""
    return (
        dialect.builder_codes
        and word.letter == "M"
        and any(first <= word.value <= last for first, last in _BUILDERS)
        and word.value % 1.0 == 0.0
    )


def _check_statement(block: Block, blocks: Blocks, dialect: Dialect) -> None:
    place, statement = blocks.place(block.line), block.statement
    if not dialect.variables:
        shown = next((word.text for word in block.words if word.expression is not None), "The statement" if statement else "The assignment")
        having = _quoted(_told([other.name for other in DIALECTS.values() if other.variables]))
        fact = f"{shown} computes with expressions or variables, and the dialect '{dialect.name}' has none; {having} have them."
        raise ProgramError(fact, place=place, remedy="Choose the dialect the program is written in, or write the numbers themselves.")
    if statement is not None and dialect.o_words == (statement.kind in FANUC_KINDS):
        having = _quoted(_told([other.name for other in DIALECTS.values() if other.variables and other.o_words != dialect.o_words]))
        raise ProgramError(
            f"{statement.kind} is written so in {having}, and not in the dialect '{dialect.name}'.",
            place=place,
            remedy="Choose the dialect the program is written in.",
        )


def sort_block(block: Block, dialect: Dialect, place: str) -> Sorted:
    """Take a block apart; a letter given twice and two codes of one modal group are refused."""
    codes: dict[Meaning, Word] = {}
    words: dict[str, Word] = {}
    builders: list[Word] = []
    groups: dict[Group, Meaning] = {}
    for word in block.words:
        if word.letter not in "GM":
            if word.letter in words:
                raise ProgramError(
                    f"The block has two {word.letter} words, {words[word.letter].text} and {word.text}.",
                    place=place,
                    remedy="Keep one of them.",
                )
            words[word.letter] = word
            continue
        found = dialect.codes.get(word.code)
        if found is None:
            builders.append(word)
            continue
        meaning = found
        group = GROUP_OF[meaning]
        groups.setdefault(group, meaning)
        for earlier, first in codes.items() if len(codes) >= len(groups) else ():
            if GROUP_OF[earlier] is group and not _may_stand_together(earlier, meaning, dialect):
                told = _apart(first, word, dialect)
                raise ProgramError(
                    f"{first.text} and {word.text} exclude each other ({group}){told}.",
                    place=place,
                    remedy="Keep one, or write two blocks.",
                )
        codes[meaning] = word
    if dialect.cancels_beside_motion and sum(GROUP_OF[meaning] is Group.MOTION for meaning in codes) > 1:
        codes.pop(Meaning.MOTION_OFF, None)
        groups[Group.MOTION] = next(meaning for meaning in codes if GROUP_OF[meaning] is Group.MOTION)
    for letter, axis in (dialect.incremental or {}).items():
        if letter in words and axis in words:
            raise ProgramError(
                f"{words[axis].text} and {words[letter].text} both move {axis}.",
                place=place,
                remedy="Keep the absolute or the incremental one.",
            )
    return Sorted(block.line, place, codes, words, block.comments, tuple(builders), groups)


def _apart(first: Word, second: Word, dialect: Dialect) -> str:
    """Return the other readings of two codes that exclude each other here and stand together in another dialect."""
    for other in DIALECTS.values():
        one, two = other.codes.get(first.code), other.codes.get(second.code)
        if one is not None and two is not None and GROUP_OF[one] is not GROUP_OF[two]:
            return "".join(f"; {word.text}: {told}" for word in (first, second) if (told := other_readings(word.code, dialect)))
    return ""


def _may_stand_together(first: Meaning, second: Meaning, dialect: Dialect) -> bool:
    if first is second:
        return False
    if dialect.cancels_beside_motion and Meaning.MOTION_OFF in (first, second):
        return True
    group = GROUP_OF[first]
    return group is Group.OTHER or (group is Group.COOLANT and Meaning.COOLANT_OFF not in (first, second))


def _quoted(names: list[str]) -> str:
    quoted = [f"'{name}'" for name in names]
    return quoted[0] if len(quoted) == 1 else f"{', '.join(quoted[:-1])} and {quoted[-1]}"


def _readings(code: str, leave_out: Dialect) -> list[tuple[Meaning, list[str]]]:
    """What a code means in the other dialects, dialects of one meaning together."""
    found: dict[Meaning, list[str]] = {}
    for other in DIALECTS.values():
        if other.name != leave_out.name and code in other.codes:
            found.setdefault(other.codes[code], []).append(other.name)
    return [(meaning, _told(names)) for meaning, names in found.items()]


def _told(names: list[str]) -> list[str]:
    """The names of dialects without rarer forms, where there are others."""
    return [name for name in names if not DIALECTS[name].variant_of] or names


def other_readings(code: str, dialect: Dialect) -> str:
    """``in the dialect 'paper' it means millimetres``, or nothing where all dialects agree."""
    differing = [(meaning, names) for meaning, names in _readings(code, dialect) if meaning is not dialect.codes[code]]
    return ", and ".join(f"in {_dialects(names)} it means {meaning}" for meaning, names in differing)


def _dialects(names: list[str]) -> str:
    return f"the dialect{'s' if len(names) > 1 else ''} {_quoted(names)}"


def _complete(blocks: Blocks, leave_out: Dialect, readable: bool) -> list[str]:
    """The other dialects that have every word of the program; with ``readable`` those in which every code is interpreted too."""
    words = [word for block in blocks.blocks for word in block.words]
    found = []
    for dialect in DIALECTS.values():
        known = all(word.code in dialect.codes if word.letter in "GM" else word.letter in dialect.letters for word in words)
        refused = known and any(word.letter in "GM" and not_interpreted(dialect.codes[word.code], dialect) for word in words)
        if dialect.name != leave_out.name and known and not (readable and refused):
            found.append(dialect.name)
    return found


def _choice(blocks: Blocks, dialect: Dialect, readable: bool = False) -> str:
    """Return ``the dialect the program is written in``, with those that have every word of the program and how one is chosen."""
    complete = _told(_complete(blocks, dialect, readable))
    if not complete:
        return "the dialect the program is written in."
    having = f"{_quoted(complete)} {'has' if len(complete) == 1 else 'have'} all its words"
    return f"the dialect the program is written in; {having}. A comment (dialect: {complete[0]}) at its head chooses one."


def _foreign_code(word: Word, blocks: Blocks, dialect: Dialect, place: str) -> ProgramError:
    readings = _readings(word.code, dialect)
    if not readings:
        return ProgramError(
            f"{word.text} is in no dialect known here ({', '.join(_told(list(DIALECTS)))}).",
            place=place,
            remedy="Look the code up and correct it.",
        )
    told = "; ".join(f"{_quoted(names)} {'has' if len(names) == 1 else 'have'} it ({meaning})" for meaning, names in readings)
    meanings = [meaning for meaning, _ in readings if meaning not in NOT_INTERPRETED]
    own = next((code for code, meaning in dialect.codes.items() if meaning in meanings), "")
    here = f"Write {own} for it here, or choose" if own else "Choose"
    return ProgramError(
        f"{word.text} is not in the dialect '{dialect.name}'; {told}.", place=place, remedy=f"{here} {_choice(blocks, dialect)}"
    )


def _not_interpreted(word: Word, meaning: Meaning, blocks: Blocks, dialect: Dialect, place: str) -> ProgramError:
    others = other_readings(word.code, dialect)
    fact = f"{word.text} means {meaning} in the dialect '{dialect.name}', and that is not interpreted here"
    if not others or not _complete(blocks, dialect, readable=True):
        fact = f"{fact}; {others}" if others else fact
        return ProgramError(f"{fact}.", place=place, remedy=NOT_INTERPRETED[meaning])
    remedy = f"{NOT_INTERPRETED[meaning][:-1]}, or choose {_choice(blocks, dialect, readable=True)}"
    return ProgramError(f"{fact}; {others}.", place=place, remedy=remedy)


def _foreign_letter(word: Word, block: Block, blocks: Blocks, dialect: Dialect, place: str) -> ProgramError:
    if word.letter in _FOREIGN_AXES:
        return ProgramError(f"{word.text} names an axis this lathe does not have.", place=place, remedy="It has X and Z.")
    having = _told([other.name for other in DIALECTS.values() if word.letter in other.letters])
    if not having:
        return ProgramError(
            f"{word.text} is in no dialect known here ({', '.join(_told(list(DIALECTS)))}).",
            place=place,
            remedy="Take the word out or correct it.",
        )
    carried: dict[str, list[str]] = {}
    for name in having:
        carried.setdefault(DIALECTS[name].letters[word.letter], []).append(name)
    told = ", ".join(f"{_quoted(names)} {'has' if len(names) == 1 else 'have'} it ({what})" for what, names in carried.items())
    fact = f"{word.text} is not in the dialect '{dialect.name}'; {told}."
    for code in [other for other in block.words if other.letter in "GM" and other.code in dialect.codes]:
        others = other_readings(code.code, dialect)
        if others:
            fact += f" {code.text} means {dialect.codes[code.code]} in the dialect '{dialect.name}'; {others}."
    return ProgramError(fact, place=place, remedy=f"Choose {_choice(blocks, dialect)}")
