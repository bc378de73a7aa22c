"""MAT files of version 7.3, which are HDF5 inside; structs become ``struct.field``, as in the older versions."""

from __future__ import annotations

from pathlib import Path

from lathesim.recordings.formats.hdf5_file import gather, reads_hdf5
from lathesim.recordings.raw_table import RawTable
from lathesim.recordings.reader import Reader


def reads_mat73(path: Path) -> bool:
    """Return whether a file is a MAT file of version 7.3."""
    with path.open("rb") as file:
        head = file.read(128)
    return head.startswith(b"MATLAB 7.3") and reads_hdf5(path)


def read_mat73(path: Path) -> RawTable:
    """Read the arrays of a MAT file of version 7.3."""
    return gather(path, ".", ("#refs#", "#subsystem#"))


READER = Reader("MAT, version 7.3", (".mat",), "MAT file", reads_mat73, read_mat73)
