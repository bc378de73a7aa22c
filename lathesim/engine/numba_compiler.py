"""What numba compiles with: access to arrays, the compiler of ``run_block``, and the cache of laws.

How machine code reaches its arrays: ``vector``, ``matrix``, ``take`` and ``put`` of a fused module, compiled.

Machine code is given one directory of addresses for memories, one for tables and one for noise: address, rows and columns of each array.
Imported only where something is compiled.

The compiler of ``run_block``: numba's own, without the passes that a wiring has no need of and that cost it more than half of the time.

Left out are those that give every assignment a variable of its own and take that back, which go through the whole function once for each
variable that is assigned twice; those that look for closures, for expressions of whole arrays and for texts of Python to be written
otherwise, of which a wiring has none; and the first search for where each variable is last read, made once more before the machine code.
LLVM is given the same text without them, so what is left out changes neither bits nor speed. A variable then has one type wherever it is
assigned; in a wiring that is a float. A law that stands in the wiring and needs one of them is compiled by all of numba's passes: see
:mod:`lathesim.engine.module_cache`. Imported only where something is compiled.
"""

from __future__ import annotations

import hashlib
import pickle
import sys
from collections.abc import Callable
from typing import Any, ClassVar

import llvmlite.binding as llvm
import numba
from numba import types
from numba.core.caching import NullCache
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, CompileResult, compile_result
from numba.core.compiler_machinery import PassManager
from numba.core.serialize import dumps
from numba.extending import intrinsic

from lathesim.cache_folder import keep_sealed, kept_sealed


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


_NUMBERS = (types.Number, types.Boolean, types.Literal)
_LEFT_OUT = (*("ReconstructSSA", "PreLowerStripPhis"), *("InlineClosureLikes", "GenericRewrites", "NopythonRewrites"), "IRProcessing")


class _TextLibrary(JITCodeLibrary):  # type: ignore[misc]
    """LLVM text of a law, which is linked into wirings and never called, or of a wiring, whose machine code is made from the text.

    numba would make machine code of each and link it into the process, an eighth of its time; here it is made only where someone asks for
    its address. It would also optimise the text three times, another eighth; here that is done once, with the same bits and speed.
    """

    _made = False

    @property
    def codegen(self) -> Any:
        """Return what is given the environment of a function, with which machine code of numba's raises; there is none."""
        return self

    def set_env(self, name: str, environment: Any) -> None:
        """Leave out the environment."""

    def _optimize_functions(self, module: Any) -> None:
        """Leave out the passes over single functions, which are made once more over the whole module."""
        module.data_layout = self._codegen._data_layout

    def _optimize_final_module(self) -> None:
        """Leave out the pass before the last, which numba makes to count references to arrays; there are none."""
        manager, builder = self._codegen._module_pass_manager()
        manager.run(self._final_module, builder)

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> Any:
        """Return the address of a function, zero where the text does not define it."""
        self._ensure_finalized()
        if all(function.name != name for function in self.get_defined_functions()):
            return 0
        if not self._made:
            self._made = True
            super()._finalize_final_module()
        return super().get_pointer_to_function(name)

    def serialize_using_object_code(self) -> tuple[str, bytes]:
        """Return the name and the text as it is linked."""
        self._ensure_finalized()
        return self.name, self._final_module.as_bitcode()


class _NumberTypes:
    """What numba knows of types, with what functions and operators make of numbers looked up once.

    numba tries a dozen rules, of arrays too, wherever two numbers are added: a sixth of its time.
    """

    _found: ClassVar[dict[tuple[Any, tuple[Any, ...]], Any]] = {}

    def __init__(self, context: Any) -> None:
        self._context = context

    def __getattr__(self, name: str) -> Any:
        return getattr(self._context, name)

    def resolve_function_type(self, func: Any, args: tuple[Any, ...], kws: dict[str, Any]) -> Any:
        """Return the signature with which a function takes arguments of some types; raises numba's error where there is none."""
        stock = not isinstance(func, types.Type) or isinstance(func, types.Function)  # a law may be compiled anew
        if kws or not stock or not all(isinstance(one, _NUMBERS) for one in args):
            return self._context.resolve_function_type(func, args, kws)
        if (func, args) not in self._found:
            self._found[func, args] = self._context.resolve_function_type(func, args, kws)
        return self._found[func, args]


class LawCompiler(Compiler):  # type: ignore[misc]
    """Compiles a law to LLVM text."""

    def define_pipelines(self) -> list[Any]:
        """Return numba's passes."""
        self.state.typingctx = _NumberTypes(self.state.typingctx)
        self.state.library = _TextLibrary(self.state.targetctx.codegen(), self.state.func_id.func_qualname)
        passes: list[Any] = super().define_pipelines()
        return passes


class BlockCompiler(LawCompiler):
    """Compiles a function whose variables keep their types to LLVM text."""

    def define_pipelines(self) -> list[Any]:
        """Return numba's passes but for those left out."""
        passes = PassManager("lathesim")
        (usual,) = super().define_pipelines()
        passes.passes = [item for item in usual.passes if item[0].__name__ not in _LEFT_OUT]
        passes.finalize()
        return [passes]


def _loaded(context: Any, text: tuple[str, bytes], description: Any, environment: Any, signature: Any, *rest: Any) -> CompileResult:
    """Return a law from what was kept of it, as ``CompileResult._rebuild`` does with machine code."""
    start = rest[-2]
    for function in start:
        function()
    library = _TextLibrary(context.codegen(), text[0])
    library._final_module = llvm.parse_bitcode(text[1])
    library._finalize_final_module()
    return compile_result(
        typing_context=context.typing_context, target_context=context, library=library, environment=environment, fndesc=description,
        entry_point=context.get_executable(library, description, environment), signature=signature, objectmode=False, lifted=(),
        reload_init=start, referenced_envs=rest[-1],
    )  # fmt: skip


class LawCache(NullCache):  # type: ignore[misc]
    """The cached machine code of one law by signature; ``digest`` covers its text and the texts of the laws it calls."""

    def __init__(self, digest: str) -> None:
        self._digest = digest

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the compiled law for a signature, or none if it is missing or cannot be loaded."""
        target_context.refresh()
        kept = kept_sealed(self._name(sig, target_context.codegen()))
        try:
            return None if kept is None else _loaded(target_context, *pickle.loads(kept))  # noqa: S301 - sealed, and written by us
        except Exception:  # after any fault the law is compiled again
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Write the compiled law for a signature, unless it holds addresses of this process."""
        if not data.library.has_dynamic_globals and not any(not lifted.can_cache for lifted in data.lifted):
            keep_sealed(self._name(sig, data.codegen), dumps(data._reduce()))

    def _name(self, sig: Any, codegen: Any) -> str:
        compiled_for = repr((numba.__version__, sys.implementation.cache_tag, sig, codegen.magic_tuple()))
        return f"law_{self._digest}.{hashlib.sha256(compiled_for.encode()).hexdigest()[:16]}.code"
