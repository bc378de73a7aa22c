"""Where generated modules, their byte code and machine code and the texts of laws are kept, so that a second start finds them ready.

Every file is written whole or not at all. What cannot be compared with what it should be is sealed: its first line is the digest of its
name and of the rest, and a file whose seal is broken is as good as none. A folder that cannot be written is still read.
"""

from __future__ import annotations

import atexit
import contextlib
import functools
import hashlib
import os
import shutil
import sys
import tempfile
from pathlib import Path

from lathesim.errors import WriteError
from lathesim.whole_file import is_alive, make_folder, write_bytes

_REMEDY = "Make room, or set LATHESIM_CACHE to another folder."


def cache_folder() -> Path:
    """Return the folder that the user chose (``LATHESIM_CACHE``), or the system's usual place; it need not exist."""
    chosen = os.environ.get("LATHESIM_CACHE")
    base = Path(os.environ.get("XDG_CACHE_HOME", "")) if os.environ.get("XDG_CACHE_HOME") else Path.home() / ".cache"
    return Path(chosen) if chosen else base / "lathesim" / f"python{sys.version_info.major}.{sys.version_info.minor}"


def keep(name: str, content: bytes) -> Path:
    """Write a file of the cache where it is not there, or not what it should be, and return its path.

    Raises :class:`WriteError` where neither the cache nor a temporary folder takes it.
    """
    for folder in _folders():
        with contextlib.suppress(OSError):
            if (folder / name).read_bytes() == content:
                return folder / name
    return _write(name, content)


def keep_sealed(name: str, content: bytes) -> Path:
    """Write a file of the cache under its seal, and return its path. Raises :class:`WriteError` as :func:`keep`."""
    return _write(name, _seal(name, content) + content)


def kept_sealed(name: str) -> bytes | None:
    """Return what :func:`keep_sealed` wrote, or none where it is not there, damaged, or cannot be read."""
    for folder in _folders():
        with contextlib.suppress(OSError):
            seal, newline, content = (folder / name).read_bytes().partition(b"\n")
            if seal + newline == _seal(name, content):
                return content
    return None


def is_kept(pattern: str) -> bool:
    """Return whether the cache has a file whose name matches ``pattern``."""
    return any(any(folder.glob(pattern)) for folder in _folders())


def _seal(name: str, content: bytes) -> bytes:
    return f"# {hashlib.sha256(name.encode() + b' ' + content).hexdigest()}\n".encode()


def _folders() -> tuple[Path, ...]:
    """Return the folders that are read: that of the user, and the temporary one where that could not be written."""
    return (cache_folder(), *_INSTEAD.values())


def _write(name: str, content: bytes) -> Path:
    folder = cache_folder()
    if folder not in _INSTEAD:
        try:
            return write_bytes(make_folder(folder) / name, content, durable=False)  # one that a power cut tears is known by its seal
        except WriteError as error:
            _INSTEAD[folder] = _temporary_folder(error)
    try:
        return write_bytes(_INSTEAD[folder] / name, content, durable=False)
    except WriteError as error:
        raise WriteError(error.fact, place=error.place, remedy=_REMEDY) from error


_INSTEAD: dict[Path, Path] = {}
"""Folder that could not be written -> the temporary one that this process writes to instead."""


def _temporary_folder(error: WriteError) -> Path:
    """Make a folder that is removed at the end of this process, and say why; those of processes that were killed go now."""
    fact = f"the cache cannot be written: {error.fact.rstrip('.')}."
    for left in Path(tempfile.gettempdir()).glob(f"{_TEMPORARY}*-*"):
        process = left.name.removeprefix(_TEMPORARY).partition("-")[0]
        if process.isdecimal() and not is_alive(int(process)):
            shutil.rmtree(left, ignore_errors=True)
    try:
        folder = Path(tempfile.mkdtemp(prefix=f"{_TEMPORARY}{os.getpid()}-"))
    except OSError:
        raise WriteError(fact, place=error.place, remedy=_REMEDY) from error
    _say(f"{error.place}: {fact} What is compiled now is lost at the end. {_REMEDY}")
    atexit.register(_remove, folder, os.getpid())
    return folder


_TEMPORARY = "lathesim-cache-"


def _remove(folder: Path, process: int) -> None:
    if process == os.getpid():  # and not one that was forked from it
        shutil.rmtree(folder, ignore_errors=True)


@functools.cache
def _say(sentence: str) -> None:
    print(sentence, file=sys.stderr)
