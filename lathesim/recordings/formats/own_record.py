"""Records of this program: the time and the channels by their names, with units."""

from __future__ import annotations

from pathlib import Path

from lathesim.errors import RecordingError
from lathesim.record import is_record, load
from lathesim.recordings.formats.array_columns import ArrayColumns
from lathesim.recordings.formats.hdf5_file import HDF5_TRIAL, reads_hdf5
from lathesim.recordings.formats.trial_read import refuse_deadly_file
from lathesim.recordings.raw_table import RawTable, as_table
from lathesim.recordings.reader import Reader


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


READER = Reader("own record", (".h5",), "record of lathesim", reads_record, read_record)
