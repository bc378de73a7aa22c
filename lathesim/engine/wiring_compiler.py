"""The wiring of a machine to LLVM text, statement by statement: numba takes four times as long for what has numbers only.

``run_block`` of a fused module assigns sums and products of floats, calls laws, and has a few loops and branches. These are written here
with the operations that numba writes for them, so the bits are its own; LLVM makes the same of both. Whatever else stands in an expression
(a power, a sine, a value of an array) is a function of its own that numba compiles once for all machines, as it does laws. A variable has
one type wherever it is assigned: a float, a whole number or a flag. A text with anything else is refused, and compiled by numba: see
:mod:`lathesim.engine.module_cache`. Imported only where something is compiled.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from llvmlite import ir
from numba import types
from numba.core.cgutils import alloca_once
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import cpu_target

from lathesim.engine.numba_compiler import TextLibrary, block_signature

_REAL, _WHOLE, _FLAG = types.float64, types.int64, types.boolean
_double, _int, _bit = ir.DoubleType(), ir.IntType(64), ir.IntType(1)
_SAME = {ast.Add: ("fadd", "add"), ast.Sub: ("fsub", "sub"), ast.Mult: ("fmul", "mul"), ast.Div: ("fdiv", "")}
"""Operators -> their instructions for floats and for whole numbers, which are divided as floats."""
_NO_WRAP = ("nsw",)
"""No whole number grows beyond what fits; loops become vectors as they do with numba, which says so too."""
_ORDER = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}


class NotWiringError(Exception):
    """A text has something that is not written here."""


@dataclass(frozen=True)
class _Value:
    """What an expression gives: its type for numba, and the number in LLVM, or the values of a tuple."""

    kind: Any
    number: Any


class WiringWriter:
    """Writes one ``run_block``.

    ``laws`` are compiled functions by their names, ``constants`` numbers; ``expressed`` returns an expression of some names compiled.
    """

    def __init__(self, laws: Mapping[str, Any], constants: Mapping[str, Any], expressed: Callable[[str, Sequence[str]], Any]) -> None:
        self.laws, self.constants, self.expressed = laws, constants, expressed
        self.context = cpu_target.target_context
        self.places: dict[str, _Value] = {}
        """Arguments, tuples and arrays, and where in memory each variable lies."""
        self.behind: list[Any] = []
        """The blocks behind the loops that are being written."""
        self.depth = 0
        """In how many loops and branches the text stands."""

    @global_compiler_lock  # type: ignore[untyped-decorator]
    def write(self, source: str, name: str) -> TextLibrary:
        """Return a library that holds ``run_block`` of a fused module's text, there called ``name``.

        Raises :class:`NotWiringError` and the errors of numba where a law cannot be compiled.
        """
        tree = ast.parse(source[source.index("def run_block(") :]).body[0]
        assert isinstance(tree, ast.FunctionDef)
        self.library, signature = TextLibrary(self.context.codegen(), name), block_signature()
        module = self.library.create_ir_module(name)
        function = ir.Function(module, self.context.call_conv.get_function_type(signature.return_type, signature.args), name)
        begin, body = (function.append_basic_block(block) for block in ("begin", "body"))  # variables are given room in the first
        self.builder = ir.IRBuilder(body)
        self.arguments = [argument.arg for argument in tree.args.args]
        for argument, kind, number in zip(self.arguments, signature.args, function.args[2:], strict=True):
            self.places[argument] = _Value(kind, number)
        self._body(tree.body)
        self.builder.position_at_end(begin)
        self.builder.branch(body)
        self.library.add_ir_module(module)
        self.library.finalize()
        return self.library

    # ---- statements -----------------------------------------------------------------------------------------------------------

    def _body(self, statements: Sequence[ast.stmt]) -> None:
        for statement in statements:
            if not self.builder.block.is_terminated:
                self._statement(statement)

    def _statement(self, statement: ast.stmt) -> None:
        match statement:
            case ast.Assign(targets=[target], value=value):
                self._assign(target, value)
            case ast.AugAssign(target=ast.Name(name) as target, op=op, value=value):
                self._assign(target, ast.BinOp(ast.Name(name, ast.Load()), op, value))
            case ast.Expr(ast.Call(ast.Name("put" | "keep"), [ast.Name(array), first, ast.Tuple(values)])):
                begin = self._at(array, first)
                for place, value in enumerate(values):
                    self.builder.store(self._as(_REAL, self._value(value)), self.builder.gep(begin, [_int(place)]))
            case ast.Expr(ast.Call() as call):
                self._value(call)
            case ast.If(test=test, body=body, orelse=other):
                self._branch(self._as(_FLAG, self._value(test)), lambda: self._body(body), lambda: self._body(other))
            case ast.For(target=target, iter=ast.Call(ast.Name("range"), [count]), body=body):
                with self._counted(self._as(_WHOLE, self._value(count))) as now:
                    self._give(target, _Value(_WHOLE, now))
                    self._body(body)
            case ast.For(target=target, iter=ast.Name(name), body=body):
                with self._row_by_row(self._read(name)) as row:
                    self._give(target, row)
                    self._body(body)
            case ast.Break():
                self.builder.branch(self.behind[-1])
            case ast.Return(value=ast.expr() as value):
                self.builder.store(self._as(_WHOLE, self._value(value)), self.builder.function.args[0])
                self.builder.ret(ir.IntType(32)(0))
            case ast.Pass():
                pass
            case _:
                raise NotWiringError

    def _assign(self, target: ast.expr, value: ast.expr) -> None:
        match target, value:
            case ast.Subscript(ast.Name(array), index), _:
                self.builder.store(self._as(_REAL, self._value(value)), self._at(array, index))
            case ast.Tuple(targets), ast.Call(ast.Name("take"), [ast.Name(array), first, ast.Constant()]):
                begin = self._at(array, first)
                for place, item in enumerate(targets):
                    self._give(item, _Value(_REAL, self.builder.load(self.builder.gep(begin, [_int(place)]))))
            case _:
                self._give(target, self._value(value))

    def _give(self, target: ast.expr, value: _Value) -> None:
        match target:
            case ast.Name(name):
                self._store(name, value)
            case ast.Tuple(targets) if isinstance(value.kind, types.BaseTuple) and len(targets) == len(value.kind):
                for item, part in zip(targets, self._parts(value), strict=True):
                    self._give(item, part)
            case _:
                raise NotWiringError

    def _parts(self, value: _Value) -> list[_Value]:
        """Return the values of a tuple."""
        if isinstance(value.number, list):
            return value.number
        return [_Value(types.unliteral(kind), self.builder.extract_value(value.number, place)) for place, kind in enumerate(value.kind)]

    def _store(self, name: str, value: _Value) -> None:
        known = self.places.get(name)
        if value.kind not in (_REAL, _WHOLE, _FLAG):
            if known or self.depth:  # tuples and arrays are bound once, before all else
                raise NotWiringError
            self.places[name] = value
            return
        if known is None:
            known = self.places[name] = _Value(value.kind, alloca_once(self.builder, value.number.type, name=name))
        if name in self.arguments:
            raise NotWiringError
        self.builder.store(self._as(known.kind, value), known.number)

    def _branch(self, test: Any, one: Callable[[], None], other: Callable[[], None]) -> None:
        """Write two sides of which one is run."""
        *sides, after = (self.builder.append_basic_block() for _ in range(3))
        self.builder.cbranch(test, *sides)
        self.depth += 1
        for block, write in zip(sides, (one, other), strict=True):
            self.builder.position_at_end(block)
            write()
            if not self.builder.block.is_terminated:
                self.builder.branch(after)
        self.depth -= 1
        self.builder.position_at_end(after)

    @contextmanager
    def _counted(self, count: Any) -> Iterator[Any]:
        """Write a loop around what is written within; its counter is given."""
        place = alloca_once(self.builder, _int)
        self.builder.store(_int(0), place)
        head, body, after = (self.builder.append_basic_block() for _ in range(3))
        self.builder.branch(head)
        self.builder.position_at_end(head)
        now = self.builder.load(place)
        self.builder.cbranch(self.builder.icmp_signed("<", now, count), body, after)
        self.builder.position_at_end(body)
        self.behind.append(after)
        self.depth += 1
        yield now
        self.depth -= 1
        self.behind.pop()
        if not self.builder.block.is_terminated:
            self.builder.store(self.builder.add(now, _int(1), flags=_NO_WRAP), place)
            self.builder.branch(head)
        self.builder.position_at_end(after)

    @contextmanager
    def _row_by_row(self, rows: _Value) -> Iterator[_Value]:
        """Write a loop over a tuple of tuples of floats, one column of them after the other in memory."""
        if not isinstance(rows.kind, types.BaseTuple) or not all(isinstance(kind, types.BaseTuple) for kind in rows.kind):
            raise NotWiringError
        table = [self._parts(row) for row in self._parts(rows)]
        columns = [alloca_once(self.builder, _double, len(table)) for _ in table[0]]
        for place, row in enumerate(table):
            for column, value in zip(columns, row, strict=True):
                self.builder.store(self._as(_REAL, value), self.builder.gep(column, [_int(place)]))
        with self._counted(_int(len(table))) as now:
            values = [_Value(_REAL, self.builder.load(self.builder.gep(column, [now]))) for column in columns]
            yield _Value(types.UniTuple(_REAL, len(values)), values)

    # ---- expressions ----------------------------------------------------------------------------------------------------------

    def _value(self, node: ast.expr) -> _Value:
        match node:
            case ast.Constant(given):
                return _constant(given)
            case ast.Attribute(ast.Name("math"), name):
                return _constant(getattr(math, name, None))
            case ast.Name(name):
                return self._read(name)
            case ast.Tuple(items):
                values = [self._value(item) for item in items]
                return _Value(types.Tuple([value.kind for value in values]), values)
            case ast.BinOp(left, op, right) if type(op) in _SAME:
                return self._same(*_SAME[type(op)], self._value(left), self._value(right))
            case ast.UnaryOp(ast.USub(), operand):
                value = self._value(operand)
                return self._same("fsub", "sub", _Value(_WHOLE, _int(0)) if value.kind is _WHOLE else _constant(-0.0), value)
            case ast.UnaryOp(ast.Not(), operand):
                return _Value(_FLAG, self.builder.not_(self._as(_FLAG, self._value(operand))))
            case ast.Compare(left, [op], [right]) if type(op) in _ORDER:
                return self._compared(_ORDER[type(op)], self._value(left), self._value(right))
            case ast.BoolOp(op, [first, *rest]):
                more = ast.BoolOp(op, rest) if len(rest) > 1 else rest[0]
                return self._chosen(first, *((more, ast.Constant(False)) if isinstance(op, ast.And) else (ast.Constant(True), more)))
            case ast.IfExp(test, one, other):
                return self._chosen(test, one, other)
            case ast.Subscript(ast.Name(array), index) if isinstance(self._read(array).kind, types.CPointer):
                return _Value(_REAL, self.builder.load(self._at(array, index)))
            case ast.Call(ast.Name("choose"), [test, one, other]):
                flag, sides = self._as(_FLAG, self._value(test)), [self._value(one), self._value(other)]
                kind = _WHOLE if all(side.kind is _WHOLE for side in sides) else _REAL
                return _Value(kind, self.builder.select(flag, *(self._as(kind, side) for side in sides)))
            case ast.Call(ast.Name(name), arguments) if name in self.laws:
                return self._called(self.laws[name], [self._value(item) for item in arguments])
        return self._expressed(node)

    def _read(self, name: str) -> _Value:
        found = self.places.get(name)
        if found is None:
            return _constant(self.constants.get(name))
        if name in self.arguments or found.kind not in (_REAL, _WHOLE, _FLAG):
            return found
        return _Value(found.kind, self.builder.load(found.number))

    def _at(self, array: str, index: ast.expr) -> Any:
        """Return the address of a number of an array of which only the address is given."""
        given = self._read(array)
        if not isinstance(given.kind, types.CPointer):
            raise NotWiringError
        return self.builder.gep(given.number, [self._as(_WHOLE, self._value(index))])

    def _as(self, kind: Any, value: _Value) -> Any:
        """Return the number of a value of some kind; a whole number may be a float."""
        if value.kind is kind:
            return value.number
        if (kind, value.kind) != (_REAL, _WHOLE):
            raise NotWiringError
        return self.builder.sitofp(value.number, _double)

    def _same(self, real: str, whole: str, left: _Value, right: _Value) -> _Value:
        if whole and left.kind is right.kind is _WHOLE:
            return _Value(_WHOLE, getattr(self.builder, whole)(left.number, right.number, flags=_NO_WRAP))
        return _Value(_REAL, getattr(self.builder, real)(self._as(_REAL, left), self._as(_REAL, right)))

    def _compared(self, sign: str, left: _Value, right: _Value) -> _Value:
        if left.kind is right.kind is _WHOLE:
            return _Value(_FLAG, self.builder.icmp_signed(sign, left.number, right.number))
        compare = self.builder.fcmp_unordered if sign == "!=" else self.builder.fcmp_ordered
        return _Value(_FLAG, compare(sign, self._as(_REAL, left), self._as(_REAL, right)))

    def _chosen(self, test: ast.expr, one: ast.expr, other: ast.expr) -> _Value:
        """Return one value or the other, of which only one is computed."""
        found: list[tuple[_Value, Any]] = []

        def side(node: ast.expr) -> Callable[[], None]:
            return lambda: found.append((self._value(node), self.builder.block))

        self._branch(self._as(_FLAG, self._value(test)), side(one), side(other))
        kind = found[0][0].kind
        if kind not in (_REAL, _WHOLE, _FLAG) or kind is not found[1][0].kind:
            raise NotWiringError
        number = self.builder.phi(found[0][0].number.type)
        for value, block in found:
            number.add_incoming(value.number, block)
        return _Value(kind, number)

    def _expressed(self, node: ast.expr) -> _Value:
        """Return what is not written here, as a function of what it is made of; its constants stay, as a power of two is a product."""
        given: dict[str, _Value] = {}

        def argument(part: ast.expr) -> ast.expr:
            if isinstance(part, ast.Constant):
                return part
            name = f"given_{len(given)}"
            given[name] = self._value(part)
            return ast.Name(name, ast.Load())

        made: ast.expr
        match node:
            case ast.Call(
                ast.Attribute(ast.Name("math")) | ast.Name("abs" | "min" | "max" | "int" | "float" | "len") as name, arguments, []
            ):
                made = ast.Call(name, [argument(item) for item in arguments], [])
            case ast.BinOp(left, op, right):
                made = ast.BinOp(argument(left), op, argument(right))
            case ast.Subscript(array, index):
                made = ast.Subscript(argument(array), argument(index), ast.Load())
            case ast.Compare(left, ops, others):
                made = ast.Compare(argument(left), ops, [argument(item) for item in others])
            case _:
                raise NotWiringError
        return self._called(self.expressed(ast.unparse(made), tuple(given)), list(given.values()))

    def _called(self, function: Any, given: Sequence[_Value]) -> _Value:
        """Return what a compiled function gives; where it raises, so does the machine."""
        kinds = tuple(value.kind for value in given)
        function.compile(kinds)
        found = function.overloads.get(kinds)
        if found is None:
            raise NotWiringError
        self.library.add_linking_library(found.library)
        numbers = [value.number for value in given]
        status, result = self.context.call_internal_no_propagate(self.builder, found.fndesc, found.signature, numbers)
        with self.builder.if_then(status.is_error, likely=False):
            self.builder.store(status.excinfoptr, self.builder.function.args[1])
            self.builder.ret(status.code)
        return _Value(types.unliteral(found.signature.return_type), result)


def _constant(value: Any) -> _Value:
    match value:
        case bool():
            return _Value(_FLAG, _bit(int(value)))
        case int():
            return _Value(_WHOLE, _int(value))
        case float():
            return _Value(_REAL, _double(value))
    raise NotWiringError
