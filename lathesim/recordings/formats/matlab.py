"""MAT files of version 4 to 7 (those that are not HDF5), read with scipy; structs become ``struct.field``."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.errors import RecordingError
from lathesim.recordings.formats.array_columns import ArrayColumns
from lathesim.recordings.formats.trial_read import refuse_deadly_file
from lathesim.recordings.raw_table import RawTable
from lathesim.recordings.reader import Reader

_DEPTH = 6
_VERSION_4 = struct.Struct("5i")
_LONGEST_NAME = 64
_TRIAL = "import sys; from scipy.io import loadmat; loadmat(sys.argv[1])"


def reads_mat(path: Path) -> bool:
    """Return whether a file is a MAT file of version 5 or 4."""
    with path.open("rb") as file:
        head = file.read(128)
    return _is_version_4(head) or (len(head) == 128 and head[126:128] in (b"IM", b"MI") and head[124:126] in (b"\x00\x01", b"\x01\x00"))


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
        if sized and 0 <= precision <= 5 and matrix in (0, 1, 2) and name.endswith(b"\x00") and name[:-1].decode("latin-1").isidentifier():
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
            _take(found, names.get(name, name), value, units.get(name, ""), 0)
    return found.table()


def _take(found: ArrayColumns, name: str, value: Any, unit: str, depth: int) -> None:
    array = np.asarray(value)
    if array.dtype.names and array.size == 1 and depth < _DEPTH:
        single = array.reshape(-1)[0]
        for item in array.dtype.names:
            _take(found, f"{name}.{item}", single[item], "", depth + 1)
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


READER = Reader("MAT, version 4 to 7", (".mat",), "MAT file", reads_mat, read_mat)
