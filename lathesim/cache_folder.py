"""Where generated modules, their machine code, the texts of laws and unit definitions are kept, so that a second start finds them ready."""

from __future__ import annotations

import functools
import os
import sys
import tempfile
from pathlib import Path


@functools.cache
def cache_folder() -> Path:
    """Return the folder (``LATHESIM_CACHE`` or the system's usual place), made if absent; a temporary one where it cannot be written."""
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


def keep(name: str, content: bytes) -> Path:
    """Write a file of the cache where it is not there (or not what it should be), whole or not at all, and give its path."""
    path = cache_folder() / name
    if not path.exists() or path.read_bytes() != content:
        with tempfile.NamedTemporaryFile(dir=path.parent, suffix=".tmp", delete=False) as file:
            file.write(content)
        Path(file.name).replace(path)
    return path
