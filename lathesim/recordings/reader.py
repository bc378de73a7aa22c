"""What a reader of recordings is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from lathesim.recordings.raw_table import RawTable


@dataclass(frozen=True)
class Reader:
    """Reads one kind of file.

    ``suffixes`` are the endings such files usually have, lower case with the dot. ``reads`` looks into a file, whatever its ending, and
    says whether it is of this kind, without raising. ``read`` gives its columns and raises :class:`RecordingError` in one sentence.
    ``rows`` counts the rows of a file that takes long to read, quickly: no fewer than it has.
    """

    name: str
    suffixes: tuple[str, ...]
    description: str
    reads: Callable[[Path], bool]
    read: Callable[[Path], RawTable]
    rows: Callable[[Path], int] | None = None
