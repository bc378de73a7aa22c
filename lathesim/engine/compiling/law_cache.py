"""Keep the machine code of laws as sealed files of the cache; numba's own cache loads torn files as they are."""

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
    """The cached machine code of one law by signature; ``digest`` covers its text and the texts of the laws it calls."""

    def __init__(self, digest: str) -> None:
        self._digest = digest

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the compiled law for a signature, or none if it is missing or cannot be loaded."""
        target_context.refresh()
        kept = kept_sealed(self._name(sig, target_context.codegen()))
        try:
            return None if kept is None else CompileResult._rebuild(target_context, *pickle.loads(kept))  # noqa: S301 - sealed, and written by us
        except Exception:  # after any fault the law is compiled again
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Write the compiled law for a signature, unless it holds addresses of this process."""
        if not data.library.has_dynamic_globals and not any(not lifted.can_cache for lifted in data.lifted):
            keep_sealed(self._name(sig, data.codegen), dumps(data._reduce()))

    def _name(self, sig: Any, codegen: Any) -> str:
        compiled_for = repr((numba.__version__, sys.implementation.cache_tag, sig, codegen.magic_tuple()))
        return f"law_{self._digest}.{hashlib.sha256(compiled_for.encode()).hexdigest()[:16]}.code"
