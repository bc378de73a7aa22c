"""Loading a fused module, plain or compiled; both are made from the same text, in files named by its digest.

As the name is the digest of everything the module is made of, a changed part, helper or constant makes a new file and the machine code
beside it is never stale. The laws are compiled from files of their own, which all machines share: a changed part compiles only itself
and the wiring.
"""

from __future__ import annotations

import contextlib
import functools
import gc
import hashlib
import importlib.util
import marshal
import sys
import types
from collections.abc import Callable, Iterator
from importlib.machinery import SourceFileLoader
from pathlib import Path
from typing import Any

from lathesim.cache_folder import cache_folder, keep, keep_sealed, kept_sealed, names_kept
from lathesim.engine.fuse import FusedModule
from lathesim.engine.law_text import Piece
from lathesim.engine.machine_code import CompiledMachine, is_kept, load_code, make_code, object_code
from lathesim.errors import SimulationError

_WIRING_TIME, _LINE_TIME, _LAW_TIME = 0.6, 0.0025, 0.07
"""Seconds it takes to load the compiler, to compile a line of wiring and a law; about 1.5 times what a quiet core of 2.5 GHz takes."""

_MANY_LINES = 700
"""Lines of wiring from which like parts are computed side by side: 20 axes then take two thirds of the time, and 2 would take 6 % more."""


def module_path(fused: FusedModule) -> Path:
    """Return the file of a fused module, written when it is not there (or not what it should be)."""
    return keep(f"machine_{fused.digest}.py", fused.source.encode())


def is_compiled(fused: FusedModule) -> bool:
    """Return whether machine code of the module lies in the cache."""
    return fused.digest in _MACHINES or is_kept(fused)


def compile_time(fused: FusedModule) -> float:
    """Return about how long the module takes to compile [s]; a law that another machine has in common with it is not compiled again."""
    kept = _KEPT_LAWS.setdefault(cache_folder(), set())
    if any(piece.digest not in kept for piece in fused.pieces):
        # one look: a cache may hold ten thousand files
        kept.update(name[len("law_") : name.index(".")] for name in names_kept("law_*.code"))
    return wiring_time(fused) + _LAW_TIME * sum(piece.digest not in kept for piece in fused.pieces)


_KEPT_LAWS: dict[Path, set[str]] = {}
"""Digests of the laws that were seen compiled, by the folder of the cache; one that is lost later makes the next time seem too short."""


def wiring_time(fused: FusedModule) -> float:
    """Return about how long the module takes to compile if all its laws are kept [s]; no folder is looked through for it."""
    return _WIRING_TIME + _LINE_TIME * _lines(fused)


def _lines(fused: FusedModule) -> int:
    """Count the lines of a machine's wiring."""
    return fused.source.count("\n", fused.source.find("def run_block("))


class _Loader(SourceFileLoader):
    """Loads a module of the cache from sealed byte code; a torn .pyc file of Python itself would end every later start."""

    def get_code(self, fullname: str) -> types.CodeType:
        """Return the byte code of the module, from the cache if it was made from this text."""
        text = Path(self.path).read_bytes()
        made_from = hashlib.sha256(text).digest()
        name = f"{Path(self.path).stem}.{sys.implementation.cache_tag}.bytecode"
        kept = kept_sealed(name)
        if kept is not None and kept.startswith(made_from):
            with contextlib.suppress(ValueError, EOFError, TypeError):
                code: types.CodeType = marshal.loads(kept[len(made_from) :])
                return code
        code = compile(text, self.path, "exec", dont_inherit=True)
        keep_sealed(name, made_from + marshal.dumps(code))
        return code


def _load(path: Path, name: str) -> types.ModuleType:
    specification = importlib.util.spec_from_file_location(name, path, loader=_Loader(name, str(path)))
    assert specification is not None and specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    sys.modules[specification.name] = module
    specification.loader.exec_module(module)
    return module


@functools.lru_cache(maxsize=64)
def plain_module(fused: FusedModule) -> Any:
    """Return the module as plain Python."""
    return _load(module_path(fused), f"lathesim_plain_{fused.digest}")


_MACHINES: dict[str, CompiledMachine] = {}


def compiled_machine(fused: FusedModule) -> CompiledMachine:
    """Return the module's ``run_block`` as machine code, from the cache where it is warm; whoever listens is told that it is compiled.

    Raises :class:`SimulationError` where a law cannot be compiled.
    """
    if fused.digest not in _MACHINES:
        machine = load_code(fused)
        if machine is None:
            if not fused.foreign:
                say(f"Compiling once, about {max(1.0, compile_time(fused)):.0f} s.")
            machine = _compiled(fused)
        _MACHINES[fused.digest] = machine
    return _MACHINES[fused.digest]


