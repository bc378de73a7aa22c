"""How machine code reaches its arrays: ``vector``, ``matrix``, ``take`` and ``put`` of a fused module, compiled.

Machine code is given one directory of addresses for memories, one for tables and one for noise: address, rows and columns of each array.
Imported only where something is compiled.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba
from numba import types
from numba.extending import intrinsic


@intrinsic  # type: ignore[untyped-decorator]
def _pointer(typing_context: Any, address: Any) -> Any:
    """Return the pointer to 64-bit floats that an address is."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.inttoptr(arguments[0], context.get_value_type(signature.return_type))

    return types.CPointer(types.float64)(types.int64), generate


@numba.njit(error_model="numpy", boundscheck=False, no_cpython_wrapper=True, no_cfunc_wrapper=True)  # type: ignore[untyped-decorator]
def vector(directory: Any, position: Any) -> Any:
    """Return one array of numbers."""
    return numba.carray(_pointer(directory[3 * position]), (directory[3 * position + 1],))


@numba.njit(error_model="numpy", boundscheck=False, no_cpython_wrapper=True, no_cfunc_wrapper=True)  # type: ignore[untyped-decorator]
def matrix(directory: Any, position: Any) -> Any:
    """Return one array of rows."""
    return numba.carray(_pointer(directory[3 * position]), (directory[3 * position + 1], directory[3 * position + 2]))


@intrinsic(prefer_literal=True)  # type: ignore[untyped-decorator]
def take(typing_context: Any, numbers: Any, first: Any, count: Any) -> Any:
    """Return some numbers as a tuple; how many must be written as a number."""
    given = types.UniTuple(types.float64, count.literal_value)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        begin = builder.gep(arguments[0], [arguments[1]])
        values = [builder.load(builder.gep(begin, [context.get_constant(types.intp, place)])) for place in range(count.literal_value)]
        return context.make_tuple(builder, signature.return_type, values)

    return given(numbers, types.intp, count), generate


@intrinsic  # type: ignore[untyped-decorator]
def put(typing_context: Any, numbers: Any, first: Any, given: Any) -> Any:
    """Write a tuple of numbers."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        begin = builder.gep(arguments[0], [arguments[1]])
        for place, kind in enumerate(signature.args[2]):
            value = context.cast(builder, builder.extract_value(arguments[2], place), kind, types.float64)
            builder.store(value, builder.gep(begin, [context.get_constant(types.intp, place)]))
        return context.get_dummy_value()

    return types.none(numbers, types.intp, given), generate


@intrinsic  # type: ignore[untyped-decorator]
def choose(typing_context: Any, test: Any, one: Any, other: Any) -> Any:
    """Return one number or the other, both of which are there: a selection is no branch, and may be one of vectors."""
    kinds = {types.unliteral(one), types.unliteral(other)}
    kind = kinds.pop() if len(kinds) == 1 else types.float64

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        values = [context.cast(builder, value, given, kind) for value, given in zip(arguments[1:], signature.args[1:], strict=True)]
        return builder.select(context.cast(builder, arguments[0], signature.args[0], types.boolean), *values)

    return kind(test, one, other), generate


def _on_bits(generate: Callable[..., Any]) -> Any:
    """Return a function of one number that works on its bits."""

    def typed(typing_context: Any, number: Any) -> Any:
        def generated(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            whole, real = (context.get_value_type(kind) for kind in (types.int64, types.float64))
            value = context.cast(builder, arguments[0], number, types.float64)
            return generate(builder, value, whole, real)

        return types.float64(number), generated

    return intrinsic(typed)


def _two(builder: Any, power: Any, whole: Any, real: Any) -> Any:
    """The sum with 2^52 + 1023 has the exponent's bits last."""
    bits = builder.bitcast(builder.fadd(power, real(2.0**52 + 1023.0)), whole)
    return builder.bitcast(builder.shl(bits, whole(52)), real)


def _exponent(builder: Any, number: Any, whole: Any, real: Any) -> Any:
    bits = builder.and_(builder.lshr(builder.bitcast(number, whole), whole(52)), whole(0x7FF))
    return builder.fsub(builder.bitcast(builder.or_(bits, whole(0x433 << 52)), real), real(2.0**52 + 1022.0))


def _mantissa(builder: Any, number: Any, whole: Any, real: Any) -> Any:
    bits = builder.and_(builder.bitcast(number, whole), whole((1 << 52) - 1))
    return builder.bitcast(builder.or_(bits, whole(0x3FE << 52)), real)


two, exponent, mantissa = _on_bits(_two), _on_bits(_exponent), _on_bits(_mantissa)


@numba.njit(error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)  # type: ignore[untyped-decorator]
def _parts(number: Any) -> Any:
    return mantissa(number), exponent(number)


_ACCESS = {"vector": vector, "matrix": matrix, "take": take, "put": put, "keep": put}
GIVEN = {**_ACCESS, "choose": choose, "mantissa": mantissa, "exponent": exponent}
"""What a compiled module takes in place of its own functions of these names."""
BITS = {"elementary_two": two, "elementary_parts": _parts}
"""What stands for the functions of :mod:`lathesim.elementary` of these names; they are given positive normal numbers."""


def block_signature() -> Any:
    """Return the types of the arguments of ``run_block``: the same for every machine."""
    numbers, directory = types.CPointer(types.float64), types.CPointer(types.int64)
    scalars = (types.int64, types.int64, types.float64, types.float64, types.int64)
    return types.int64(*scalars, numbers, numbers, numbers, directory, directory, directory, numbers)
