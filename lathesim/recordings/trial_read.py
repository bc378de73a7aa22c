"""A trial read of a file in another process: the libraries for binary files hang or crash over some damaged ones."""

from __future__ import annotations

import functools
import subprocess
import sys
from pathlib import Path

_PATIENCE, _BYTES_A_SECOND = 20.0, 10e6
"""Seconds that a trial may take, and how much it reads in each further one at least. Assumed, for a slow disk."""


def refuse_deadly_file(path: Path, script: str) -> None:
    """Raise :class:`OSError` where ``script``, which reads the file named first on its command line, hangs or crashes.

    What ends with a Python exception is no reason: the reader meets it again, and says so.
    """
    state = path.stat()
    if not _survives(str(path), script, state.st_mtime_ns, state.st_size):
        raise OSError("the library that reads such files does not come back from this one")


@functools.lru_cache(maxsize=64)
def _survives(path: str, script: str, changed: int, size: int) -> bool:
    """Return whether the trial comes to an end by itself; ``changed`` and ``size`` tell the states of a file apart."""
    if not sys.executable:
        return True
    limit = _PATIENCE + size / _BYTES_A_SECOND
    try:
        ended = subprocess.run([sys.executable, "-c", script, path], capture_output=True, timeout=limit, check=False)
    except subprocess.TimeoutExpired:
        return False
    return ended.returncode in (0, 1)
