"""The choice of the right reader for a file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from lathesim.errors import RecordingError, nearest
from lathesim.recordings.raw_table import RawTable, Reader

MOST_COMPARED = 1_000_000
"""Largest number of samples of a comparison or a fit: a few runs take 20 s and 0.7 GB."""
MOST_STEPS = 1e9
"""Largest number of steps of a recording: a compiled simulation takes about a minute for them."""
SHORTER = "Keep a part of the time, or every n-th row after a low-pass filter."
_HEAD = 100
"""Largest number of header lines of a text (assumed)."""


def read_recording(path: str | Path, readers: Mapping[str, Reader] | Iterable[Reader], most: int | None = None) -> RawTable:
    """Read a recording with the reader that fits: first those for its ending, then whichever recognises what is in it.

    A file with more than ``most`` rows, with some for a head, is refused before it is read where the reader can count them.

    Raises :class:`RecordingError` where the file is missing, is of no known kind, or cannot be read.
    """
    place = Path(path)
    _check_place(place)
    known: list[Reader] = list(readers.values() if isinstance(readers, Mapping) else readers)
    fitting = [reader for reader in known if place.suffix.lower() in reader.suffixes]
    for reader in [*fitting, *(reader for reader in known if reader not in fitting)]:
        if reader.reads(place):
            if most is not None and reader.rows is not None and (rows := reader.rows(place)) > most + _HEAD:
                fact = f"the file has {rows:,} rows; at most {most:,} are accepted here.".replace(",", " ")
                raise RecordingError(fact, place=str(place), remedy=SHORTER)
            return reader.read(place)
    suffixes = ", ".join(dict.fromkeys(suffix for reader in known for suffix in reader.suffixes))
    if fitting:
        kinds = " or ".join(dict.fromkeys(reader.description for reader in fitting))
        raise RecordingError(f"the file ends in {place.suffix} and holds no {kinds}.", place=str(place), remedy=f"Read are {suffixes}.")
    raise RecordingError("the file is no recording of a known kind.", place=str(place), remedy=f"Read are {suffixes}.")


def _check_place(path: Path) -> None:
    if path.is_dir():
        raise RecordingError("this is a folder.", place=str(path), remedy="Give the name of a file.")
    if not path.exists():
        others = [other.name for other in path.parent.iterdir() if other.is_file()] if path.parent.is_dir() else []
        raise RecordingError("there is no such file.", place=str(path), remedy=nearest(path.name, others))
    try:
        with path.open("rb") as file:
            empty = not file.read(1)
    except OSError as error:
        raise RecordingError(f"the file cannot be read: {error.strerror or error}.", place=str(path)) from error
    if empty:
        raise RecordingError("the file is empty.", place=str(path), remedy="Record again, or give another file.")
