"""HDF5 files of any program: every dataset of numbers is a column, called by its path."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from lathesim.errors import RecordingError
from lathesim.hdf5_guard import stands_elsewhere
from lathesim.recordings.formats.array_columns import ArrayColumns
from lathesim.recordings.formats.trial_read import refuse_deadly_file
from lathesim.recordings.raw_table import RawTable, plain_unit
from lathesim.recordings.reader import Reader

_SIGNATURE = b"\x89HDF\r\n\x1a\n"
HDF5_TRIAL = """
import sys, warnings, h5py
warnings.simplefilter("ignore")
def walk(group, depth):
    for name in group:
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            continue
        item = group[name]
        if isinstance(item, h5py.Dataset) and (item.external or item.is_virtual):
            continue
        dict(item.attrs)
        if isinstance(item, h5py.Dataset) and item.shape is not None and item.size < 100_000_000:
            item[()]
        elif isinstance(item, h5py.Group) and depth < 12:
            walk(item, depth + 1)
with h5py.File(sys.argv[1], "r") as file:
    dict(file.attrs)
    walk(file, 0)
"""
"""What another process does first with a file: everything that is read here."""
_UNIT_NAMES = ("unit", "units", "Unit", "Units")


def reads_hdf5(path: Path) -> bool:
    """Return whether a file is HDF5; a block of another program may stand before it."""
    with path.open("rb") as file:
        for place in (0, 512, 1024, 2048):
            file.seek(place)
            if file.read(8) == _SIGNATURE:
                return True
    return False


def read_hdf5(path: Path) -> RawTable:
    """Read every dataset of numbers, named by its path with ``/`` between; an attribute ``unit`` or ``units`` gives its unit."""
    return gather(path, "/", ())


def gather(path: Path, between: str, hidden: tuple[str, ...]) -> RawTable:
    """Read the datasets of a file; groups named in ``hidden`` are left out.

    Links are not followed, nor are values taken from other files.
    """
    import h5py

    found = ArrayColumns(path)
    try:
        refuse_deadly_file(path, HDF5_TRIAL)
        with h5py.File(path, "r") as file:
            _walk(found, file, "", between, hidden, 0)
    except RecordingError:
        raise
    except Exception as error:  # the HDF5 library raises what it likes over a damaged file
        raise RecordingError("the HDF5 file is damaged or cut off.", place=str(path), remedy="Write it again.") from error
    return found.table()


def _walk(found: ArrayColumns, group: Any, prefix: str, between: str, hidden: tuple[str, ...], depth: int) -> None:
    import h5py

    for name in group:
        full = f"{prefix}{between}{name}" if prefix else name
        if name in hidden:
            continue
        if stands_elsewhere(group, name):
            found.left_out.append(full)
            continue
        item = group[name]
        if isinstance(item, h5py.Group):
            if depth < 12:
                _walk(found, item, full, between, hidden, depth + 1)
        elif isinstance(item, h5py.Dataset):
            _take(found, full, item)


def _take(found: ArrayColumns, name: str, item: Any) -> None:
    if item.dtype.names:
        found.check(item.shape)
        block = item[()]
        for part in item.dtype.names:
            found.take(f"{name}.{part}", block[part])
    elif item.dtype.kind not in "fiub" or item.shape is None or item.attrs.get("MATLAB_class") == b"char":
        found.left_out.append(name)
    else:
        found.check(item.shape)
        found.take(name, item[()], _unit(item))


def _unit(item: Any) -> str:
    for name in _UNIT_NAMES:
        value = item.attrs.get(name)
        if isinstance(value, bytes):
            return plain_unit(value.decode("utf-8", errors="replace"))
        if isinstance(value, str):
            return plain_unit(value)
    return ""


READER = Reader("HDF5", (".h5", ".hdf5", ".hdf"), "HDF5 file", reads_hdf5, read_hdf5)
