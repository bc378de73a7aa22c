"""The stock readers of recordings, in the order in which they look into a file of unknown kind."""

from __future__ import annotations

from lathesim.recordings.formats import delimited_text, halsampler, hdf5_file, labview, long_table, matlab, matlab73, own_record
from lathesim.recordings.reader import Reader


def stock_readers() -> list[Reader]:
    """Return every stock reader, the most particular first."""
    return [
        own_record.READER,
        matlab73.READER,
        hdf5_file.READER,
        matlab.READER,
        labview.READER,
        long_table.READER,
        halsampler.READER,
        delimited_text.READER,
    ]
