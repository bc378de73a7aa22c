"""Binary files: HDF5 of any program, MAT of all versions, and the records of this program."""

from __future__ import annotations

import functools
import struct
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.errors import RecordingError
from lathesim.hdf5_guard import stands_elsewhere
from lathesim.record import FloatArray, is_record, load
from lathesim.recordings.raw_table import MOST_VALUES, RawTable, Reader, as_table, plain_unit, refuse_size
from lathesim.recordings.recording_thresholds import READING

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


@dataclass
class ArrayColumns:
    """Columns, constants and notes, gathered array by array."""

    path: Path
    columns: dict[str, FloatArray] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    constants: dict[str, float] = field(default_factory=dict)
    left_out: list[str] = field(default_factory=list)

    def check(self, shape: tuple[int, ...]) -> None:
        """Refuse (:class:`RecordingError`) an array that is too large, before it is read."""
        longest = max(shape, default=1)
        count = int(np.prod(shape, dtype=np.int64)) if shape else 1
        refuse_size(self.path, longest, max(count // max(longest, 1), 1))
        if sum(len(values) for values in self.columns.values()) + count > MOST_VALUES:
            fact = f"the file holds more than {MOST_VALUES:,} values, the most that are read.".replace(",", " ")
            raise RecordingError(fact, place=str(self.path), remedy="Keep fewer signals, or a part of the time.")

    def take(self, name: str, array: Any, unit: str = "") -> None:
        """Take an array; what is not real numbers of at most two dimensions is left out by name."""
        values = np.asarray(array)
        if values.dtype.kind not in "fiub" or values.size == 0:
            self.left_out.append(name)
            return
        squeezed = np.squeeze(values).astype(np.float64)
        if squeezed.ndim == 0:
            self.constants[name] = float(squeezed)
        elif squeezed.ndim == 1:
            self._put(name, squeezed, unit)
        elif squeezed.ndim == 2:
            table = squeezed if squeezed.shape[0] >= squeezed.shape[1] else squeezed.T
            if table.shape[1] > READING.matrix:
                self.left_out.append(name)
                return
            for number, column in enumerate(table.T, start=1):
                self._put(f"{name}_{number}", column, unit)
        else:
            self.left_out.append(name)

    def _put(self, name: str, values: FloatArray, unit: str) -> None:
        self.columns[name] = np.ascontiguousarray(values)
        self.units[name] = unit

    def table(self) -> RawTable:
        """Return the table of what was gathered."""
        notes = (f"left out, no columns of numbers: {', '.join(self.left_out)}",) if self.left_out else ()
        return as_table(self.path, self.columns, self.units, notes, self.constants)


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
            if file.read(len(_SIGNATURE)) == _SIGNATURE:
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
            if depth < READING.depth:
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


HDF5_READER = Reader("HDF5", (".h5", ".hdf5", ".hdf"), "HDF5 file", reads_hdf5, read_hdf5)


_DEPTH = 6
_HEAD = 128
"""Bytes of the header of a MAT file of version 5."""
_VERSION_5 = tuple(version + order for version in (b"\x00\x01", b"\x01\x00") for order in (b"IM", b"MI"))
_PRECISIONS, _MATRICES = range(6), range(3)
"""Types of numbers and of matrices of version 4."""
_VERSION_4 = struct.Struct("5i")
_LONGEST_NAME = 64
_TRIAL = "import sys; from scipy.io import loadmat; loadmat(sys.argv[1])"


def reads_mat(path: Path) -> bool:
    """Return whether a file is a MAT file of version 5 or 4."""
    with path.open("rb") as file:
        head = file.read(_HEAD)
    version = head[-4:]
    return _is_version_4(head) or (len(head) == _HEAD and version in _VERSION_5)


def _is_version_4(head: bytes) -> bool:
    """Return whether a file begins with the header of a matrix of version 4. It has no signature, only type, rows, columns, a complex flag,
    the length of the name, and the name. Source: MathWorks, MAT-File Format, chapter on level 4."""
    for order, numbers in (("<", 0), (">", 1000)):
        if len(head) < _VERSION_4.size:
            return False
        kind, rows, columns, is_complex, length = struct.unpack_from(f"{order}5i", head)
        name = head[_VERSION_4.size : _VERSION_4.size + length] if 1 < length <= _LONGEST_NAME else b""
        precision, matrix = divmod(kind - numbers, 10)
        sized = rows >= 0 and columns >= 0 and is_complex in (0, 1)
        if (
            sized
            and precision in _PRECISIONS
            and matrix in _MATRICES
            and name.endswith(b"\x00")
            and name[:-1].decode("latin-1").isidentifier()
        ):
            return True
    return False


def read_mat(path: Path) -> RawTable:
    """Read the arrays of a MAT file. Text, cells and objects are left out by name."""
    from scipy.io import loadmat, whosmat

    found = ArrayColumns(path)
    try:
        refuse_deadly_file(path, _TRIAL)
        for _, shape, _ in whosmat(str(path)):
            found.check(tuple(shape))
        content = loadmat(str(path), squeeze_me=False, struct_as_record=True, chars_as_strings=True)
    except RecordingError:
        raise
    except Exception as error:
        raise RecordingError("the MAT file is damaged or cut off.", place=str(path), remedy="Write it again, as version 7.") from error
    units, names = _texts(content, "units"), _texts(content, "names")
    for name, value in content.items():
        if not name.startswith("__") and name not in ("units", "names"):
            _take_variable(found, names.get(name, name), value, units.get(name, ""), 0)
    return found.table()


def _take_variable(found: ArrayColumns, name: str, value: Any, unit: str, depth: int) -> None:
    array = np.asarray(value)
    if array.dtype.names and array.size == 1 and depth < _DEPTH:
        single = array.reshape(-1)[0]
        for item in array.dtype.names:
            _take_variable(found, f"{name}.{item}", single[item], "", depth + 1)
    else:
        found.take(name, array, unit)


def _texts(content: dict[str, Any], name: str) -> dict[str, str]:
    """Return a struct of texts whose fields are called as the variables: ``units`` and ``names``, as ``lathesim export`` writes them."""
    array = np.asarray(content.get(name))
    if not array.dtype.names or array.size != 1:
        return {}
    single = array.reshape(-1)[0]
    texts = {item: np.asarray(single[item]).reshape(-1) for item in array.dtype.names}
    return {item: str(text[0]) for item, text in texts.items() if len(text) == 1 and text.dtype.kind == "U"}


MATLAB_READER = Reader("MAT, version 4 to 7", (".mat",), "MAT file", reads_mat, read_mat)


def reads_mat73(path: Path) -> bool:
    """Return whether a file is a MAT file of version 7.3."""
    with path.open("rb") as file:
        head = file.read(128)
    return head.startswith(b"MATLAB 7.3") and reads_hdf5(path)


def read_mat73(path: Path) -> RawTable:
    """Read the arrays of a MAT file of version 7.3."""
    return gather(path, ".", ("#refs#", "#subsystem#"))


MATLAB73_READER = Reader("MAT, version 7.3", (".mat",), "MAT file", reads_mat73, read_mat73)


def reads_record(path: Path) -> bool:
    """Return whether a file is a record of this program."""
    return reads_hdf5(path) and is_record(path)


def read_record(path: Path) -> RawTable:
    """Read a record as a table whose columns are its channels, with the time as the column ``time``."""
    import h5py

    try:
        refuse_deadly_file(path, HDF5_TRIAL)
        with h5py.File(path, "r") as file:
            shape = (len(file["time"]) if "time" in file else 0, len(file["channels"]) + 1 if "channels" in file else 1)
    except Exception as error:
        raise RecordingError("the record is damaged.", place=str(path), remedy="Run the lesson again to make the record anew.") from error
    ArrayColumns(path).check(shape)
    record = load(path)
    columns = {"time": record.time} | {name: channel.values for name, channel in record.channels.items()}
    units = {"time": "s"} | {name: channel.unit for name, channel in record.channels.items()}
    notes = () if record.status == "complete" else (f"the run that made it ended as '{record.status}'",)
    return as_table(path, columns, units, notes, {})


RECORD_READER = Reader("own record", (".h5",), "record of lathesim", reads_record, read_record)
