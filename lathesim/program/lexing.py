"""Read one line of a part program as a block of words: the lexical part, common to all dialects.

A word is a letter and a number (``X12.5``); a block is one line. Lower case, blanks inside words and numbers, tabs, comments in
parentheses or behind ``;``, block delete ``/`` and N numbers are read. Expressions, variables and the statements that choose the next
block are parsed here and evaluated when their block runs (``macros``).

Source: EIA RS-274-D; NIST RS274NGC Interpreter version 3 (Kramer, Proctor, Messina 2000), section 3 (format of a line).
"""

from __future__ import annotations

import math
import re
from functools import lru_cache
from typing import NamedTuple

from lathesim.errors import Fault
from lathesim.program.expressions import LARGEST, Assignment, Expression, begins_value, parse_assignment, parse_value
from lathesim.program.statements import Statement, statement_at


def no_word(code: str, position: int, before: str) -> Fault:
    """The error for a character that cannot begin a word."""
    character = code[position]
    if character == "/":
        return Fault("A / stands inside the block.", "Block delete / comes first in its line and takes all of it.")
    if character == "$" and position == 0:
        fact = f"{code[:12]} is a command to GRBL itself, not a part of a program."
        return Fault(fact, "Take it out; type it in the program that sends to GRBL.")
    if character == ",":
        remedy = "Write numbers with a decimal point, as in X0.5."
        return Fault(f"A comma stands behind {before}." if before else "A comma stands in the block.", remedy)
    if code[position : position + len(_BILLET)] == _BILLET:
        fact = "[BILLET is the bar of a training simulator (Denford), and no part of a program."
        return Fault(fact, "Take it out; --stock gives the bar.")
    if character in "[]=<>":
        fact = f"'{code[position : position + 10]}' has no letter in front of it."
        return Fault(fact, "Write an expression behind the letter of its word, as in X[#1+2].")
    if character in "0123456789.+-":
        found = re.match(r"[0-9.+-]+", code[position:])
        fact = f"The number {found.group() if found else character} has no letter."
        return Fault(fact, "Put its letter right in front, as in X10.")
    return Fault(f"'{character}' is no part of a program.", "Words are a letter and a number; put remarks in parentheses.")


def no_number(code: str, position: int) -> Fault:
    """The error for a letter without a number."""
    letter = code[position]
    rest = code[position + 1 :]
    if letter in "GM" and rest.startswith("O"):
        return Fault(f"{letter}O is written with the letter O.", f"Write {letter}0 with a zero.")
    if rest[:1] == ",":
        return Fault(f"A comma stands behind {letter}.", "Write numbers with a decimal point, as in X0.5.")
    if rest[:1] in ("+", "-") and rest[1:2] in ("+", "-"):
        digits = re.match(r"[0-9.]*", rest[2:])
        return Fault(f"{letter}{rest[:2]}{digits.group() if digits else ''} has two signs.", "Write one sign.")
    return Fault(f"{letter} has no number.", f"Write one right behind it, as in {letter}10; put remarks in parentheses.")


_BILLET = "[BILLET"
LINE_LIMIT = 256  # characters of code in one line. Source: NIST RS274NGC version 3, section 3.3
DIGIT_LIMIT = 9  # digits before the decimal point, assumed: a larger number is a slip, and its square must stay finite

_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)")
_SIMPLE = re.compile(
    r"[ \t]*(?:[Nn]([0-9]{1,9}(?:\.[0-9]*)?)[ \t]*)?((?:[A-DF-MO-Za-df-mo-z][ \t]*[+-]?(?:[0-9]{1,9}(?:\.[0-9]*)?|\.[0-9]+)[ \t]*)+)[\r\n]*"
)
"""A line of words only, like most lines: it is read without a loop over its characters."""
_REMARK = re.compile(r"\(([^()\x00-\x08\x0a-\x1f\x7f]*)\)|;([^\x00-\x08\x0a-\x1f\x7f]*)")
_CONTROL = re.compile(r"[\x00-\x08\x0a-\x1f\x7f]")
_SHAPE = re.compile(r"[GMTgmt][ \t]*[+-]?[0-9.]+|[A-Za-z]")
_PAIR = re.compile(r"([A-Z])[ \t]*([+-]?[0-9.]+)")
_CORNER = re.compile(r"(,[CRA])([+-]?(?:[0-9]{1,9}\.?[0-9]*|\.[0-9]+))")
_DELETE = re.compile(r"^\s*/[1-9]?")
_BLOCK_NUMBER = re.compile(r"N([0-9]+\.?[0-9]*)")
_COMPUTED = re.compile(r"[#\[O]|END")
_PLAIN = re.compile(r"[A-Z][+-]?[0-9.]+(?![#\[])")
_COMMENT_GAP = "\n"  # replaces a comment in the compacted line, so that X1(a)2 does not become X12


class Word(NamedTuple):
    """A letter, its number, and the word as the program writes it (``text``).

    A word with an ``expression`` gets its number when its block runs; until then ``value`` is NaN.
    """

    letter: str
    value: float
    text: str
    expression: Expression | None = None

    @property
    def code(self) -> str:
        """The word with its number in the shortest form: ``G01`` and ``g1.`` are both ``G1``."""
        return _code(self.letter, self.value)


