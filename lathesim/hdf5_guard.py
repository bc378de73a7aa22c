"""Refuse HDF5 files that take values from other files of this computer, or hold structures in which the library hangs."""

from __future__ import annotations

import mmap
from pathlib import Path
from typing import Any

from lathesim.errors import RecordError

_COLLECTION = b"GCOL\x01\x00\x00\x00"
"""Signature, version and reserved bytes of a global heap collection, where texts of variable length stand."""
_HEAD = 16
"""Bytes before the first object of a collection, and before the data of each object."""


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
    end = min(begin + int.from_bytes(content[begin + 8 : begin + _HEAD], "little"), len(content))
    place = begin + _HEAD
    while place + _HEAD <= end:
        index, length = (int.from_bytes(content[place + at : place + at + width], "little") for at, width in ((0, 2), (8, 8)))
        # the length of the free space, index 0, counts its own head
        step = length if index == 0 else _HEAD + (length + 7) // 8 * 8
        if step == 0:
            return False
        place += step
    return True


def stands_elsewhere(group: Any, name: str) -> bool:
    """Return whether an item of a group is a soft or external link, or a dataset with external or virtual storage."""
    import h5py

    if not isinstance(group.get(name, getlink=True), h5py.HardLink):
        return True
    item = group[name]
    return isinstance(item, h5py.Dataset) and bool(item.external or item.is_virtual)


def own_item(group: Any, name: str) -> Any:
    """Return an item of a group. Raises :class:`RecordError` if its values stand in another file, and KeyError if it is missing."""
    if name in group and stands_elsewhere(group, name):
        raise RecordError(f"'{name}' refers to values in another file.", remedy="Write them into the file itself.")
    return group[name]
