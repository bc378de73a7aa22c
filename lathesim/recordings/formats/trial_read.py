"""A trial read of a file in another process: the libraries for binary files hang or crash over some damaged ones."""

from __future__ import annotations

import functools
import subprocess
import sys
from pathlib import Path

_PATIENCE, _BYTES_A_SECOND = 20.0, 10e6
"""Seconds of computing that a trial may take, and how much it reads in each further one at least. Assumed, for a slow processor."""
_WALL = 10.0
"""Times as long by the clock, where others keep the processors busy; without a limit on computing that ends a trial too."""
_LIMITED = """
try:
    import resource
    resource.setrlimit(resource.RLIMIT_CPU, ({seconds}, {seconds}))
except (ImportError, ValueError, OSError):
    pass
"""


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
        limited = _LIMITED.format(seconds=int(limit)) + script
        ended = subprocess.run([sys.executable, "-c", limited, path], capture_output=True, timeout=_WALL * limit, check=False)
    except subprocess.TimeoutExpired:
        return False
    return ended.returncode in (0, 1)
