"""The stock readers of recordings, in the order in which they look into a file of unknown kind."""

from __future__ import annotations

from lathesim.recordings.binary_files import HDF5_READER, MATLAB73_READER, MATLAB_READER, RECORD_READER
from lathesim.recordings.binary_traces import BINARY_TRACE_READERS
from lathesim.recordings.delimited_text import HALSAMPLER_READER, LONG_TABLE_READER, TEXT_READER
from lathesim.recordings.document_traces import DOCUMENT_READERS
from lathesim.recordings.labview import LABVIEW_READER
from lathesim.recordings.raw_table import Reader
from lathesim.recordings.text_traces import TEXT_TRACE_READERS


def stock_readers() -> list[Reader]:
    """Return every stock reader, the most particular first."""
    return [
        RECORD_READER,
        MATLAB73_READER,
        HDF5_READER,
        MATLAB_READER,
        LABVIEW_READER,
        *BINARY_TRACE_READERS,
        *DOCUMENT_READERS,
        *TEXT_TRACE_READERS,
        LONG_TABLE_READER,
        HALSAMPLER_READER,
        TEXT_READER,
    ]
