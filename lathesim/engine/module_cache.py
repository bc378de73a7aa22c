"""Loading a fused module, plain or compiled; both come from the same file, named by the digest of its text.

The file lies in the user's cache folder (``LATHESIM_CACHE`` or the system's usual place). As the name is the digest of everything the
module is made of, a changed part, helper or constant makes a new file and the machine code beside it is never stale.
"""

from __future__ import annotations

import functools
import importlib.util
import os
import sys
import tempfile
import types
from pathlib import Path
from typing import Any

from lathesim.engine.fuse import FusedModule


@functools.cache
def cache_folder() -> Path:
    """Give the folder for generated modules and their machine code, made if absent; a temporary one where it cannot be written."""
    chosen = os.environ.get("LATHESIM_CACHE")
    base = Path(os.environ.get("XDG_CACHE_HOME", "")) if os.environ.get("XDG_CACHE_HOME") else Path.home() / ".cache"
    folder = Path(chosen) if chosen else base / "lathesim" / f"python{sys.version_info.major}.{sys.version_info.minor}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=folder):
            pass
    except OSError:
        folder = Path(tempfile.mkdtemp(prefix="lathesim-cache-"))
    return folder


def module_path(fused: FusedModule) -> Path:
    """Give the file of a fused module, written when it is not there (or not what it should be)."""
    path = cache_folder() / f"machine_{fused.digest}.py"
    if not path.exists() or path.read_text() != fused.source:
        with tempfile.NamedTemporaryFile("w", dir=path.parent, suffix=".tmp", delete=False) as file:
            file.write(fused.source)
        Path(file.name).replace(path)
    return path


def is_compiled(fused: FusedModule) -> bool:
    """Say whether machine code of the module lies in the cache."""
    return any((cache_folder() / "__pycache__").glob(f"machine_{fused.digest}.run_block-*.nbi"))


def _load(fused: FusedModule, kind: str) -> types.ModuleType:
    specification = importlib.util.spec_from_file_location(f"lathesim_{kind}_{fused.digest}", module_path(fused))
    assert specification is not None and specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    sys.modules[specification.name] = module
    specification.loader.exec_module(module)
    return module


@functools.lru_cache(maxsize=64)
def plain_module(fused: FusedModule) -> Any:
    """Give the module as plain Python."""
    return _load(fused, "plain")


@functools.lru_cache(maxsize=64)
def compiled_module(fused: FusedModule) -> Any:
    """Give the module compiled by numba (no fast mathematics, the GIL released), from the cache where it is warm."""
    import numba

    module = _load(fused, "compiled")
    for name in fused.functions:
        setattr(module, name, numba.njit(cache=True, nogil=True, error_model="numpy", boundscheck=False)(getattr(module, name)))
    return module