@lru_cache(4096)
def _code(letter: str, value: float) -> str:
    return f"{letter}{value:.10g}"


_new_word = tuple.__new__  # half the time of Word(...), which matters for a program with a million words


class Block(NamedTuple):
    """One line of a program: its physical line (from 1), its words without the N number, its comments and its N number as text.

    ``assignments`` set variables, ``statement`` chooses the next block, and ``computed`` says whether a word has an expression. An
    unreadable line has a ``fault``, which is raised when the block runs.
    """

    line: int
    words: tuple[Word, ...]
    comments: tuple[str, ...] = ()
    number: str = ""
    assignments: tuple[Assignment, ...] = ()
    statement: Statement | None = None
    computed: bool = False
    fault: Fault | None = None


def shape_of(raw: str) -> tuple[str, ...] | None:
    """Return the codes, tools and letters of a line of words only, or None for other lines; lines with the same words have one shape."""
    simple = _simple(raw)
    return None if simple is None else tuple(_SHAPE.findall(simple[2]))


def _simple(raw: str) -> re.Match[str] | None:
    """Return the match of a line of words and remarks only, or None."""
    return None if len(raw) > LINE_LIMIT else _SIMPLE.fullmatch(_REMARK.sub(" ", raw) if "(" in raw or ";" in raw else raw)


def block_of_line(raw: str, line: int, block_delete: bool) -> Block | None:
    """Return the block of one line, or None if it is blank or deleted. Raises :class:`Fault`."""
    simple = _simple(raw)
    if simple is not None:
        words = [_new_word(Word, (letter, float(number), letter + number, None)) for letter, number in _PAIR.findall(simple[2].upper())]
        return Block(line, tuple(words), _remarks(raw) if "(" in raw or ";" in raw else (), simple[1] or "")
    raw = raw.rstrip("\r\n")
    control = _CONTROL.search(raw)
    if control is not None:
        fact = f"A control character (code {ord(control.group())}) stands in the line, so this is no plain text."
        raise Fault(fact, "Save the program as plain text; it may have been damaged on the way.")
    deleted = raw.lstrip().startswith("/")
    if deleted and block_delete:
        return None
    code, spaced, comments = _compact(_DELETE.sub("", raw) if deleted else raw)
    if len(code) > LINE_LIMIT:
        raise Fault(f"The line is too long: {len(code)} characters of code, and {LINE_LIMIT} are read.", "Write it as several blocks.")
    bare = code.replace(_COMMENT_GAP, "") if _COMPUTED.search(code) else ""
    block = _computed_block(line, bare, comments) if bare else None
    if block is not None:
        return block
    words, number = _words(code, spaced)
    return Block(line, tuple(words), tuple(comments), number) if words or comments or number else None


def _remarks(raw: str) -> tuple[str, ...]:
    """Return the remarks of a line; an empty one counts in parentheses only."""
    return tuple(found[found.lastindex or 0].strip() for found in _REMARK.finditer(raw) if found[1] is not None or found[2].strip())


def _computed_block(line: int, code: str, comments: list[str]) -> Block | None:
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
            more, late = _words(piece, [False] * len(piece))
            if late or (number and not more):
                raise Fault(f"N{late} stands behind another word.", "The N number comes first in its block.")
            words += more
            position += len(piece)
    computed = any(word.expression is not None for word in words)
    return Block(line, tuple(words), tuple(comments), number, tuple(assignments), computed=computed)


def _compact(raw: str) -> tuple[str, list[bool], list[str]]:
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
                raise Fault("A comment is opened and not closed.", "Put ) at its end.")
            if 0 <= again < close:
                raise Fault("A comment stands inside a comment.", "Use one pair of parentheses.")
            comments.append(raw[position + 1 : close].strip())
            code.append(_COMMENT_GAP)
            spaced.append(True)
            position = close
        elif character == ")":
            raise Fault("A ) closes a comment that was not opened.", "Put ( in front of the comment.")
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


def _words(code: str, spaced: list[bool]) -> tuple[list[Word], str]:
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
            raise no_word(code, position, words[-1].text if words else "")
        found = _NUMBER.match(code, position + 1)
        if found is None:
            raise no_number(code, position)
        text = code[position : found.end()]
        if letter == "N":
            if words or number:
                raise Fault(f"{text} stands behind another word.", "The N number comes first in its block.")
            if text[1] == "-":
                raise Fault(f"{text} is negative.", "N numbers count from 0 up.")
            number = text[1:]
        else:
            if abs(float(found.group())) >= LARGEST:
                raise Fault(f"{text[:20]} is too large a number.", f"At most {DIGIT_LIMIT} digits stand before the point.")
            words.append(Word(letter, float(found.group()), text))
        position = found.end()
        rest = code[position:]
        if rest.startswith("."):
            longer = re.match(r"[0-9.]*", rest)
            tail = longer.group() if longer else ""
            raise Fault(f"{text}{tail} has more than one decimal point.", f"Write {text}.")
        if re.match(r"E[+-]?[0-9]", rest) and not spaced[position]:
            exponent = re.match(r"E[+-]?[0-9]+", rest)
            raise Fault(
                f"{text}{exponent.group() if exponent else 'E'}: E is not a number exponent in G-code.",
                "Write the number out, as in X1000.",
            )
    return words, number
