"""Statements of macros, and which belong together.

Statements that choose which block comes next: the O-words of LinuxCNC, and IF, WHILE and GOTO of Fanuc's custom macros.

Source: LinuxCNC 2.9 manual, chapter O Codes; Fanuc 0i operator's manual, custom macro (branch and repetition).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import StrEnum

from lathesim.errors import Fault
from lathesim.program.expressions import Assignment, Expression, parse_assignment, parse_value


class Keyword(StrEnum):
    """What a statement does; the text is how the program writes it."""

    SUB = "SUB"
    END_SUB = "ENDSUB"
    CALL = "CALL"
    RETURN = "RETURN"
    IF = "IF"
    ELSE_IF = "ELSEIF"
    ELSE = "ELSE"
    END_IF = "ENDIF"
    DO = "DO"
    WHILE = "WHILE"
    END_WHILE = "ENDWHILE"
    REPEAT = "REPEAT"
    END_REPEAT = "ENDREPEAT"
    BREAK = "BREAK"
    CONTINUE = "CONTINUE"
    GO_TO = "GOTO"
    IF_THEN = "IF ... THEN"
    LOOP = "DO n"
    LOOP_END = "END n"


MACROS = frozenset({Keyword.GO_TO, Keyword.IF_THEN, Keyword.LOOP, Keyword.LOOP_END})
"""Statements of custom macros; all others are O-words."""


@dataclass(frozen=True)
class Statement:
    """One statement: its label (``O100`` is ``100``; of GOTO the target is in ``values``), what it is given, and what it assigns."""

    kind: Keyword
    label: str
    values: tuple[Expression, ...] = ()
    condition: Expression | None = None
    assignments: tuple[Assignment, ...] = ()


_OPENING = frozenset({Keyword.SUB, Keyword.IF, Keyword.WHILE, Keyword.REPEAT, Keyword.DO, Keyword.LOOP})
_CLOSING = frozenset({Keyword.END_SUB, Keyword.END_IF, Keyword.END_WHILE, Keyword.END_REPEAT, Keyword.LOOP_END})


def opens(statement: Statement) -> int:
    """Return 1 for a statement that opens something, -1 for one that closes it; WHILE behind DO is told apart only by ``structure``."""
    return int(statement.kind in _OPENING) - int(statement.kind in _CLOSING)


_O_KINDS = "ENDSUB|SUB|CALL|RETURN|ELSEIF|ENDIF|ELSE|IF|DO|ENDWHILE|WHILE|ENDREPEAT|REPEAT|BREAK|CONTINUE"
_O_WORD = re.compile(rf"O(?:(\d+)|<([^<>]+)>)({_O_KINDS})")
_MACRO = re.compile(r"IF(?=\[)|WHILE(?=\[)|GOTO|DO(?=[0-9])|END(?=[0-9])")
_LABEL = re.compile(r"[0-9]+")


def statement_at(code: str) -> Statement | None:
    """Return the statement that a compacted line without its N number is, or None; raises :class:`Fault`."""
    word = _O_WORD.match(code)
    if word is not None:
        label = word[1].lstrip("0") or "0" if word[1] is not None else word[2]
        values, rest = _values(code, word.end())
        _nothing_behind(code, rest)
        return Statement(Keyword(word[3]), label, tuple(values))
    macro = _MACRO.match(code)
    return None if macro is None else _macro(code, macro.group(), macro.end())


def _values(code: str, position: int) -> tuple[list[Expression], int]:
    values = []
    while code[position : position + 1] == "[":
        value, position = parse_value(code, position)
        values.append(value)
    return values, position


def _macro(code: str, word: str, position: int) -> Statement:
    if word == "GOTO":
        target, position = parse_value(code, position)
        _nothing_behind(code, position)
        return Statement(Keyword.GO_TO, "", (target,))
    if word in ("DO", "END"):
        return Statement(Keyword.LOOP if word == "DO" else Keyword.LOOP_END, _loop_label(code, position))
    condition, position = parse_value(code, position)
    if word == "WHILE":
        if not _stands(code, position, "DO"):
            raise Fault("WHILE has no DO behind its condition.", "Write it as WHILE [#1 LT 5] DO1, with END1 behind the loop.")
        return Statement(Keyword.LOOP, _loop_label(code, position + 2), condition=condition)
    if _stands(code, position, "GOTO"):
        target, position = parse_value(code, position + 4)
        _nothing_behind(code, position)
        return Statement(Keyword.GO_TO, "", (target,), condition)
    if not _stands(code, position, "THEN"):
        raise Fault("IF has neither GOTO nor THEN behind its condition.", "Write it as IF [#1 GT 5] GOTO 100.")
    position += 4
    assignments = []
    while code[position : position + 1] == "#":
        assignment, position = parse_assignment(code, position)
        assignments.append(assignment)
    _nothing_behind(code, position)
    return Statement(Keyword.IF_THEN, "", (), condition, tuple(assignments))


def _stands(code: str, position: int, word: str) -> bool:
    return code[position : position + len(word)] == word


def _loop_label(code: str, position: int) -> str:
    label = _LABEL.match(code, position)
    if label is None:
        raise Fault("DO has no number.", "Write DO1 and END1.")
    _nothing_behind(code, label.end())
    return label.group()


def _nothing_behind(code: str, position: int) -> None:
    if code[position:]:
        raise Fault(f"'{code[position : position + 12]}' stands behind the statement.", "Write it in a line of its own.")


_LOOPS = {Keyword.WHILE: Keyword.END_WHILE, Keyword.REPEAT: Keyword.END_REPEAT, Keyword.DO: Keyword.WHILE, Keyword.LOOP: Keyword.LOOP_END}
_CLOSED_BY = {Keyword.SUB: Keyword.END_SUB, Keyword.IF: Keyword.END_IF, **_LOOPS}


@dataclass
class Structure:
    """Places of blocks: ``partner`` of what opens or closes, ``branches`` of an IF, ``subs`` by label, ``loop_of`` each BREAK."""

    partner: dict[int, int] = field(default_factory=dict)
    branches: dict[int, list[int]] = field(default_factory=dict)
    subs: dict[str, int] = field(default_factory=dict)
    loop_of: dict[int, int] = field(default_factory=dict)


def structure(statements: Sequence[tuple[int, Statement]], line: Callable[[int], int]) -> Structure:
    """Return what belongs together among the statements of a program, each with the place of its block; ``line`` gives its line.

    Raises :class:`Fault` where something is closed that was not opened, or never closed.
    """
    found = Structure()
    stack: list[tuple[int, Statement]] = []
    for position, statement in statements:
        kind, label = statement.kind, statement.label
        top = stack[-1][1] if stack else None
        if kind is Keyword.WHILE and top is not None and top.kind is Keyword.DO and top.label == label:
            _close(found, stack, position)
        elif kind in _CLOSED_BY:
            if kind is Keyword.SUB:
                if any(open_.kind is Keyword.SUB for _, open_ in stack):
                    raise Fault(f"O{label} SUB stands inside another subprogram.", "Close that one first.", line(position))
                found.subs.setdefault(label, position)
            stack.append((position, statement))
            if kind is Keyword.IF:
                found.branches[position] = []
        elif kind in (Keyword.ELSE_IF, Keyword.ELSE):
            if top is None or top.kind is not Keyword.IF or top.label != label:
                raise _unopened(statement, line(position), top)
            found.branches[stack[-1][0]].append(position)
            found.partner[position] = stack[-1][0]
        elif kind in _CLOSED_BY.values():
            if top is None or _CLOSED_BY[top.kind] is not kind or top.label != label:
                raise _unopened(statement, line(position), top)
            if kind is Keyword.END_IF:
                found.branches[stack[-1][0]].append(position)
            _close(found, stack, position)
        elif kind in (Keyword.BREAK, Keyword.CONTINUE):
            loop = next((opened for opened, open_ in reversed(stack) if open_.kind in _LOOPS and open_.label == label), None)
            if loop is None:
                raise _unopened(statement, line(position), top)
            found.loop_of[position] = loop
    if stack:
        position, statement = stack[-1]
        remedy = f"Write {_shown(statement, _CLOSED_BY[statement.kind])} behind it."
        raise Fault(f"{_shown(statement)} is not closed.", remedy, line(position))
    return found


def _close(found: Structure, stack: list[tuple[int, Statement]], position: int) -> None:
    opened, _ = stack.pop()
    found.partner[opened] = position
    found.partner[position] = opened


def _shown(statement: Statement, kind: Keyword | None = None) -> str:
    kind = statement.kind if kind is None else kind
    if kind in (Keyword.LOOP, Keyword.LOOP_END):
        return f"{'DO' if kind is Keyword.LOOP else 'END'}{statement.label}"
    return f"O{statement.label} {kind}"


def _unopened(statement: Statement, line: int, top: Statement | None) -> Fault:
    inside = f"; {_shown(top)} is still open" if top is not None else ""
    return Fault(f"{_shown(statement)} closes or divides nothing that is open{inside}.", "Check the numbers of the statements.", line)
