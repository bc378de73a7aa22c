"""Machine code of fused modules: made by numba once, kept as an object file, and loaded from there without numba.

Loading numba takes longer than a whole run, and what its cache keeps can only be read by it. So numba's part ends with LLVM text; llvmlite
turns that into an object file for this processor, which a later start links and calls in a few hundredths of a second. The name of the
file is made of the module's digest, the processor and the version of llvmlite. A file that does not fit is made anew.
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import hashlib
import json
import re
import sys
from dataclasses import dataclass
from typing import Any

import numpy as np

from lathesim.cache_folder import is_there, keep_sealed, kept_sealed, names_kept
from lathesim.engine.fuse import FusedModule

_BYTES = 8
"""Of a number."""

_FORMAT = 3
_NUMBERS = (ctypes.c_int64, ctypes.c_int64, ctypes.c_double, ctypes.c_double, ctypes.c_int64)
_ARRAYS = (ctypes.c_void_p,) * 7
_PROTOTYPE = ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_void_p, ctypes.c_void_p, *_NUMBERS, *_ARRAYS)
_LIBRARY = {f"llvm.{name}.f64": name for name in ("sin", "cos", "tan", "exp", "exp2", "log", "log2", "log10", "pow")}
"""What LLVM may write as a call of the mathematical library -> its name there."""


@dataclass(frozen=True)
class CompiledMachine:
    """A machine's ``run_block`` as machine code; ``keeper`` keeps the code in memory."""

    address: int
    keeper: Any

    def run_block(self, first: int, count: int, period: float, step: float, steps: int, *given: Any) -> int:
        """Advance the machine, see :mod:`lathesim.engine.fuse`; ``given`` are the arrays from ``parameters`` to ``record``.

        They are contiguous, of 64-bit floats. The GIL is released.

        Raises ArithmeticError where a law raises.
        """
        done = ctypes.c_int64(0)
        fault = ctypes.c_void_p(None)
        parameters, states, discrete, memories, tables, noise, record = given
        arrays = [parameters, states, discrete, *[_directory(some) for some in (memories, tables, noise)], record]
        for array in arrays:
            if not array.flags.c_contiguous or array.dtype.itemsize != _BYTES:
                raise TypeError("an array for the machine code is not contiguous, or not of 64-bit numbers")
        status = _PROTOTYPE(self.address)(
            ctypes.addressof(done), ctypes.addressof(fault), first, count, period, step, steps, *(array.ctypes.data for array in arrays)
        )
        if status:
            raise ArithmeticError("a law raised in machine code")
        return done.value


def _directory(arrays: Any) -> Any:
    """Return address, rows and columns of each array; the arrays must outlive the call."""
    return np.array([(array.ctypes.data, array.shape[0], array.shape[-1]) for array in arrays] or [(0, 0, 0)], dtype=np.int64)


def is_kept(fused: FusedModule) -> bool:
    """Return whether machine code of the module lies in the cache, without loading the compiler."""
    if "llvmlite.binding" in sys.modules:
        return is_there(_file_name(fused))
    return bool(names_kept(f"machine_{fused.digest}.*.code"))


def load_code(fused: FusedModule) -> CompiledMachine | None:
    """Return the machine from the cache, none where its code is not there, damaged, or made for another processor."""
    kept = kept_sealed(_file_name(fused))
    if kept is None:
        return None
    head, _, code = kept.partition(b"\n")
    notes = json.loads(head)
    return _linked(notes["symbol"], notes["needs"], code)


def make_code(fused: FusedModule, llvm_text: str, symbol: str) -> CompiledMachine | None:
    """Return the machine that LLVM text describes, its code made and kept; none where something it calls is not to be found here."""
    import llvmlite.binding as llvm

    _start_llvm()
    module = llvm.parse_assembly(llvm_text)
    module.verify()
    code = _target().emit_object(module)
    declared = set(re.findall(r"^declare [^@]*@\"?([\w.$]+)", llvm_text, re.MULTILINE))
    needs = sorted({name for name in declared if not name.startswith("llvm.")} | {_LIBRARY[name] for name in declared & _LIBRARY.keys()})
    keep_sealed(_file_name(fused), json.dumps({"symbol": symbol, "needs": needs}).encode() + b"\n" + code)
    return _linked(symbol, needs, code)


def object_code(llvm_text: str, symbol: str, name: str) -> bytes:
    """Return an object file, to be linked to a library, with the machine that LLVM text describes, for any processor of this kind.

    ``symbol`` is called ``name`` there; no other name is seen outside a library.
    """
    import llvmlite.binding as llvm

    _start_llvm()
    module = llvm.parse_assembly(llvm_text)
    module.get_function(symbol).name = name
    for item in (*module.functions, *module.global_variables):
        if not item.is_declaration and item.linkage not in (llvm.Linkage.internal, llvm.Linkage.private):
            item.visibility = "hidden"
    target = llvm.Target.from_triple(llvm.get_process_triple()).create_target_machine(opt=3, reloc="pic", codemodel="default")
    code: bytes = target.emit_object(module)
    return code


def _linked(symbol: str, needs: list[str], code: bytes) -> CompiledMachine | None:
    import llvmlite.binding as llvm

    _start_llvm()
    if not all(_found(name) for name in needs):
        return None
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), _target())
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    address = engine.get_function_address(symbol)
    return CompiledMachine(address, engine) if address else None


@functools.cache
def _found(name: str) -> bool:
    """Return whether LLVM can link a function, having told it where Python's own mathematics has it."""
    import llvmlite.binding as llvm

    if llvm.address_of_symbol(name):
        return True
    for library in _libraries():
        function = getattr(library, name, None)
        if function is not None:
            llvm.add_symbol(name, ctypes.cast(function, ctypes.c_void_p).value)
            return True
    return False


@functools.cache
def _libraries() -> list[Any]:
    names = ["ucrtbase", "msvcrt"] if sys.platform == "win32" else [None]
    found = []
    for name in names:
        with contextlib.suppress(OSError):
            found.append(ctypes.CDLL(name))
    return found


@functools.cache
def _start_llvm() -> Any:
    """Start LLVM, and stand in for the one function of numba's runtime that the code names and never calls: it makes no arrays."""
    import llvmlite.binding as llvm

    with contextlib.suppress(RuntimeError):
        llvm.initialize()  # newer versions do this by themselves, and refuse
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    stand_in = ctypes.CFUNCTYPE(None, ctypes.c_void_p)(lambda _: None)
    if not llvm.address_of_symbol("NRT_MemInfo_call_dtor"):
        llvm.add_symbol("NRT_MemInfo_call_dtor", ctypes.cast(stand_in, ctypes.c_void_p).value)
    return stand_in


def _target() -> Any:
    import llvmlite.binding as llvm

    target = llvm.Target.from_triple(llvm.get_process_triple())
    name, features = llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()
    return target.create_target_machine(cpu=name, features=features, opt=3, reloc="default", codemodel="jitdefault", jit=True)


@functools.cache
def _processor() -> str:
    import llvmlite
    import llvmlite.binding as llvm

    parts = (_FORMAT, llvmlite.__version__, llvm.get_process_triple(), llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten())
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:16]


def _file_name(fused: FusedModule) -> str:
    return f"machine_{fused.digest}.{_processor()}.code"
