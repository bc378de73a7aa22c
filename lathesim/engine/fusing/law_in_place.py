"""A law's body written where it is called: its ``return`` becomes assignments, and what follows an early one stands in an ``else``.

Plain Python pays for a call of a law about what ten additions cost, and for every output that nobody reads; machine code is the same
either way. A body is written in place where it is nothing but assignments, branches and counted loops that do not return from within.
"""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence
from typing import TypeGuard

_STATEMENTS = (ast.Assign, ast.AugAssign, ast.If, ast.For, ast.Break, ast.Continue, ast.Pass, ast.Return)
_EXPRESSIONS = (
    ast.Name, ast.Constant, ast.BinOp, ast.UnaryOp, ast.BoolOp, ast.Compare, ast.IfExp, ast.Call, ast.Attribute, ast.Subscript, ast.Tuple,
)  # fmt: skip
"""What machine code can be made of: a law with anything else is called, so that it can be named when the compiler refuses it."""


def body_in_place(source: str, arguments: Mapping[str, str], targets: Sequence[str], prefix: str) -> list[str] | None:
    """Return the lines that do what the law does, none where it has to be called.

    ``source`` is the ``def`` of the law, ``arguments`` the variable for each of its arguments, ``targets`` the variables that take what it
    returns. Variables of its own get ``prefix`` before their names, or the name of the target that they end in.
    """
    tree = ast.parse(source).body[0]
    if not isinstance(tree, ast.FunctionDef) or {argument.arg for argument in tree.args.args} != arguments.keys():
        return None
    nodes = [node for statement in tree.body for node in ast.walk(statement)]
    if any(isinstance(node, (ast.stmt, ast.expr)) and not isinstance(node, (*_STATEMENTS, *_EXPRESSIONS)) for node in nodes):
        return None
    values = [_returned(node) for node in nodes if isinstance(node, ast.Return)]
    if any(len(given) != len(targets) for given in values):
        return None
    own = {node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
    begin = [f"{prefix}{name} = {arguments[name]}" for name in sorted(own & arguments.keys())]
    free = ["" if target in arguments.values() else target for target in targets]  # the law may still read what it replaces
    found = _named_for(values, free, own - arguments.keys())
    names = {**arguments, **{name: f"{prefix}{name}" for name in own}, **found}
    for node in nodes:
        if isinstance(node, ast.Name):
            node.id = names.get(node.id, node.id)
    body = _to_the_end(tree.body, targets)
    return None if body is None else [*begin, *(line for statement in body for line in ast.unparse(statement).splitlines())]


def _returned(statement: ast.Return) -> list[ast.expr]:
    return list(statement.value.elts) if isinstance(statement.value, ast.Tuple) else [statement.value] if statement.value else []


def _named_for(values: list[list[ast.expr]], targets: Sequence[str], own: set[str]) -> dict[str, str]:
    """Return the variables that are returned in one place only, and no other variable there, with the name of the target of that place."""
    places: dict[str, set[int]] = {}
    for given in values:
        for place, value in enumerate(given):
            if isinstance(value, ast.Name) and value.id in own:
                places.setdefault(value.id, set()).add(place)
    alone = {name: place for name, found in places.items() for place in found if len(found) == 1}
    return {name: targets[place] for name, place in alone.items() if targets[place] and list(alone.values()).count(place) == 1}


def _to_the_end(statements: list[ast.stmt], targets: Sequence[str]) -> list[ast.stmt] | None:
    """Return statements that end with the targets assigned instead of returning, none where the way to the end is not that plain."""
    done: list[ast.stmt] = []
    for place, statement in enumerate(statements):
        if isinstance(statement, ast.Return):
            return done + _assignments(statement, targets)
        if not any(isinstance(node, ast.Return) for node in ast.walk(statement)):
            done.append(statement)
            continue
        if not isinstance(statement, ast.If):
            return None
        rest = statements[place + 1 :]
        if _always_returns(statement.body):
            body, other = _to_the_end(statement.body, targets), _to_the_end([*statement.orelse, *rest], targets)
        elif _always_returns(statement.orelse):
            body, other = _to_the_end([*statement.body, *rest], targets), _to_the_end(statement.orelse, targets)
        else:
            return None
        if body is None or other is None:
            return None
        return [*done, ast.If(statement.test, body or [ast.Pass()], other)]
    return None


def _always_returns(statements: list[ast.stmt]) -> bool:
    last = statements[-1] if statements else None
    return isinstance(last, ast.Return) or (isinstance(last, ast.If) and _always_returns(last.body) and _always_returns(last.orelse))


def _assignments(statement: ast.Return, targets: Sequence[str]) -> list[ast.stmt]:
    """Return one assignment for each target, all at once where one would change what another still reads."""
    pairs = [(target, value) for target, value in zip(targets, _returned(statement), strict=True) if not _is_name(value, target)]
    taken: set[str] = set()
    for target, value in pairs:
        if any(isinstance(node, ast.Name) and node.id in taken for node in ast.walk(value)):
            together = (", ".join(target for target, _ in pairs), ", ".join(ast.unparse(value) for _, value in pairs))
            return ast.parse(" = ".join(together)).body
        taken.add(target)
    return [ast.parse(f"{target} = {ast.unparse(value)}").body[0] for target, value in pairs]


def _is_name(value: ast.expr, name: str) -> TypeGuard[ast.Name]:
    return isinstance(value, ast.Name) and value.id == name
