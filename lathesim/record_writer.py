"""Writing a record to its HDF5 file block by block; see :mod:`lathesim.record` for what stands in the file."""

from __future__ import annotations

import errno
import io
import json
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
import numpy.typing as npt

from lathesim.errors import RecordError
from lathesim.record import FORMAT, VERSION, Channel, Record

LARGEST_BLOCK = 16384
"""Samples of one channel that the file keeps together, 128 kB."""
_CHUNK_CACHE = 2 * 8 * LARGEST_BLOCK
"""Bytes of a channel that HDF5 holds back; its own choice of several MB a channel would keep an hour of record in memory."""
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


class RecordWriter:
    """Writes a record block by block, so that the memory of an hour-long run stays bounded.

    ``channels`` name what is written; their values are not used and may be empty. ``block`` is how many samples of a channel the file
    keeps together. ``write`` takes the next samples, ``finish`` the meta and moves the file to its place. Left without ``finish``,
    nothing is kept and a file that stood there before stays as it was::

        with RecordWriter(path, channels) as writer:
            record = run(plan, sink=writer)
            writer.finish(record.meta)

    Raises :class:`RecordError` where the folder cannot be written or the disk is full.
    """

    def __init__(self, path: str | Path, channels: Iterable[Channel], *, block: int = LARGEST_BLOCK, compress: bool = True) -> None:
        self.path = Path(path)
        self.samples = 0
        self._channels = list(channels)
        self._part = self.path.with_name(f".{self.path.name}.{os.getpid()}.part")
        self._block = min(max(block, 1), LARGEST_BLOCK)
        self._compress = compress
        self._file: Any = None
        self._disk: _Disk | None = None
        _check_place(self.path)
        for channel in self._channels:
            if not channel.name or "/" in channel.name or channel.name == ".":
                raise RecordError(f"a channel cannot be called '{channel.name}'.", place=str(self.path), remedy="Name it part.output.")
        with self._told():
            self._open()

    def _open(self) -> None:
        import h5py

        self._disk = _Disk(self._part)
        self._file = h5py.File(self._disk, "w", rdcc_nbytes=_CHUNK_CACHE)
        self._file.attrs["format"] = FORMAT
        self._file.attrs["version"] = VERSION
        columns = _Columns(self._block, self._compress)
        self._time = columns.new(self._file.id, "time", "s", "time since the start")
        group = self._file.create_group("channels").id
        self._values = [columns.new(group, channel.name, channel.unit, channel.description) for channel in self._channels]
        self._file.create_dataset("channel_names", data=json.dumps([channel.name for channel in self._channels]))

    def write(self, time: npt.ArrayLike, values: npt.ArrayLike) -> None:
        """Take the times (samples,) and values (channels, samples) of the next block."""
        from h5py import h5s

        times = np.ascontiguousarray(time, dtype=np.float64)
        block = np.ascontiguousarray(values, dtype=np.float64).reshape(len(self._channels), len(times))
        count, end = (len(times),), (self.samples + len(times),)
        if not len(times):
            return
        with self._told():
            here, there = h5s.create_simple(count), h5s.create_simple(end)
            there.select_hyperslab((self.samples,), count)
            for dataset, row in zip([self._time, *self._values], [times, *block], strict=True):
                dataset.set_extent(end)
                dataset.write(here, there, row)
            self._check_disk()
        self.samples += len(times)

    def finish(self, meta: Mapping[str, str | float | int] | None = None) -> None:
        """Write ``meta`` and move the whole file to its place; after the disk has refused a block there is nothing to move."""
        if self._file is None:
            return
        with self._told():
            self._file.create_dataset("meta", data=json.dumps(dict(meta or {})))
            self._close_file()
            self._check_disk()
            if self._disk is not None:
                self._disk.close(keep=True)
            self._part.replace(self.path)

    def discard(self) -> None:
        """Take away what was written so far."""
        self._close_file()
        if self._disk is not None:
            self._disk.close(keep=False)
        self._part.unlink(missing_ok=True)

    @contextmanager
    def _told(self) -> Iterator[None]:
        """Turn what the disk refuses into a :class:`RecordError`, and take the half-written file away."""
        try:
            yield
        except (OSError, RuntimeError) as error:
            self.discard()
            raise _refusal(self.path, error) from error

    def _close_file(self) -> None:
        self._time, self._values = None, []
        if self._file is not None:
            self._file.close()
            self._file = None

    def _check_disk(self) -> None:
        if self._disk is not None and self._disk.failure is not None:
            raise self._disk.failure

    def __enter__(self) -> RecordWriter:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.discard()


