"""Text of a part program to blocks of words, each with its physical line: the lexical part, the same for every dialect.

A word is a letter and a number (``X12.5``); a block is one line. Lower case, blanks inside words and numbers, tabs, comments in
parentheses or behind ``;``, block delete ``/``, ``%`` lines, N numbers, CRLF and a byte order mark are read. What a word *means* is
decided later (dialects, interpreter). Reading ends at the second ``%`` or behind a block with M2 or M30.

Source: EIA RS-274-D; NIST RS274NGC Interpreter version 3 (Kramer, Proctor, Messina 2000), section 3 (format of a line).
Expressions, variables and the statements that choose the next block are parsed here and evaluated when their block runs (``macros``).
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from lathesim.errors import ProgramError, SeveralFaultsError, nearest
from lathesim.program.macros.expressions import Assignment, Expression, ExpressionError, begins_value, parse_assignment, parse_value
from lathesim.program.macros.statements import Kind, Statement, opens, statement_at
from lathesim.program.reading.foreign_controls import foreign_control
from lathesim.program.reading.word_faults import no_number, no_word

LINE_LIMIT = 256  # characters of code in one line. Source: NIST RS274NGC version 3, section 3.3
DIGIT_LIMIT = 9  # digits before the decimal point, assumed: a larger number is a slip, and its square must stay finite

MOST_LOCALS = 500  # N numbers behind the end that may be called, assumed: programs have a handful
MOST_FAULTS = 20  # lines at fault that are told, assumed: whoever wrote more has to look at the file anyway

_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)")
_SIMPLE = re.compile(
    r"[ \t]*(?:[Nn]([0-9]{1,9}(?:\.[0-9]*)?)[ \t]*)?((?:[A-DF-MO-Za-df-mo-z][+-]?(?:[0-9]{1,9}(?:\.[0-9]*)?|\.[0-9]+)[ \t]*)+)"
)
"""A line of words only, as nearly all lines are: it needs no walk along its characters."""
_PAIR = re.compile(r"([A-Z])([+-]?[0-9.]+)")
_CORNER = re.compile(r"(,[CRA])([+-]?(?:[0-9]{1,9}\.?[0-9]*|\.[0-9]+))")
_DELETE = re.compile(r"^\s*/[1-9]?")
_BLOCK_NUMBER = re.compile(r"N([0-9]+\.?[0-9]*)")
_COMPUTED = re.compile(r"[#\[O]|END")
_PLAIN = re.compile(r"[A-Z][+-]?[0-9.]+(?![#\[])")
_PROGRAM_NUMBER = re.compile(r"\s*[Oo]\s*([0-9]{1,8})(?![0-9.])")
_COMMENT_GAP = "\n"  # stands in the compacted line where a comment was, so that X1(a)2 does not become X12


@dataclass(frozen=True)
class Word:
    """A letter, its number, and the word as the program writes it (``text``).

    A word with an ``expression`` has its number only when its block runs; until then ``value`` is no number.
    """

    letter: str
    value: float
    text: str
    expression: Expression | None = None

    @property
    def code(self) -> str:
        """The word with its number in the shortest form: ``G01`` and ``g1.`` are both ``G1``."""
        return f"{self.letter}{self.value:.10g}"


@dataclass(frozen=True)
class Block:
    """One line of a program: its physical line (from 1), its words without the N number, its comments and its N number as text.

    ``assignments`` give variables their values; ``statement`` chooses the next block; ``computed`` says whether a word has an expression.
    """

    line: int
    words: tuple[Word, ...]
    comments: tuple[str, ...] = ()
    number: str = ""
    assignments: tuple[Assignment, ...] = ()
    statement: Statement | None = None
    computed: bool = False


@dataclass(frozen=True)
class Warned:
    """Something odd that does not stop a program: physical line and sentence."""

    line: int
    sentence: str


@dataclass(frozen=True)
class Blocks:
    """A program cut into blocks; ``ending`` is what closed it: ``M2``, ``M30``, ``%`` or nothing."""

    name: str
    blocks: tuple[Block, ...]
    ending: str
    last_line: int
    warnings: tuple[Warned, ...] = field(default=())
    subprograms: Mapping[int, tuple[Block, ...]] = field(default_factory=dict)
    """Programs behind the end of the main one, by their O number."""
    locals: Mapping[int, tuple[Block, ...]] = field(default_factory=dict)
    """Blocks behind the end of the main program from an N number to M99, by that number."""

    def place(self, line: int) -> str:
        """The place of a physical line as errors show it."""
        return f"{self.name}:{line}"


def read_program_file(path: str | Path, *, block_delete: bool = True) -> Blocks:
    """Return the blocks of the part program in the file ``path``; a missing or unreadable file is a :class:`ProgramError`."""
    path = Path(path)
    try:
        content = path.read_bytes()
    except FileNotFoundError as error:
        near = nearest(path.name, [file.name for file in path.parent.glob("*.n*c*")] if path.parent.is_dir() else [])
        raise ProgramError(f"There is no part program '{path}'.", remedy=near) from error
    except OSError as error:
        raise ProgramError(f"The part program '{path}' cannot be read: {error.strerror}.") from error
    return read_program(content, str(path), block_delete=block_delete)


def read_program(source: str | bytes, name: str = "program", *, block_delete: bool = True) -> Blocks:
    """Return the blocks of a program text.

    ``name`` stands in front of the line in every message; with ``block_delete`` lines that begin with ``/`` are left out.
    Raises :class:`ProgramError` for everything that is no word, with place, fact and remedy; all lines at fault are told at once.
    """
    text = source if isinstance(source, str) else _decoded(source, name)
    lines = re.split(r"\r\n|\n|\r", text.removeprefix("\ufeff").rstrip("\x00\x03\x04\x1a"))
    blocks: list[Block] = []
    warnings: list[Warned] = []
    faults: list[ProgramError] = []
    ending = ""
    main = 0  # blocks of the main program up to its first end
    inside, jumps = 0, False  # how many statements are open, and whether any may go to a block behind the end
    opened = 0
    line = 0
    for line, raw in enumerate(lines, start=1):
        place = f"{name}:{line}"
        if ending and _PROGRAM_NUMBER.match(raw):
            line -= 1
            break
        if raw.lstrip().startswith("%"):
            if raw.strip() != "%":
                warnings.append(Warned(line, f"The text '{raw.strip()[1:].strip()[:40]}' behind % is ignored."))
            if not opened and not blocks:
                opened = line
                continue
            ending = "%"
            break
        try:
            block = _block(raw, line, place, block_delete)
        except ProgramError as error:
            faults.append(error)
            continue
        if block is None:
            continue
        blocks.append(block)
        if block.statement is not None:
            inside += opens(block.statement)
            jumps = jumps or block.statement.kind is Kind.GO_TO
        stop = next((word for word in block.words if word.code in ("M2", "M30")), None)
        if stop is not None:
            ending, main = stop.code, main or len(blocks)
            if inside <= 0 and not jumps:
                break
    if faults:
        raise _told(faults, text, name)
    if opened and not ending:
        raise ProgramError(
            f"The % of line {opened} opens the program and no second % closes it.",
            place=f"{name}:{len(lines)}",
            remedy="The file may be cut short. End it with M30 and %.",
        )
    further = _Further(lines, line, name, block_delete) if ending in ("M2", "M30") else None
    rest = next((k for k, raw in enumerate(lines[line:], start=line + 1) if raw.strip() not in ("", "%")), None)
    subprograms, own = further.programs() if further is not None else ({}, {})
    own = {**_by_number(blocks[main:]), **own} if jumps and main else own
    if ending and rest is not None and not subprograms and not own:
        warnings.append(Warned(rest, f"Everything behind {ending} of line {line} is ignored, from here on."))
    if not any(block.words for block in blocks):
        warnings.append(Warned(1, "The program is empty."))
    last = line if ending else max((block.line for block in blocks), default=1)
    return Blocks(name, tuple(blocks), ending, last, tuple(warnings), subprograms, own)


def _told(faults: list[ProgramError], text: str, name: str) -> ProgramError:
    """The error for all lines at fault: the control that the program is written for, the only fault, or all of them."""
    foreign = foreign_control(text, name, [int(fault.place.rpartition(":")[2]) for fault in faults])
    if foreign is not None:
        return foreign
    return faults[0] if len(faults) == 1 else SeveralFaultsError(faults[:MOST_FAULTS], max(0, len(faults) - MOST_FAULTS))


@dataclass(frozen=True)
class _Further:
    """The lines behind the end of a main program, in which subprograms may stand: each begins with its O number and ends with M99."""

    lines: list[str]
    first: int
    name: str
    block_delete: bool

    def programs(self) -> tuple[dict[int, tuple[Block, ...]], dict[int, tuple[Block, ...]]]:
        """Return the subprograms by O number, and what is called by N number; nothing where the lines do not begin with one."""
        found: dict[int, list[Block]] = {}
        behind: list[Block] = []
        number: int | None = None
        for line, raw in enumerate(self.lines[self.first :], start=self.first + 1):
            if raw.strip() in ("", "%"):
                continue
            begins = _PROGRAM_NUMBER.match(raw)
            if begins is not None:
                number = int(begins[1])
                found[number] = []
            elif not behind and not found and _BLOCK_NUMBER.match(raw.lstrip().upper()) is None:
                return {}, {}
            block = _block(raw, line, f"{self.name}:{line}", self.block_delete)
            if block is not None:
                behind.append(block)
                if number is not None:
                    found[number].append(block)
        return {key: tuple(blocks) for key, blocks in found.items()}, _by_number(behind)


def _by_number(blocks: list[Block]) -> dict[int, tuple[Block, ...]]:
    """The blocks from each whole N number up to the next M99, by that number."""
    ends = [place for place, block in enumerate(blocks) if any(word.code == "M99" for word in block.words)]
    found: dict[int, tuple[Block, ...]] = {}
    for place, block in enumerate(blocks):
        end = next((end for end in ends if end >= place), None)
        if end is not None and block.number.isdigit() and len(found) < MOST_LOCALS:
            found.setdefault(int(block.number), tuple(blocks[place : end + 1]))
    return found


def _decoded(content: bytes, name: str) -> str:
    """Text of the bytes: UTF-8, UTF-16 with its mark, else the western code page that old editors write comments in."""
    marked = content[:2] in (b"\xff\xfe", b"\xfe\xff")
    for encoding in ["utf-16"] if marked else ["utf-8-sig", "cp1252", "latin-1"]:
        try:
            return content.decode(encoding)
        except UnicodeDecodeError:
            continue
    raise ProgramError(f"'{name}' is no text.", remedy="A part program is a plain text file.")


def _block(raw: str, line: int, place: str, block_delete: bool) -> Block | None:
    """The block of one line, or None where it is blank or deleted."""
    simple = _SIMPLE.fullmatch(raw) if len(raw) <= LINE_LIMIT else None
    if simple is not None:
        pairs = _PAIR.findall(simple[2].upper())
        return Block(line, tuple([Word(letter, float(number), letter + number) for letter, number in pairs]), (), simple[1] or "")
    for character in raw:
        if (ord(character) < 32 and character != "\t") or ord(character) == 127:
            raise ProgramError(
                f"A control character (code {ord(character)}) stands in the line, so this is no plain text.",
                place=place,
                remedy="Save the program as plain text; it may have been damaged on the way.",
            )
    deleted = raw.lstrip().startswith("/")
    if deleted and block_delete:
        return None
    code, spaced, comments = _compact(_DELETE.sub("", raw) if deleted else raw, place)
    if len(code) > LINE_LIMIT:
        raise ProgramError(
            f"The line is too long: {len(code)} characters of code, and {LINE_LIMIT} are read.",
            place=place,
            remedy="Write it as several blocks.",
        )
    bare = code.replace(_COMMENT_GAP, "") if _COMPUTED.search(code) else ""
    try:
        block = _computed_block(line, bare, comments, place) if bare else None
    except ExpressionError as fault:
        raise ProgramError(fault.fact, place=place, remedy=fault.remedy) from fault
    if block is not None:
        return block
    words, number = _words(code, spaced, place)
    if not words and not comments and not number:
        return None
    return Block(line, tuple(words), tuple(comments), number)


def _computed_block(line: int, code: str, comments: list[str], place: str) -> Block | None:
    """The block of a line with expressions, assignments or a statement; None where it has none of them."""
    numbered = _BLOCK_NUMBER.match(code)
    number, position = (numbered[1], numbered.end()) if numbered is not None else ("", 0)
    statement = statement_at(code[position:])
    if statement is not None:
        return Block(line, (), tuple(comments), number, statement=statement)
    if "#" not in code and "[" not in code:
        return None
    words: list[Word] = []
    assignments: list[Assignment] = []
    while position < len(code):
        character = code[position]
        if character == "#":
            assignment, position = parse_assignment(code, position)
            assignments.append(assignment)
        elif "A" <= character <= "Z" and begins_value(code, position + 1):
            expression, behind = parse_value(code, position + 1)
            words.append(Word(character, math.nan, code[position:behind], expression))
            position = behind
        else:
            plain = _PLAIN.match(code, position)
            piece = plain.group() if plain is not None else code[position:]
            more, late = _words(piece, [False] * len(piece), place)
            if late or (number and not more):
                raise ProgramError(f"N{late} stands behind another word.", place=place, remedy="The N number comes first in its block.")
            words += more
            position += len(piece)
    computed = any(word.expression is not None for word in words)
    return Block(line, tuple(words), tuple(comments), number, tuple(assignments), computed=computed)


def _compact(raw: str, place: str) -> tuple[str, list[bool], list[str]]:
    """The line in upper case without blanks and comments, whether a blank stood before each character, and the comments."""
    code: list[str] = []
    spaced: list[bool] = []
    comments: list[str] = []
    blank = True
    position = 0
    while position < len(raw):
        character = raw[position]
        if character == ";":
            if raw[position + 1 :].strip():
                comments.append(raw[position + 1 :].strip())
            break
        if character == "(":
            close = raw.find(")", position)
            again = raw.find("(", position + 1)
            if close < 0:
                raise ProgramError("A comment is opened and not closed.", place=place, remedy="Put ) at its end.")
            if 0 <= again < close:
                raise ProgramError("A comment stands inside a comment.", place=place, remedy="Use one pair of parentheses.")
            comments.append(raw[position + 1 : close].strip())
            code.append(_COMMENT_GAP)
            spaced.append(True)
            position = close
        elif character == ")":
            raise ProgramError("A ) closes a comment that was not opened.", place=place, remedy="Put ( in front of the comment.")
        elif character.isspace():
            blank = True
            position += 1
            continue
        else:
            code.append(character.upper() if character.isascii() else character)
            spaced.append(blank)
        blank = False
        position += 1
    return "".join(code), spaced, comments


def _words(code: str, spaced: list[bool], place: str) -> tuple[list[Word], str]:
    """The words of a compacted line and its N number."""
    words: list[Word] = []
    number = ""
    position = 0
    while position < len(code):
        letter = code[position]
        if letter == _COMMENT_GAP:
            position += 1
            continue
        corner = _CORNER.match(code, position) if letter == "," else None
        if corner is not None and words:
            words.append(Word(corner[1], float(corner[2]), corner.group()))
            position = corner.end()
            continue
        if not ("A" <= letter <= "Z"):
            raise no_word(code, position, words[-1].text if words else "", place)
        found = _NUMBER.match(code, position + 1)
        if found is None:
            raise no_number(code, position, place)
        text = code[position : found.end()]
        if letter == "N":
            if words or number:
                raise ProgramError(f"{text} stands behind another word.", place=place, remedy="The N number comes first in its block.")
            if text[1] == "-":
                raise ProgramError(f"{text} is negative.", place=place, remedy="N numbers count from 0 up.")
            number = text[1:]
        else:
            if len(found.group().lstrip("+-0").partition(".")[0]) > DIGIT_LIMIT:
                raise ProgramError(
                    f"{text[:20]} is too large a number.", place=place, remedy=f"At most {DIGIT_LIMIT} digits stand before the point."
                )
            words.append(Word(letter, float(found.group()), text))
        position = found.end()
        rest = code[position:]
        if rest.startswith("."):
            longer = re.match(r"[0-9.]*", rest)
            tail = longer.group() if longer else ""
            raise ProgramError(f"{text}{tail} has more than one decimal point.", place=place, remedy=f"Write {text}.")
        if re.match(r"E[+-]?[0-9]", rest) and not spaced[position]:
            exponent = re.match(r"E[+-]?[0-9]+", rest)
            raise ProgramError(
                f"{text}{exponent.group() if exponent else 'E'}: E is not a number exponent in G-code.",
                place=place,
                remedy="Write the number out, as in X1000.",
            )
    return words, number