def _compiled(fused: FusedModule) -> CompiledMachine:
    """Compile a module (no fast mathematics)."""
    block, llvm_text, symbol = _block(fused)
    made = make_code(fused, llvm_text, symbol)
    if made is None:
        (compiled,) = block.overloads.values()
        made = CompiledMachine(compiled.library.get_pointer_to_function(symbol), block)
    return made


def object_file(fused: FusedModule, name: str) -> bytes:
    """Return ``run_block`` as an object file for any processor of this kind, in which it is called ``name``.

    Raises :class:`SimulationError` where a law cannot be compiled.
    """
    _, llvm_text, symbol = _block(fused)
    return object_code(llvm_text, symbol, name)


def _block(fused: FusedModule) -> tuple[Any, str, str]:
    """Return what the compiler made of a module, its LLVM text, and the name of ``run_block`` there."""
    from numba.core.errors import NumbaError, UnsupportedBytecodeError

    from lathesim.engine.numba_compiler import GIVEN, BlockCompiler, block_signature

    if fused.foreign:
        fact = f"{fused.foreign[0].partition(':')[0]} is a library of its own, with which a machine cannot be compiled."
        raise SimulationError(fact, remedy="Run it with 'lathesim run'.")
    module: Any = _load(module_path(fused), f"lathesim_compiled_{fused.digest}")
    for name, function in (compiled_laws(fused) | GIVEN).items():
        setattr(module, name, function)
    signature = block_signature()
    block = _compiler(pipeline_class=BlockCompiler)(module.run_block)
    with _at_compiling(side_by_side=_lines(fused) > _MANY_LINES):
        try:
            block.compile(signature)
        except (NumbaError, UnsupportedBytecodeError):
            block = _compiler()(module.run_block)  # which takes longer, and lets a variable change its type
            try:
                block.compile(signature)
            except (NumbaError, UnsupportedBytecodeError) as error:
                raise _refusal(fused, error) from error
    (compiled,) = block.overloads.values()
    return block, block.inspect_llvm(signature.args), compiled.fndesc.llvm_func_name


@contextlib.contextmanager
def _at_compiling(side_by_side: bool) -> Iterator[None]:
    """Set Python and the compiler up; ``side_by_side`` has it compute like parts several at a time, each with the bits it has alone."""
    import numba

    collecting, vectorising = gc.isenabled(), numba.config.SLP_VECTORIZE
    gc.disable()  # what a compiler makes it keeps; looking for garbage in it takes a tenth of the time
    numba.config.SLP_VECTORIZE = int(side_by_side)
    try:
        yield
    finally:
        numba.config.SLP_VECTORIZE = vectorising
        if collecting:
            gc.enable()


def compiled_laws(fused: FusedModule) -> dict[str, Any]:
    """Return the laws of a module, each made ready to be compiled (or taken from the cache) when the machine calls it."""
    laws: dict[str, Any] = {}
    for piece in fused.pieces:
        laws[piece.name] = _compiled_law(piece, tuple(laws[name] for name in piece.uses))
    return laws


_LAWS: dict[str, Any] = {}


def _compiled_law(piece: Piece, used: tuple[Any, ...]) -> Any:
    from lathesim.engine.numba_compiler import BITS, LawCache, LawCompiler

    if piece.name in BITS:
        return BITS[piece.name]
    if piece.digest not in _LAWS:
        module = _load(keep(f"law_{piece.digest}.py", piece.text.encode()), f"lathesim_law_{piece.digest}")
        for name, law in zip(piece.uses, used, strict=True):
            setattr(module, name, law)
        _LAWS[piece.digest] = _compiler(pipeline_class=LawCompiler)(getattr(module, piece.name))
        _LAWS[piece.digest]._cache = LawCache(piece.digest)
    return _LAWS[piece.digest]


def _compiler(**more: Any) -> Any:
    """Return the compiler; what it makes is called from machine code only, and never has to be fit to be called from Python."""
    import numba

    return numba.njit(error_model="numpy", boundscheck=False, no_cfunc_wrapper=True, no_cpython_wrapper=True, **more)


def _refusal(fused: FusedModule, error: Exception) -> SimulationError:
    lines = [line.strip() for line in str(error).splitlines() if line.strip() and "nopython mode" not in line]
    law = next((piece.name for piece in fused.pieces if piece.name in str(error) or piece.digest in str(error)), "the wiring")
    reason = (lines or [type(error).__name__])[0].partition(" Raised from")[0].rstrip(".")
    return SimulationError(f"{law} cannot be compiled: {reason}.", remedy="Use floats and math only, or run with --plain.")


Listener = Callable[[str], None]
_listeners: list[Listener] = []


def tell_compiling_to(listener: Listener | None) -> None:
    """Let ``listener`` take the sentences about compiling from now on, in place of the one before; none says nothing."""
    _listeners[:] = [] if listener is None else [listener]


def say(sentence: str) -> None:
    """Notify the listener, if there is one."""
    for listener in _listeners:
        listener(sentence)
