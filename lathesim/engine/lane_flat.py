"""Laws and wiring as assignments to one variable each, without branches and calls: what a loop over lanes can be made of.

Both sides of a branch are computed and ``choose`` takes one, so that every lane goes the same way. A law stands in place of its call, and
what follows an early ``return`` in an ``else``. What cannot be written so is refused with its line, as a loop or an array.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from lathesim.engine.law_text import LawLibrary, NotInPlaceError, Renamed, in_place, source_line, stored_names

_VECTOR_MATH = frozenset({"sqrt", "fabs", "copysign", "floor", "ceil", "isnan", "isinf", "isfinite"})
"""Functions of ``math`` that are instructions of a processor, also for vectors."""
_BUILT_IN = frozenset({"abs", "min", "max", "float", "int", "bool", "choose"})
_BITS = frozenset({"elementary_two", "mantissa", "exponent"})
"""Functions on the bits of a number that are a few instructions."""
_PARTS = "def elementary_parts(number):\n    return mantissa(number), exponent(number)"

Pair = tuple[str, ast.expr]
"""A variable and its value."""


def refusal(function: Callable[..., Any]) -> str:
    """Return ``file:line: text`` of what keeps a law from being written for lanes, empty where nothing does."""
    library = LawLibrary()
    name = library.add(function, "law")
    functions = functions_of("\n".join(library.blocks))
    law = functions[name]
    arguments = [argument.arg for argument in law.args.args]
    targets = [f"target_{place}" for place in range(_returned(law, functions))]
    try:
        Flattener(functions, arguments, ()).flat(ast.parse(f"{', '.join(targets)} = {name}({', '.join(arguments)})").body[0])
    except NotInPlaceError as error:
        return source_line(library.function(error.law or name), error.line)
    return ""


def functions_of(text: str) -> dict[str, ast.FunctionDef]:
    """Return the functions of a text by name."""
    return {item.name: item for item in ast.parse(text).body if isinstance(item, ast.FunctionDef)}


def _returned(law: ast.FunctionDef, functions: Mapping[str, ast.FunctionDef]) -> int:
    """Return how many values a law gives."""
    value = next(node.value for node in ast.walk(law) if isinstance(node, ast.Return))
    if isinstance(value, ast.Call) and isinstance(value.func, ast.Name) and value.func.id in functions:
        return _returned(functions[value.func.id], functions)
    return len(value.elts) if isinstance(value, ast.Tuple) else 1


def name_of(name: str) -> ast.Name:
    """Return the expression that reads a variable."""
    return ast.Name(name, ast.Load())


def calls(statement: ast.stmt) -> bool:
    """Return whether an assignment calls a function that has no vectors, or reads an array."""
    match statement:
        case ast.Assign(value=ast.Call() as call):
            return not _is_vector(call)
        case ast.Assign(value=ast.Subscript()):
            return True
    return False


def _is_vector(call: ast.Call) -> bool:
    return isinstance(call.func, ast.Name) or (isinstance(call.func, ast.Attribute) and call.func.attr in _VECTOR_MATH)


class Flattener:
    """Flattens statements one after the other; ``known`` are the variables that have a value, ``bools`` those that hold a truth value."""

    def __init__(self, functions: Mapping[str, ast.FunctionDef], known: Iterable[str], bools: Iterable[str]) -> None:
        self.functions = {**functions, **functions_of(_PARTS)}
        self.known = set(known)
        self.bools = set(bools)
        self.count = 0

    def flat(self, statement: ast.stmt) -> list[Pair]:
        """Return what a statement assigns, in order. Raises :class:`NotInPlaceError`, and is then as it was before."""
        before = (set(self.known), set(self.bools))
        try:
            return self._flat([statement])
        except NotInPlaceError:
            self.known, self.bools = before
            raise

    def _flat(self, statements: Iterable[ast.stmt]) -> list[Pair]:
        made: list[Pair] = []
        for statement in statements:
            try:
                self._add(made, statement)
            except NotInPlaceError as error:
                error.line = error.line or statement.lineno
                raise
        return made

    def _add(self, made: list[Pair], statement: ast.stmt) -> None:
        match statement:
            case ast.Pass():
                pass
            case ast.Assign(targets=[ast.Name(id=name)], value=value):
                self._assign(made, name, value)
            case ast.AugAssign(target=ast.Name(id=name), op=how, value=value):
                self._assign(made, name, ast.BinOp(name_of(name), how, value))
            case ast.Assign(targets=[ast.Tuple(elts=targets)], value=ast.Tuple(elts=values)) if len(targets) == len(values):
                names = [self._new("given") for _ in targets]
                for name, value in zip(names, values, strict=True):
                    self._assign(made, name, value)
                for target, name in zip(targets, names, strict=True):
                    self._put(made, ast.unparse(target), name_of(name))
            case ast.Assign(targets=[ast.Tuple(elts=targets)], value=ast.Call(func=ast.Name()) as call):
                self._law(made, call, [ast.unparse(target) for target in targets])
            case ast.If():
                self._branch(made, statement)
            case _:
                raise NotInPlaceError

    def _new(self, what: str) -> str:
        self.count += 1
        return f"lane_{what}_{self.count}"

    def _put(self, made: list[Pair], name: str, value: ast.expr) -> None:
        if not _is_bool(value, self.bools):
            if name in self.bools:
                raise NotInPlaceError  # a truth value before
        elif name in self.known - self.bools:
            value = ast.Call(name_of("choose"), [value, ast.Constant(1.0), ast.Constant(0.0)], [])
        else:
            self.bools.add(name)
        self.known.add(name)
        made.append((name, value))

    def _assign(self, made: list[Pair], name: str, value: ast.expr) -> None:
        if isinstance(value, ast.Call) and isinstance(value.func, ast.Name) and value.func.id in self.functions.keys() - _BITS:
            self._law(made, value, [name])
        else:
            self._put(made, name, self._value(made, value))

    def _law(self, made: list[Pair], call: ast.Call, targets: list[str]) -> None:
        """Write a law in place of its call."""
        assert isinstance(call.func, ast.Name)
        law = self.functions.get(call.func.id)
        if law is None:
            raise NotInPlaceError
        self.count += 1
        try:
            made += self._flat(in_place(law, call.args, targets, f"lane_{self.count}_"))
        except NotInPlaceError as error:
            if not error.law:
                error.law, error.line = law.name, max(0, error.line - law.lineno)
            raise

    def _branch(self, made: list[Pair], statement: ast.If) -> None:
        """Write both branches, one after the other under names of their own, and the selections between them."""
        test = self._truth(self._value(made, statement.test))
        if not isinstance(test, ast.Name) or test.id in stored_names(*statement.body, *statement.orelse):
            name = self._new("test")
            self._put(made, name, test)
            test = name_of(name)
        known = set(self.known)
        branches = []
        for body in (statement.body, statement.orelse):
            self.known = set(known)
            branches.append(self._flat(body))
        stored = [{name for name, _ in branch} for branch in branches]
        selected = (stored[0] & stored[1]) | ((stored[0] | stored[1]) & known)
        sides: list[dict[str, str]] = []
        for branch in branches:
            names: dict[str, str] = {}
            for name, value in branch:
                given = Renamed(names).visit(value)
                if name in selected:
                    names[name] = self._new("side")
                self._put(made, names.get(name, name), given)
            sides.append(names)
        self.known = known | stored[0] | stored[1]
        for name in dict.fromkeys([*sides[0], *sides[1]]):
            one, other = (name_of(side.get(name, name)) for side in sides)
            self._put(made, name, ast.Call(name_of("choose"), [test, one, other], []))

    def _truth(self, value: ast.expr) -> ast.expr:
        return value if _is_bool(value, self.bools) else ast.Compare(value, [ast.NotEq()], [ast.Constant(0.0)])

    def _value(self, made: list[Pair], node: ast.expr) -> ast.expr:
        """Return an expression without branches, with variables in the place of what is called."""
        match node:
            case ast.Name() | ast.Constant() | ast.Attribute():
                return node
            case ast.Subscript(slice=ast.Name(id="sample")):
                name = self._new("chance")
                self._put(made, name, node)
                return name_of(name)
            case ast.BinOp(left=left, op=how, right=right):
                return ast.BinOp(self._value(made, left), how, self._value(made, right))
            case ast.UnaryOp(op=how, operand=operand):
                return ast.UnaryOp(how, self._value(made, operand))
            case ast.Compare(left=left, ops=how, comparators=others):
                values = [self._value(made, value) for value in (left, *others)]
                pairs: list[ast.expr] = [ast.Compare(one, [how[place]], [values[place + 1]]) for place, one in enumerate(values[:-1])]
                return _joined(ast.BitAnd(), pairs)
            case ast.BoolOp(op=how, values=values):
                truths = [self._value(made, value) for value in values]
                if not all(_is_bool(value, self.bools) for value in truths):
                    raise NotInPlaceError
                return _joined(ast.BitAnd() if isinstance(how, ast.And) else ast.BitOr(), truths)
            case ast.IfExp(test=test, body=body, orelse=other):
                chosen = self._truth(self._value(made, test))
                return ast.Call(name_of("choose"), [chosen, self._value(made, body), self._value(made, other)], [])
            case ast.Call(func=ast.Name(id=name)) if name in _BUILT_IN | _BITS:
                return ast.Call(node.func, [self._value(made, value) for value in node.args], [])
            case ast.Call(func=ast.Attribute()):
                call = ast.Call(node.func, [self._value(made, value) for value in node.args], [])
                if _is_vector(call):
                    return call
                for place, value in enumerate(call.args):
                    if not isinstance(value, (ast.Name, ast.Constant)):
                        call.args[place] = name_of(self._new("given"))
                        self._put(made, ast.unparse(call.args[place]), value)
                name = self._new("value")
                self._put(made, name, call)
                return name_of(name)
            case ast.Call(func=ast.Name()):
                name = self._new("value")
                self._law(made, node, [name])
                return name_of(name)
        raise NotInPlaceError


def _joined(how: ast.operator, values: list[ast.expr]) -> ast.expr:
    made = values[0]
    for value in values[1:]:
        made = ast.BinOp(made, how, value)
    return made


def _is_bool(value: ast.expr, bools: set[str]) -> bool:
    match value:
        case ast.Compare() | ast.Constant(value=True | False) | ast.UnaryOp(op=ast.Not()) | ast.Call(func=ast.Name(id="bool")):
            return not isinstance(value, ast.Constant) or isinstance(value.value, bool)
        case ast.Call(func=ast.Attribute(attr="isnan" | "isinf" | "isfinite")):
            return True
        case ast.BinOp(left=left, op=ast.BitAnd() | ast.BitOr(), right=right):
            return _is_bool(left, bools) and _is_bool(right, bools)
        case ast.BoolOp(values=values):
            return all(_is_bool(item, bools) for item in values)
        case ast.Name(id=name):
            return name in bools
        case ast.Call(func=ast.Name(id="choose"), args=[_, one, other]):
            return _is_bool(one, bools) and _is_bool(other, bools)
    return False
