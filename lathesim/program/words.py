"""Text of a part program to blocks of words, each with its physical line: the lexical part, the same for every dialect.

A word is a letter and a number (``X12.5``); a block is one line. Lower case, blanks inside words and numbers, tabs, comments in
parentheses or behind ``;``, block delete ``/``, ``%`` lines, N numbers, CRLF and a byte order mark are read. What a word *means* is
decided later (dialects, interpreter). Reading ends at the second ``%`` or behind a block with M2 or M30.

Source: EIA RS-274-D; NIST RS274NGC Interpreter version 3 (Kramer, Proctor, Messina 2000), section 3 (format of a line).
Left out: expressions in brackets, ``#`` variables, O-word subroutines of LinuxCNC; they are refused.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from lathesim.errors import ProgramError, SeveralFaultsError, nearest

LINE_LIMIT = 256  # characters of code in one line. Source: NIST RS274NGC version 3, section 3.3
DIGIT_LIMIT = 9  # digits before the decimal point, assumed: a larger number is a slip, and its square must stay finite

MOST_FAULTS = 20  # lines at fault that are told, assumed: whoever wrote more has to look at the file anyway

_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)")
_PROGRAM_NUMBER = re.compile(r"\s*[Oo]\s*([0-9]{1,8})(?![0-9.])")
_COMMENT_GAP = "\n"  # stands in the compacted line where a comment was, so that X1(a)2 does not become X12


@dataclass(frozen=True)
class Word:
    """A letter, its number, and the word as the program writes it (``text``)."""

    letter: str
    value: float
    text: str

    @property
    def code(self) -> str:
        """The word with its number in the shortest form: ``G01`` and ``g1.`` are both ``G1``."""
        return f"{self.letter}{self.value:.10g}"


@dataclass(frozen=True)
class Block:
    """One line of a program: its physical line (from 1), its words without the N number, its comments and its N number as text."""

    line: int
    words: tuple[Word, ...]
    comments: tuple[str, ...] = ()
    number: str = ""


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

    def place(self, line: int) -> str:
        """The place of a physical line as errors show it."""
        return f"{self.name}:{line}"


def read_program_file(path: str | Path, *, block_delete: bool = True) -> Blocks:
    """Give the blocks of the part program in the file ``path``; a missing or unreadable file is a :class:`ProgramError`."""
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
    """Give the blocks of a program text.

    ``name`` stands in front of the line in every message; with ``block_delete`` lines that begin with ``/`` are left out.
    Raises :class:`ProgramError` for everything that is no word, with place, fact and remedy; all lines at fault are told at once.
    """
    text = source if isinstance(source, str) else _decoded(source, name)
    lines = re.split(r"\r\n|\n|\r", text.removeprefix("\ufeff").rstrip("\x1a"))
    blocks: list[Block] = []
    warnings: list[Warned] = []
    faults: list[ProgramError] = []
    ending = ""
    opened = 0
    line = 0
    for line, raw in enumerate(lines, start=1):
        place = f"{name}:{line}"
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
        stop = next((word for word in block.words if word.code in ("M2", "M30")), None)
        if stop is not None:
            ending = stop.code
            break
    if len(faults) == 1:
        raise faults[0]
    if faults:
        raise SeveralFaultsError(faults[:MOST_FAULTS], max(0, len(faults) - MOST_FAULTS))
    if opened and not ending:
        raise ProgramError(
            f"The % of line {opened} opens the program and no second % closes it.",
            place=f"{name}:{len(lines)}",
            remedy="The file may be cut short. End it with M30 and %.",
        )
    further = _Further(lines, line, name, block_delete) if ending in ("M2", "M30") else None
    rest = next((k for k, raw in enumerate(lines[line:], start=line + 1) if raw.strip() not in ("", "%")), None)
    subprograms = further.programs() if further is not None else {}
    if ending and rest is not None and not subprograms:
        warnings.append(Warned(rest, f"Everything behind {ending} of line {line} is ignored, from here on."))
    if not any(block.words for block in blocks):
        warnings.append(Warned(1, "The program is empty."))
    last = line if ending else max((block.line for block in blocks), default=1)
    return Blocks(name, tuple(blocks), ending, last, tuple(warnings), subprograms)


@dataclass(frozen=True)
class _Further:
    """The lines behind the end of a main program, in which subprograms may stand: each begins with its O number and ends with M99."""

    lines: list[str]
    first: int
    name: str
    block_delete: bool

    def programs(self) -> dict[int, tuple[Block, ...]]:
        """Return the subprograms by number; nothing where the lines behind the end do not begin with one."""
        found: dict[int, list[Block]] = {}
        number: int | None = None
        for line, raw in enumerate(self.lines[self.first :], start=self.first + 1):
            if raw.strip() in ("", "%"):
                continue
            begins = _PROGRAM_NUMBER.match(raw)
            if begins is not None:
                number = int(begins[1])
                found[number] = []
            elif number is None:
                return {}
            block = _block(raw, line, f"{self.name}:{line}", self.block_delete)
            if block is not None and number is not None:
                found[number].append(block)
        return {key: tuple(blocks) for key, blocks in found.items()}


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
    code, spaced, comments = _compact(raw.lstrip()[1:] if deleted else raw, place)
    if len(code) > LINE_LIMIT:
        raise ProgramError(
            f"The line is too long: {len(code)} characters of code, and {LINE_LIMIT} are read.",
            place=place,
            remedy="Write it as several blocks.",
        )
    words, number = _words(code, spaced, place)
    if not words and not comments and not number:
        return None
    return Block(line, tuple(words), tuple(comments), number)


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
        if not ("A" <= letter <= "Z"):
            raise _no_word(code, position, words, place)
        found = _NUMBER.match(code, position + 1)
        if found is None:
            raise _no_number(code, position, place)
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


def _no_word(code: str, position: int, words: list[Word], place: str) -> ProgramError:
    """The error for a character that cannot begin a word."""
    character = code[position]
    before = words[-1].text if words else ""
    if character == "/":
        return ProgramError(
            "A / stands inside the block.", place=place, remedy="Block delete / comes first in its line and takes all of it."
        )
    if character == ",":
        remedy = "Write numbers with a decimal point, as in X0.5."
        return ProgramError(f"A comma stands behind {before}." if before else "A comma stands in the block.", place=place, remedy=remedy)
    if character in "#[=<":
        return _variable(f"'{code[position : position + 10]}'", place)
    if character in "0123456789.+-":
        found = re.match(r"[0-9.+-]+", code[position:])
        fact = f"The number {found.group() if found else character} has no letter."
        return ProgramError(fact, place=place, remedy="Put its letter right in front, as in X10.")
    return ProgramError(
        f"'{character}' is no part of a program.", place=place, remedy="Words are a letter and a number; put remarks in parentheses."
    )


def _no_number(code: str, position: int, place: str) -> ProgramError:
    """The error for a letter without a number."""
    letter = code[position]
    rest = code[position + 1 :]
    if letter in "GM" and rest.startswith("O"):
        return ProgramError(f"{letter}O is written with the letter O.", place=place, remedy=f"Write {letter}0 with a zero.")
    if rest[:1] in ("[", "#", "<"):
        return _variable(f"{letter}{rest[:10]}", place)
    if rest[:1] == ",":
        return ProgramError(f"A comma stands behind {letter}.", place=place, remedy="Write numbers with a decimal point, as in X0.5.")
    if rest[:1] in ("+", "-") and rest[1:2] in ("+", "-"):
        digits = re.match(r"[0-9.]*", rest[2:])
        return ProgramError(f"{letter}{rest[:2]}{digits.group() if digits else ''} has two signs.", place=place, remedy="Write one sign.")
    return ProgramError(
        f"{letter} has no number.", place=place, remedy=f"Write one right behind it, as in {letter}10; put remarks in parentheses."
    )


def _variable(text: str, place: str) -> ProgramError:
    return ProgramError(f"{text} is an expression or a variable, and these are not read.", place=place, remedy="Write the number itself.")
