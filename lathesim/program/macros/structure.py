"""Which statements belong together: IF to ENDIF, loops to their ends, subprograms by name, and N numbers to go to."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from lathesim.errors import ProgramError
from lathesim.program.macros.statements import Kind, Statement

_LOOPS = {Kind.WHILE: Kind.END_WHILE, Kind.REPEAT: Kind.END_REPEAT, Kind.DO: Kind.WHILE, Kind.LOOP: Kind.LOOP_END}
_OPENING = {Kind.SUB: Kind.END_SUB, Kind.IF: Kind.END_IF, **_LOOPS}


@dataclass
class Structure:
    """Places of blocks: ``partner`` of what opens or closes, ``branches`` of an IF, ``subs`` by label, ``loop_of`` each BREAK."""

    partner: dict[int, int] = field(default_factory=dict)
    branches: dict[int, list[int]] = field(default_factory=dict)
    subs: dict[str, int] = field(default_factory=dict)
    loop_of: dict[int, int] = field(default_factory=dict)


def structure(statements: Sequence[tuple[int, Statement]], place: Callable[[int], str]) -> Structure:
    """Return what belongs together among the statements of a program, each with the place of its block.

    Raises :class:`ProgramError` where something is closed that was not opened, or never closed.
    """
    found = Structure()
    stack: list[tuple[int, Statement]] = []
    for position, statement in statements:
        kind, label = statement.kind, statement.label
        top = stack[-1][1] if stack else None
        if kind is Kind.WHILE and top is not None and top.kind is Kind.DO and top.label == label:
            _close(found, stack, position)
        elif kind in _OPENING:
            if kind is Kind.SUB:
                if any(open_.kind is Kind.SUB for _, open_ in stack):
                    raise ProgramError(
                        f"O{label} SUB stands inside another subprogram.", place=place(position), remedy="Close that one first."
                    )
                found.subs.setdefault(label, position)
            stack.append((position, statement))
            if kind is Kind.IF:
                found.branches[position] = []
        elif kind in (Kind.ELSE_IF, Kind.ELSE):
            if top is None or top.kind is not Kind.IF or top.label != label:
                raise _unopened(statement, place(position), top)
            found.branches[stack[-1][0]].append(position)
            found.partner[position] = stack[-1][0]
        elif kind in _OPENING.values():
            if top is None or _OPENING[top.kind] is not kind or top.label != label:
                raise _unopened(statement, place(position), top)
            if kind is Kind.END_IF:
                found.branches[stack[-1][0]].append(position)
            _close(found, stack, position)
        elif kind in (Kind.BREAK, Kind.CONTINUE):
            loop = next((opened for opened, open_ in reversed(stack) if open_.kind in _LOOPS and open_.label == label), None)
            if loop is None:
                raise _unopened(statement, place(position), top)
            found.loop_of[position] = loop
    if stack:
        position, statement = stack[-1]
        raise ProgramError(
            f"{_shown(statement)} is not closed.",
            place=place(position),
            remedy=f"Write {_shown(statement, _OPENING[statement.kind])} behind it.",
        )
    return found


def _close(found: Structure, stack: list[tuple[int, Statement]], position: int) -> None:
    opened, _ = stack.pop()
    found.partner[opened] = position
    found.partner[position] = opened


def _shown(statement: Statement, kind: Kind | None = None) -> str:
    kind = statement.kind if kind is None else kind
    if kind in (Kind.LOOP, Kind.LOOP_END):
        return f"{'DO' if kind is Kind.LOOP else 'END'}{statement.label}"
    return f"O{statement.label} {kind}"


def _unopened(statement: Statement, place: str, top: Statement | None) -> ProgramError:
    inside = f"; {_shown(top)} is still open" if top is not None else ""
    return ProgramError(
        f"{_shown(statement)} closes or divides nothing that is open{inside}.", place=place, remedy="Check the numbers of the statements."
    )
