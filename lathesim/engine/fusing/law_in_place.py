"""A law's body written where it is called: its ``return`` becomes assignments, and what follows an early one stands in an ``else``."""

from __future__ import annotations

import ast
import copy
from collections.abc import Collection, Mapping, Sequence


class NotInPlaceError(Exception):
    """A law has to be called as it is: because of ``line`` of the function ``law``, counted from its ``def``."""

    law = ""

    def __init__(self, line: int = 0) -> None:
        super().__init__()
        self.line = line


def in_place(law: ast.FunctionDef, arguments: Sequence[ast.expr], targets: Sequence[str], prefix: str) -> list[ast.stmt]:
    """Return the statements that assign to ``targets`` what a law returns.

    Variables of its own get ``prefix`` before their names. Raises :class:`NotInPlaceError`.
    """
    stored = stored_names(*law.body)
    names = {name: prefix + name for name in stored}
    begin: list[ast.stmt] = []
    for argument, value in zip(law.args.args, arguments, strict=True):
        if isinstance(value, ast.Name) and argument.arg not in stored:
            names[argument.arg] = value.id
        else:
            names[argument.arg] = prefix + argument.arg
            begin += _assigned([prefix + argument.arg], value)
    body = [Renamed(names).visit(copy.deepcopy(statement)) for statement in law.body]
    return [*begin, *_to_the_end(body, targets)]


def read_names(*trees: ast.AST) -> list[str]:
    """Return the variables that trees read."""
    every = [node for tree in trees for node in ast.walk(tree)]
    found = [node.id for node in every if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)]
    return found + [node.target.id for node in every if isinstance(node, ast.AugAssign) and isinstance(node.target, ast.Name)]


def stored_names(*trees: ast.AST) -> list[str]:
    """Return the variables that trees assign."""
    if len(trees) == 1 and isinstance(tree := trees[0], ast.Assign) and isinstance(tree.targets[0], ast.Name):
        return [tree.targets[0].id]  # most are of this kind, and to walk through their values takes most of the time of writing for lanes
    every = [node for tree in trees for node in ast.walk(tree)]
    return [node.id for node in every if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)]


class Renamed(ast.NodeTransformer):
    """Gives variables other names."""

    def __init__(self, names: Mapping[str, str]) -> None:
        self.names = names

    def visit_Name(self, node: ast.Name) -> ast.AST:
        """Return the variable under its new name."""
        return ast.Name(self.names.get(node.id, node.id), node.ctx)


def _to_the_end(statements: Sequence[ast.stmt], targets: Sequence[str]) -> list[ast.stmt]:
    for place, statement in enumerate(statements):
        before, rest = list(statements[:place]), statements[place + 1 :]
        match statement:
            case ast.Return(value=value):
                return [*before, *_assigned(targets, value, statement.lineno)]
            case ast.If(test=test, body=body, orelse=other) if _returns(statement):
                sides = [_to_the_end(side if _always_returns(side) else [*side, *rest], targets) for side in (body, other)]
                return [*before, ast.copy_location(ast.If(test, sides[0] or [ast.Pass()], sides[1]), statement)]
            case _ if _returns(statement):
                raise NotInPlaceError(statement.lineno)
    if targets:
        raise NotInPlaceError
    return list(statements)


def _assigned(targets: Sequence[str], value: ast.expr | None, line: int = 0) -> list[ast.stmt]:
    """Return one assignment for each target, one for all where a value reads what another replaces."""
    names: list[ast.expr] = [ast.Name(target, ast.Store()) for target in targets]
    if len(targets) == 1 and not isinstance(value, ast.Tuple):
        return [ast.Assign(names, value or ast.Constant(None), lineno=line)]
    if isinstance(value, ast.Tuple) and _independent(targets, value.elts):
        return [ast.Assign([name], item, lineno=line) for name, item in zip(names, value.elts, strict=True)]
    return [ast.Assign([ast.Tuple(names, ast.Store())], value or ast.Tuple([], ast.Load()), lineno=line)]


def _independent(targets: Collection[str], values: Sequence[ast.expr]) -> bool:
    return len(targets) == len(values) and set(targets).isdisjoint(read_names(*values))


def _returns(statement: ast.stmt) -> bool:
    return any(isinstance(node, ast.Return) for node in ast.walk(statement))


def _always_returns(statements: list[ast.stmt]) -> bool:
    last = statements[-1] if statements else None
    return isinstance(last, ast.Return) or (isinstance(last, ast.If) and _always_returns(last.body) and _always_returns(last.orelse))
