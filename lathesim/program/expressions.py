"""Expressions of part programs, and the variables they read.

Expressions in brackets and variables, as ``X[#1 + 2 * SIN[30]]``: parsed once, evaluated whenever their block runs.

Operators from strong to weak: ``**``; ``* / MOD``; ``+ -``; ``EQ NE GT GE LT LE``; ``AND OR XOR``. Angles are degrees. A condition that
holds is 1. Source: LinuxCNC 2.9 manual, chapter Overview (expressions, functions); Fanuc 0i operator's manual, custom macro.
Left out: BIN, BCD and the print functions of Fanuc.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from lathesim.errors import Fault, nearest

Value = float | None
"""A number, or None for a variable that holds nothing (``#0`` of Fanuc)."""

_WHOLE, _MOST = 1e-4, 1e6
"""How far a computed number of a variable may be from a whole one, and the largest."""
MOST_VARIABLES = 20_000
"""Variables that one program may fill, assumed: far more than any part needs."""


class Variables:
    """Numbered and named variables; calls of subprograms have numbered ones of their own up to ``locals_to``.

    ``system`` answers for the variables of the machine (position, tool), by number or name, and returns None for others.
    With ``empty`` a variable that nothing was assigned to holds nothing, else it is 0.
    """

    def __init__(self, system: Callable[[int | str], Value], *, locals_to: int = 30, empty: bool = False) -> None:
        self._system = system
        self._locals_to = locals_to
        self._empty = empty
        self._numbers: dict[int, Value] = {}
        self._names: dict[str, float] = {}
        self._frames: list[tuple[dict[int, Value], dict[str, float]]] = [({}, {})]

    def number(self, number: int) -> Value:
        """Return the value of a numbered variable."""
        if number == 0 and self._empty:
            return None
        store = self._frames[-1][0] if number <= self._locals_to else self._numbers
        if number in store:
            return store[number]
        told = self._system(number)
        return told if told is not None or self._empty else 0.0

    def name(self, name: str) -> Value:
        """Return the value of a named variable, or None where there is none."""
        store = self._names if name.startswith("_") else self._frames[-1][1]
        return store[name] if name in store else self._system(name)

    def is_of_caller(self, name: str) -> bool:
        """Return whether a named variable is local to a calling program, and so unknown here."""
        return any(name in names for _, names in self._frames[:-1])

    def set_number(self, number: int, value: Value) -> None:
        """Assign to a numbered variable."""
        store = self._frames[-1][0] if number <= self._locals_to else self._numbers
        if number not in store and len(store) >= MOST_VARIABLES:
            raise OverflowError
        store[number] = value

    def set_name(self, name: str, value: float) -> None:
        """Assign to a named variable; a name that begins with an underscore is known everywhere."""
        store = self._names if name.startswith("_") else self._frames[-1][1]
        if name not in store and len(store) >= MOST_VARIABLES:
            raise OverflowError
        store[name] = value

    def enter(self, arguments: Mapping[int, float]) -> None:
        """Begin a call with variables of its own."""
        self._frames.append((dict(arguments), {}))

    def leave(self) -> None:
        """End a call."""
        self._frames.pop()


Evaluate = Callable[[Variables], Value]

DEEPEST = 24
"""Brackets inside brackets, assumed: nobody reads more."""
LARGEST = 1e9
"""Size of a result, assumed: as of written numbers, so that its square stays finite."""
_SAME = 1e-12

_NUMBER = re.compile(r"[0-9]+\.?[0-9]*|\.[0-9]+")
_FUNCTION = re.compile(r"[A-Z]+(?=\[)")
_NAME = re.compile(r"<([A-Z0-9_.-]+)>")
_OPERATOR = re.compile(r"\*\*|[*/+-]|MOD|EQ|NE|GT|GE|LT|LE|AND|XOR|OR")
_STRENGTH = {"**": 5, "*": 4, "/": 4, "MOD": 4, "+": 3, "-": 3, "AND": 1, "OR": 1, "XOR": 1}


@dataclass(frozen=True)
class Expression:
    """A parsed expression: ``evaluate(variables)``, and the ``text`` it was parsed from."""

    text: str
    evaluate: Evaluate


@dataclass(frozen=True)
class Assignment:
    """``#number = value`` or ``#<name> = value``; ``number`` is None for a named variable."""

    number: Expression | None
    name: str
    value: Expression

    def carry_out(self, variables: Variables, value: Value) -> None:
        """Set the variable to the value, which was evaluated before any assignment of the block."""
        try:
            if self.number is None:
                variables.set_name(self.name, value or 0.0)
            else:
                variables.set_number(_index(self.number.evaluate(variables)), value)
        except OverflowError:
            raise Fault("The program fills more variables than there are.", "Use the same ones again.") from None


def begins_value(text: str, position: int) -> bool:
    """Return whether a value that has to be computed begins here: a bracket, a variable, or a function, with or without a sign."""
    while text[position : position + 1] in ("+", "-") and text[position : position + 1]:
        position += 1
    return text[position : position + 1] in ("[", "#") or _function_at(text, position)


def _function_at(text: str, position: int) -> bool:
    found = _FUNCTION.match(text, position)
    return found is not None and (found.group() in _FUNCTIONS or found.group() in ("ATAN", "EXISTS"))


def parse_value(text: str, position: int) -> tuple[Expression, int]:
    """Return the value that begins here, as behind the letter of a word, and the place behind it."""
    parser = _Parser(text, position)
    evaluate = parser.value()
    return Expression(text[position : parser.position], evaluate), parser.position


def parse_expression(text: str, position: int) -> tuple[Expression, int]:
    """Return the expression without brackets around it that begins here, and the place behind it."""
    parser = _Parser(text, position)
    evaluate = parser.expression(0)
    return Expression(text[position : parser.position], evaluate), parser.position


def parse_assignment(text: str, position: int) -> tuple[Assignment, int]:
    """Return the assignment whose ``#`` stands here, and the place behind it."""
    named = _NAME.match(text, position + 1)
    number: Expression | None = None
    if named is not None:
        name, behind = named[1], named.end()
    else:
        name = ""
        parser = _Parser(text, position + 1)
        reference = parser.reference()
        behind = parser.position
        number = Expression(text[position + 1 : behind], reference)
    if text[behind : behind + 1] != "=":
        raise Fault(f"{text[position:behind]} stands alone.", f"Assign to it, as in {text[position:behind]}=1, or put a letter before it.")
    value, behind = parse_expression(text, behind + 1)
    return Assignment(number, name, value), behind


class _Parser:
    """Walks along the text of a block; ``position`` is the next character."""

    def __init__(self, text: str, position: int) -> None:
        self.text = text
        self.position = position
        self._depth = 0

    def expression(self, weakest: int) -> Evaluate:
        left = self.value()
        while True:
            found = _OPERATOR.match(self.text, self.position)
            if found is None or _STRENGTH.get(found.group(), 2) < max(weakest, 1):
                return left
            self.position = found.end()
            left = _binary(found.group(), left, self.expression(_STRENGTH.get(found.group(), 2) + 1))

    def value(self) -> Evaluate:
        text, position = self.text, self.position
        first = text[position : position + 1]
        if first in ("+", "-") and first:
            self.position += 1
            inner = self._deeper(self.value)
            return inner if first == "+" else lambda variables: -(inner(variables) or 0.0)
        if first == "[":
            return self._bracketed()
        if first == "#":
            self.position += 1
            return self._variable()
        number = _NUMBER.match(text, position)
        if number is not None:
            self.position = number.end()
            constant = float(number.group())
            return lambda _variables: constant
        function = _FUNCTION.match(text, position)
        if function is not None:
            return self._function(function.group())
        shown = text[position : position + 8] or "the end of the line"
        raise Fault(f"A value is missing where '{shown}' stands.", "Write a number, a variable as #1, or an expression in brackets.")

    def reference(self) -> Evaluate:
        """Return which variable is meant behind a ``#``."""
        text, position = self.text, self.position
        first = text[position : position + 1]
        if first == "#":
            self.position += 1
            return self._deeper(self._variable)
        if first == "[":
            return self._bracketed()
        number = _NUMBER.match(text, position)
        if number is None:
            raise Fault("A # names no variable.", "Write its number or its name, as in #101 or #<depth>.")
        self.position = number.end()
        constant = float(number.group())
        return lambda _variables: constant

    def _variable(self) -> Evaluate:
        named = _NAME.match(self.text, self.position)
        if named is not None:
            self.position = named.end()
            name = named[1]

            def by_name(variables: Variables) -> Value:
                value = variables.name(name)
                if value is None:
                    raise _unknown(name, variables)
                return value

            return by_name
        which = self.reference()
        return lambda variables: variables.number(_index(which(variables)))

    def _deeper(self, part: Callable[[], Evaluate]) -> Evaluate:
        self._depth += 1
        if self._depth > DEEPEST:
            raise Fault(f"An expression goes more than {DEEPEST} brackets deep.", "Compute it in several blocks.")
        inner = part()
        self._depth -= 1
        return inner

    def _bracketed(self) -> Evaluate:
        begin = self.position
        self.position += 1
        inner = self._deeper(lambda: self.expression(0))
        if self.text[self.position : self.position + 1] != "]":
            raise Fault(f"The bracket of {self.text[begin : begin + 12]} is not closed.", "Put ] behind the expression.")
        self.position += 1
        return inner

    def _function(self, name: str) -> Evaluate:
        self.position += len(name)
        if name == "EXISTS":
            return self._exists()
        if name == "ATAN":
            return self._atan()
        law = _FUNCTIONS.get(name)
        if law is None:
            raise Fault(
                f"There is no function {name}.", nearest(name, [*_FUNCTIONS, "ATAN"]) or "There are SIN, COS, SQRT, ABS and others."
            )
        inner = self._bracketed()
        return lambda variables: _checked(name, law, inner(variables) or 0.0)

    def _exists(self) -> Evaluate:
        found = re.compile(r"\[#(?:<([A-Z0-9_.-]+)>|([0-9]+))\]").match(self.text, self.position)
        if found is None:
            raise Fault("EXISTS names no variable.", "Write it as EXISTS[#<depth>].")
        self.position = found.end()
        name, number = found[1], found[2]
        return lambda variables: float((variables.name(name) if name else variables.number(int(number))) is not None)

    def _atan(self) -> Evaluate:
        across = self._bracketed()
        if self.text[self.position : self.position + 1] != "/":
            return lambda variables: math.degrees(math.atan(across(variables) or 0.0))
        self.position += 1
        along = self._bracketed()
        return lambda variables: math.degrees(math.atan2(across(variables) or 0.0, along(variables) or 0.0))


def _unknown(name: str, variables: Variables) -> Fault:
    """Return the error for a named variable without a value."""
    shown = name.lower()
    if variables.is_of_caller(name):
        fact = f"#<{shown}> is local to the calling program and unknown in the subprogram."
        return Fault(fact, f"Write the global name #<_{shown}>, or pass the value as an argument.")
    return Fault(f"#<{shown}> has no value yet.", f"Assign to it first, as in #<{shown}>=1.")


def _index(value: Value) -> int:
    number = 0.0 if value is None else value
    if number < 0.0 or abs(number - round(number)) > _WHOLE or number > _MOST:
        raise Fault(f"#{number:g} names no variable.", "Numbers of variables are whole and not negative.")
    return round(number)


def _round(value: float) -> float:
    return math.floor(abs(value) + 0.5) * (1.0 if value >= 0.0 else -1.0)


_FUNCTIONS: dict[str, Callable[[float], float]] = {
    "SIN": lambda x: math.sin(math.radians(x)), "COS": lambda x: math.cos(math.radians(x)), "TAN": lambda x: math.tan(math.radians(x)),
    "ASIN": lambda x: math.degrees(math.asin(x)), "ACOS": lambda x: math.degrees(math.acos(x)),
    "SQRT": math.sqrt, "SQR": math.sqrt, "ABS": abs, "EXP": math.exp, "LN": math.log,
    "FIX": lambda x: float(math.floor(x)), "FUP": lambda x: float(math.ceil(x)), "ROUND": _round, "RND": _round,
}  # fmt: skip


def _checked(name: str, law: Callable[[float], float], value: float) -> float:
    try:
        result = law(value)
    except (ValueError, OverflowError):
        raise Fault(f"{name}[{value:g}] has no value.", "Check the number in its bracket.") from None
    return _of_size(result)


def _of_size(result: float) -> float:
    if not abs(result) < LARGEST:
        raise Fault("An expression grows beyond any length of a machine.", "Check its numbers.")
    return result


def _divided(left: float, right: float) -> float:
    if right == 0.0:
        raise Fault(f"{left:g} is divided by 0.", "Check what stands behind the /.")
    return left / right


def _power(left: float, right: float) -> float:
    try:
        result = left**right
    except (ZeroDivisionError, OverflowError):
        result = math.nan
    if isinstance(result, complex):
        result = math.nan
    if math.isnan(result):
        raise Fault(f"{left:g}**{right:g} has no value.", "Check its two numbers.")
    return float(result)


def _remainder(left: float, right: float) -> float:
    if right == 0.0:
        raise Fault(f"{left:g} MOD 0 has no value.", "Check what stands behind MOD.")
    return math.fmod(left, right) + (abs(right) if math.fmod(left, right) < 0.0 else 0.0)


_BINARY: dict[str, Callable[[float, float], float]] = {
    "**": _power, "*": lambda a, b: a * b, "/": _divided, "MOD": _remainder, "+": lambda a, b: a + b, "-": lambda a, b: a - b,
    "GT": lambda a, b: float(a > b), "GE": lambda a, b: float(a >= b), "LT": lambda a, b: float(a < b), "LE": lambda a, b: float(a <= b),
    "AND": lambda a, b: float(bool(a) and bool(b)), "OR": lambda a, b: float(bool(a) or bool(b)),
    "XOR": lambda a, b: float(bool(a) != bool(b)),
}  # fmt: skip


def _binary(operator: str, left: Evaluate, right: Evaluate) -> Evaluate:
    if operator in ("EQ", "NE"):
        wanted = operator == "EQ"

        def equal(variables: Variables) -> Value:
            a, b = left(variables), right(variables)
            same = a is b if a is None or b is None else abs(a - b) < _SAME
            return float(same == wanted)

        return equal
    law = _BINARY[operator]
    return lambda variables: _of_size(law(left(variables) or 0.0, right(variables) or 0.0))