class _Columns:
    """Makes the columns of a file, by HDF5's own calls: through the comfortable ones of h5py a short record takes four times as long."""

    def __init__(self, block: int, compress: bool) -> None:
        import h5py
        from h5py import h5d, h5p, h5s, h5t

        self._space = h5s.create_simple((0,), (h5s.UNLIMITED,))
        self._one = h5s.create(h5s.SCALAR)
        self._text = h5py.string_dtype()
        self._text_in_file = h5t.py_create(self._text, logical=True)
        self._layout = h5p.create(h5p.DATASET_CREATE)
        self._layout.set_chunk((block,))
        self._layout.set_fill_time(h5d.FILL_TIME_NEVER)
        if compress:
            self._layout.set_shuffle()
            self._layout.set_deflate(1)
        self._layout.set_fletcher32()

    def new(self, group: Any, name: str, unit: str, description: str) -> Any:
        """Return a new empty column of numbers."""
        from h5py import h5a, h5d, h5t

        dataset = h5d.create(group, name.encode(), h5t.IEEE_F64LE, self._space, self._layout)
        for key, text in ((b"unit", unit), (b"description", description)):
            h5a.create(dataset, key, self._text_in_file, self._one).write(np.array(text, dtype=self._text))
        return dataset


class _Disk(io.RawIOBase):
    """The file HDF5 writes to. When the disk refuses, it notes the failure and keeps what still comes in memory.

    HDF5 crashes the whole program when a write fails, so it must not see one; it is closed right after the first failure.
    """

    def __init__(self, path: Path) -> None:
        self.failure: OSError | None = None
        self._raw = path.open("w+b", buffering=0)
        self._position = 0
        self._unwritten: list[tuple[int, bytes]] = []

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """Move to a place, as any file."""
        if whence == os.SEEK_END:
            offset += max([self._raw.seek(0, os.SEEK_END), *(begin + len(piece) for begin, piece in self._unwritten)])
        self._position = offset if whence != os.SEEK_CUR else self._position + offset
        return self._position

    def tell(self) -> int:
        """Return the place, as any file."""
        return self._position

    def write(self, buffer: Any) -> int:
        """Write all of a block, or keep it in memory once the disk has refused one."""
        piece = memoryview(buffer).cast("B")
        if self.failure is None:
            try:
                self._write_whole(piece)
            except OSError as error:
                self.failure = error
        if self.failure is not None:
            self._unwritten.append((self._position, bytes(piece)))
        self._position += len(piece)
        return len(piece)

    def _write_whole(self, rest: memoryview) -> None:
        self._raw.seek(self._position)
        while rest:
            rest = rest[self._raw.write(rest) :]

    def readinto(self, buffer: Any) -> int:
        """Read back what was written, on the disk or not."""
        view = memoryview(buffer).cast("B")
        self._raw.seek(self._position)
        count = self._raw.readinto(view) or 0
        for begin, piece in self._unwritten:
            low, high = max(begin, self._position), min(begin + len(piece), self._position + len(view))
            if low < high:
                view[low - self._position : high - self._position] = piece[low - begin : high - begin]
                count = max(count, high - self._position)
        self._position += count
        return count

    def truncate(self, size: int | None = None) -> int:
        """Set the length of the file."""
        length = self._position if size is None else size
        if self.failure is None:
            try:
                self._raw.truncate(length)
            except OSError as error:
                self.failure = error
        return length

    def close(self, keep: bool = False) -> None:
        """Close the file; ``keep`` makes sure first that it is on the disk."""
        if not self._raw.closed:
            if keep:
                os.fsync(self._raw.fileno())
            self._raw.close()
        super().close()


def _refusal(path: Path, error: BaseException) -> RecordError:
    if isinstance(error, OSError) and error.errno in _FULL:
        return RecordError("the disk is full.", place=str(path), remedy="Make room, or choose another folder; nothing was replaced.")
    reason = str(getattr(error, "strerror", None) or error).splitlines()[0].rstrip(".")
    return RecordError(f"the record cannot be written: {reason}.", place=str(path), remedy="Choose another folder; nothing was replaced.")


def _check_place(path: Path) -> None:
    if not path.parent.is_dir():
        raise RecordError(f"there is no folder '{path.parent}'.", place=str(path), remedy="Make it, or choose another place.")
    if path.is_dir():
        raise RecordError("this is a folder.", place=str(path), remedy="Give the name of a file.")
    if not os.access(path.parent, os.W_OK):
        raise RecordError(f"the folder '{path.parent}' cannot be written.", place=str(path), remedy="Choose another folder.")


def save(record: Record, path: str | Path) -> None:
    """Write a record as one HDF5 file; a file that stood there stays whole until the new one is.

    Raises :class:`RecordError` where the folder is missing or cannot be written, or the disk is full.
    """
    with RecordWriter(path, record.channels.values(), block=len(record), compress=False) as writer:
        values = [channel.values for channel in record.channels.values()]
        for begin in range(0, len(record), LARGEST_BLOCK):
            end = begin + LARGEST_BLOCK
            writer.write(record.time[begin:end], [value[begin:end] for value in values])
        writer.finish(record.meta)
