"""The cache of generated modules, their byte code and machine code, and the texts of laws; it makes a second start quick.

Every file is written whole or not at all. A file whose right content is not known beforehand is sealed: its first line is the digest of its
name and its content. A file with a wrong seal counts as missing. A read-only folder is still read.
"""

from __future__ import annotations

import atexit
import contextlib
import fnmatch
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
    """Write a file of the cache unless it already has this content, and return its path.

    Raises :class:`WriteError` if neither the cache nor a temporary folder can be written.
    """
    for folder in _folders():
        with contextlib.suppress(OSError):
            if (folder / name).read_bytes() == content:
                return folder / name
    return _write(name, content)


def keep_sealed(name: str, content: bytes) -> Path:
    """Write a sealed file of the cache and return its path. Raises :class:`WriteError` as :func:`keep` does."""
    return _write(name, _seal(name, content) + content)


def kept_sealed(name: str) -> bytes | None:
    """Return the content that :func:`keep_sealed` wrote, or none if the file is missing, damaged or unreadable."""
    for folder in _folders():
        with contextlib.suppress(OSError):
            seal, newline, content = (folder / name).read_bytes().partition(b"\n")
            if seal + newline == _seal(name, content):
                return content
    return None


def is_there(name: str) -> bool:
    """Return whether the cache has a file of this name, whatever is in it."""
    return any((folder / name).exists() for folder in _folders())


def names_kept(pattern: str) -> set[str]:
    """Return the names of the files of the cache that match ``pattern``; a cache may hold ten thousand files."""
    found: set[str] = set()
    for folder in _folders():
        with contextlib.suppress(OSError), os.scandir(folder) as files:
            found.update(fnmatch.filter((file.name for file in files), pattern))
    return found


def _seal(name: str, content: bytes) -> bytes:
    return f"# {hashlib.sha256(name.encode() + b' ' + content).hexdigest()}\n".encode()


def _folders() -> tuple[Path, ...]:
    """Return the folders to read: the user's, and the temporary one if the user's could not be written."""
    return (cache_folder(), *_INSTEAD.values())


def _write(name: str, content: bytes) -> Path:
    folder = cache_folder()
    if folder not in _INSTEAD:
        try:
            return write_bytes(
                make_folder(folder) / name, content, durable=False
            )  # not durable: the seal reveals a file that a power cut has torn
        except WriteError as error:
            _INSTEAD[folder] = _temporary_folder(error)
    try:
        return write_bytes(_INSTEAD[folder] / name, content, durable=False)
    except WriteError as error:
        raise WriteError(error.fact, place=error.place, remedy=_REMEDY) from error


_INSTEAD: dict[Path, Path] = {}
"""Folder that could not be written -> temporary folder that this process writes to instead."""


def _temporary_folder(error: WriteError) -> Path:
    """Make a folder that is removed at the end of this process, say why, and remove the folders of processes that were killed."""
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
    if process == os.getpid():  # a forked process must not remove it
        shutil.rmtree(folder, ignore_errors=True)


@functools.cache
def _say(sentence: str) -> None:
    print(sentence, file=sys.stderr)
