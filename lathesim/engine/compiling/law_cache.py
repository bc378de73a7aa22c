"""Where numba keeps the machine code of laws: files of the cache under its seal, as numba's own can be torn and are loaded as they are."""

from __future__ import annotations

import hashlib
import pickle
import sys
from typing import Any

import numba
from numba.core.caching import NullCache
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps

from lathesim.cache_folder import keep_sealed, kept_sealed


class LawCache(NullCache):  # type: ignore[misc]
    """The kept machine code of one law by signature; ``digest`` is that of its text and of those it calls."""

    def __init__(self, digest: str) -> None:
        self._digest = digest

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return what was compiled for a signature, none where it is not kept or cannot be loaded."""
        target_context.refresh()
        kept = kept_sealed(self._name(sig, target_context.codegen()))
        try:
            return None if kept is None else CompileResult._rebuild(target_context, *pickle.loads(kept))  # noqa: S301 - sealed, and ours
        except Exception:  # whatever it is, the law is compiled anew
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep what was compiled for a signature, unless it holds addresses of this process."""
        if not data.library.has_dynamic_globals and not any(not lifted.can_cache for lifted in data.lifted):
            keep_sealed(self._name(sig, data.codegen), dumps(data._reduce()))

    def _name(self, sig: Any, codegen: Any) -> str:
        compiled_for = repr((numba.__version__, sys.implementation.cache_tag, sig, codegen.magic_tuple()))
        return f"law_{self._digest}.{hashlib.sha256(compiled_for.encode()).hexdigest()[:16]}.code"
