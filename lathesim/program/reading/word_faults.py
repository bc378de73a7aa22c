"""The sentences for what is no word of a part program, each with what to write instead."""

from __future__ import annotations

import re

from lathesim.errors import ProgramError


def no_word(code: str, position: int, before: str, place: str) -> ProgramError:
    """The error for a character that cannot begin a word."""
    character = code[position]
    if character == "/":
        return ProgramError(
            "A / stands inside the block.", place=place, remedy="Block delete / comes first in its line and takes all of it."
        )
    if character == "$" and position == 0:
        fact = f"{code[:12]} is a command to GRBL itself, not a part of a program."
        return ProgramError(fact, place=place, remedy="Take it out; type it in the program that sends to GRBL.")
    if character == ",":
        remedy = "Write numbers with a decimal point, as in X0.5."
        return ProgramError(f"A comma stands behind {before}." if before else "A comma stands in the block.", place=place, remedy=remedy)
    if code[position : position + 7] == "[BILLET":
        fact = "[BILLET is the bar of a training simulator (Denford), and no part of a program."
        return ProgramError(fact, place=place, remedy="Take it out; --stock gives the bar.")
    if character in "[]=<>":
        fact = f"'{code[position : position + 10]}' has no letter in front of it."
        return ProgramError(fact, place=place, remedy="Write an expression behind the letter of its word, as in X[#1+2].")
    if character in "0123456789.+-":
        found = re.match(r"[0-9.+-]+", code[position:])
        fact = f"The number {found.group() if found else character} has no letter."
        return ProgramError(fact, place=place, remedy="Put its letter right in front, as in X10.")
    return ProgramError(
        f"'{character}' is no part of a program.", place=place, remedy="Words are a letter and a number; put remarks in parentheses."
    )


def no_number(code: str, position: int, place: str) -> ProgramError:
    """The error for a letter without a number."""
    letter = code[position]
    rest = code[position + 1 :]
    if letter in "GM" and rest.startswith("O"):
        return ProgramError(f"{letter}O is written with the letter O.", place=place, remedy=f"Write {letter}0 with a zero.")
    if rest[:1] == ",":
        return ProgramError(f"A comma stands behind {letter}.", place=place, remedy="Write numbers with a decimal point, as in X0.5.")
    if rest[:1] in ("+", "-") and rest[1:2] in ("+", "-"):
        digits = re.match(r"[0-9.]*", rest[2:])
        return ProgramError(f"{letter}{rest[:2]}{digits.group() if digits else ''} has two signs.", place=place, remedy="Write one sign.")
    return ProgramError(
        f"{letter} has no number.", place=place, remedy=f"Write one right behind it, as in {letter}10; put remarks in parentheses."
    )
