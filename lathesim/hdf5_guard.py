"""A look at an HDF5 file before this program opens it: the HDF5 library hangs or crashes over some damaged files."""

from __future__ import annotations

import functools
import mmap
import subprocess
import sys
from pathlib import Path

_COLLECTION = b"GCOL\x01\x00\x00\x00"
"""Signature, version and reserved bytes of a global heap collection, where texts of variable length stand."""
_HEAD = 16
"""Bytes before the first object of a collection, and before the data of each object."""
_PATIENCE, _BYTES_A_SECOND = 20.0, 10e6
"""Seconds that a trial may take, and how much it reads in each further one at least. Assumed, for a slow disk."""
_TRIAL = """
import sys, warnings, h5py
warnings.simplefilter("ignore")
def walk(group, depth):
    for name in group:
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            continue
        item = group[name]
        dict(item.attrs)
        if isinstance(item, h5py.Dataset) and item.shape is not None and item.size < 100_000_000:
            item[()]
        elif isinstance(item, h5py.Group) and depth < 12:
            walk(item, depth + 1)
with h5py.File(sys.argv[1], "r") as file:
    dict(file.attrs)
    walk(file, 0)
"""


def refuse_deadly_file(path: Path) -> None:
    """Raise :class:`OSError` where a trial in another process hangs or crashes, so that this one does neither."""
    state = path.stat()
    if not _survives(str(path), state.st_mtime_ns, state.st_size):
        raise OSError("the HDF5 library does not come back from this file")


@functools.lru_cache(maxsize=64)
def _survives(path: str, changed: int, size: int) -> bool:
    """Return whether the trial comes to an end by itself, be it with an exception; ``changed`` and ``size`` tell files apart."""
    if not sys.executable:
        return True
    limit = _PATIENCE + size / _BYTES_A_SECOND
    try:
        ended = subprocess.run([sys.executable, "-c", _TRIAL, path], capture_output=True, timeout=limit, check=False)
    except subprocess.TimeoutExpired:
        return False
    return ended.returncode in (0, 1)


def refuse_endless_heap(path: Path) -> None:
    """Raise :class:`OSError` where a collection of texts never ends: an empty free space in it, over which the library steps forever.

    Source: HDF5 File Format Specification, version 3.0, section III.E (global heap). Lengths are taken as 8 bytes, as all writers of
    today have them.
    """
    if path.stat().st_size == 0:
        return
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
        begin = content.find(_COLLECTION)
        while begin >= 0:
            if not _ends(content, begin):
                raise OSError(f"the heap at byte {begin} never ends")
            begin = content.find(_COLLECTION, begin + 1)


def _ends(content: mmap.mmap, begin: int) -> bool:
    size = int.from_bytes(content[begin + 8 : begin + _HEAD], "little")
    end = min(begin + size, len(content))
    place = begin + _HEAD
    while place + _HEAD <= end:
        index, length = (int.from_bytes(content[place + at : place + at + width], "little") for at, width in ((0, 2), (8, 8)))
        # the length of the free space, index 0, counts its own head
        step = length if index == 0 else _HEAD + (length + 7) // 8 * 8
        if step == 0:
            return False
        place += step
    return True
