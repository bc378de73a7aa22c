"""Writing a record to its HDF5 file block by block; see :mod:`lathesim.record` for what stands in the file."""

from __future__ import annotations

import contextlib
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

from lathesim.errors import RecordError, WriteError
from lathesim.record import FORMAT, VERSION, Channel, Record
from lathesim.whole_file import PartFile, refusal

LARGEST_BLOCK = 16384
"""Samples of one channel that the file keeps together, 128 kB."""
_NUMBER_BYTES = 8
_CHUNK_CACHE = 2 * _NUMBER_BYTES * LARGEST_BLOCK
"""Bytes of a channel that HDF5 holds back; its own choice of several MB a channel would keep an hour of record in memory."""
_GROWING_BLOCK = 2048
"""The same for a growing record, which rewrites the last one with every call: 16 kB."""


class RecordWriter:
    """Writes a record block by block, so that the memory of an hour-long run stays bounded.

    ``channels`` name what is written; their values are not used and may be empty. ``block`` is how many samples of a channel the file
    keeps together. ``write`` takes the next samples, ``finish`` the meta and moves the file to its place. Left without ``finish``,
    nothing is kept and a file that stood there before stays as it was::

        with RecordWriter(path, channels) as writer:
            record = run(plan, attended=Attendance(sink=writer))
            writer.finish(record.meta)

    A record that is ``growing`` holds what cannot be had again. It stands in its place from the first block on, and whatever ends the
    program it opens up to the last block that was written. It is neither packed nor has it check sums, as its last block is written anew.

    Raises :class:`WriteError` where the folder cannot be written or the disk is full.
    """

    def __init__(
        self, path: str | Path, channels: Iterable[Channel], *, block: int = LARGEST_BLOCK, compress: bool = True, growing: bool = False
    ) -> None:
        self.path = Path(path)
        self.samples = 0
        self._channels = list(channels)
        self._growing = growing
        self._block = _GROWING_BLOCK if growing else min(max(block, 1), LARGEST_BLOCK)
        self._compress = compress
        self._file: Any = None
        self._disk: _Disk | None = None
        self._part: PartFile | None = None
        for channel in self._channels:
            if not channel.name or "/" in channel.name or channel.name == ".":
                raise RecordError(f"a channel cannot be called '{channel.name}'.", place=str(self.path), remedy="Name it part.output.")
        with self._as_write_error():
            self._open()

    def _open(self) -> None:
        import h5py

        self._part = PartFile(self.path)
        self._disk = _Disk(self._part.part, at_once=not self._growing)
        self._file = h5py.File(self._disk, "w", rdcc_nbytes=_CHUNK_CACHE)
        self._file.attrs["format"] = FORMAT
        self._file.attrs["version"] = VERSION
        columns = _Columns(self._block, packed=self._compress and not self._growing, summed=not self._growing)
        self._time = columns.new(self._file.id, "time", "s", "time since the start")
        group = self._file.create_group("channels").id
        self._values = [columns.new(group, channel.name, channel.unit, channel.description) for channel in self._channels]
        columns.text(self._file.id, "channel_names", json.dumps([channel.name for channel in self._channels]))
        roles = {channel.name: channel.roles for channel in self._channels if channel.roles}
        if roles:
            columns.text(self._file.id, "channel_roles", json.dumps(roles))

    def write(self, time: npt.ArrayLike, values: npt.ArrayLike) -> None:
        """Take the times (samples,) and values (channels, samples) of the next block."""
        from h5py import h5s

        times = np.ascontiguousarray(time, dtype=np.float64)
        block = np.ascontiguousarray(values, dtype=np.float64).reshape(len(self._channels), len(times))
        count, end = (len(times),), (self.samples + len(times),)
        if not len(times):
            return
        with self._as_write_error():
            here, there = h5s.create_simple(count), h5s.create_simple(end)
            there.select_hyperslab((self.samples,), count)
            for dataset, row in zip([self._time, *self._values], [times, *block], strict=True):
                dataset.set_extent(end)
                dataset.write(here, there, row)
            if self._growing:
                self._settle()
            self._check_disk()
        self.samples += len(times)

    def _settle(self) -> None:
        """Bring the file on the disk from its last whole state to the current one, and at first to its place."""
        assert self._disk is not None
        assert self._part is not None
        if self._file is not None:
            self._file.flush()
        self._disk.settle()
        self._check_disk()
        self._part.keep(durable=False)

    def finish(self, meta: Mapping[str, str | float | int] | None = None) -> None:
        """Write ``meta`` and move the whole file to its place; after the disk has refused a block there is nothing to move."""
        if self._file is None or self._disk is None or self._part is None:
            return
        with self._as_write_error():
            self._file.create_dataset("meta", data=json.dumps(dict(meta or {})))
            self._close_file()
            self._disk.settle()
            self._check_disk()
            self._disk.close(keep=True)
            self._part.keep(durable=False)

    def discard(self) -> None:
        """Remove the file unless it is a growing record in its place."""
        self._close_file()
        if self._disk is not None:
            self._disk.close(keep=False)
        if self._part is not None:
            self._part.discard()

    @contextmanager
    def _as_write_error(self) -> Iterator[None]:
        """Turn an error of the disk into a :class:`WriteError`, and remove the incomplete file."""
        try:
            yield
        except (OSError, RuntimeError) as error:
            self.discard()
            refused = refusal(self.path, error)
            if self._growing and self.samples:
                raise WriteError(refused.fact, place=refused.place, remedy=f"The first {self.samples} samples are kept.") from error
            raise refused from error

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

    def __init__(self, block: int, *, packed: bool, summed: bool) -> None:
        import h5py
        from h5py import h5d, h5p, h5s, h5t

        self._space = h5s.create_simple((0,), (h5s.UNLIMITED,))
        self._one = h5s.create(h5s.SCALAR)
        self._text = h5py.string_dtype()
        self._text_in_file = h5t.py_create(self._text, logical=True)
        self._layout = h5p.create(h5p.DATASET_CREATE)
        self._layout.set_chunk((block,))
        self._layout.set_fill_time(h5d.FILL_TIME_NEVER)
        if packed:
            self._layout.set_shuffle()
            self._layout.set_deflate(1)
        if summed:
            self._layout.set_fletcher32()

    def new(self, group: Any, name: str, unit: str, description: str) -> Any:
        """Return a new empty column of numbers."""
        from h5py import h5a, h5d, h5t

        dataset = h5d.create(group, name.encode(), h5t.IEEE_F64LE, self._space, self._layout)
        for key, text in ((b"unit", unit), (b"description", description)):
            h5a.create(dataset, key, self._text_in_file, self._one).write(np.array(text, dtype=self._text))
        return dataset

    def text(self, group: Any, name: str, text: str) -> None:
        """Write a text under a name."""
        from h5py import h5d, h5s

        h5d.create(group, name.encode(), self._text_in_file, self._one).write(h5s.ALL, h5s.ALL, np.array(text, dtype=self._text))


class _Disk(io.RawIOBase):
    """The file HDF5 writes to. When the disk refuses, it notes the failure and keeps what still comes in memory.

    HDF5 crashes the whole program when a write fails, so it must not see one; it is closed right after the first failure. Unless it writes
    ``at_once``, it holds everything back until it is called to :meth:`settle`: HDF5 writes in no order that could be broken off.
    """

    def __init__(self, path: Path, *, at_once: bool) -> None:
        self.failure: OSError | None = None
        self._raw = path.open("w+b", buffering=0)
        self._position = 0
        self._at_once = at_once
        self._length: int | None = None
        self._unwritten: list[tuple[int, bytes]] = []

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """Move to a place, as any file."""
        if whence == os.SEEK_END:
            offset += max([self._raw.seek(0, os.SEEK_END), self._length or 0, *(begin + len(piece) for begin, piece in self._unwritten)])
        self._position = offset if whence != os.SEEK_CUR else self._position + offset
        return self._position

    def tell(self) -> int:
        """Return the place, as any file."""
        return self._position

    def write(self, buffer: Any) -> int:
        """Write all of a block, or keep it in memory once the disk has refused one."""
        piece = memoryview(buffer).cast("B")
        if self.failure is None and self._at_once:
            try:
                self._write_whole(self._position, piece)
            except OSError as error:
                self.failure = error
        if self.failure is not None or not self._at_once:
            self._unwritten.append((self._position, bytes(piece)))
        self._position += len(piece)
        return len(piece)

    def settle(self) -> None:
        """Write the postponed pieces so that an interruption leaves a whole file: new data after its end first, then references."""
        if self.failure is not None or self._at_once:
            return
        end, longer = self._raw.seek(0, os.SEEK_END), False
        try:
            self._make_room(end)
            for begin, piece in self._unwritten:
                inside = min(max(end - begin, 0), len(piece))
                self._write_whole(begin + inside, memoryview(piece)[inside:])
            longer = True
            for begin, piece in sorted(self._unwritten, key=lambda item: _turn(item[1])):
                self._write_whole(begin, memoryview(piece)[: max(end - begin, 0)])
            if self._length is not None:
                self._raw.truncate(self._length)
            self._unwritten.clear()
        except OSError as error:
            self.failure = error
            if not longer:  # the earlier file is whole without it
                with contextlib.suppress(OSError):
                    self._raw.truncate(end)

    def _make_room(self, end: int) -> None:
        """Lengthen the file with real blocks on the disk: reading a hole of a full disk would kill the reader."""
        if self._length is None or self._length <= end:
            return
        if hasattr(os, "posix_fallocate"):
            os.posix_fallocate(self._raw.fileno(), end, self._length - end)
        else:
            self._raw.truncate(self._length)

    def _write_whole(self, position: int, rest: memoryview) -> None:
        self._raw.seek(position)
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
        self._length = length
        if self.failure is None and self._at_once:
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


def _turn(piece: bytes) -> int:
    """Return the order in which pieces of a growing file are overwritten: samples first, the lengths of the columns last.

    Between them the superblock, which tells where the file ends, heaps of names, and the trees that find the samples; the signatures are
    those of the HDF5 File Format Specification, version 2.0, chapters II and III.
    """
    return 0 if len(piece) == _NUMBER_BYTES * _GROWING_BLOCK else {b"\x89HDF": 1, b"GCOL": 2, b"HEAP": 2, b"TREE": 3}.get(piece[:4], 4)


def save(record: Record, path: str | Path) -> None:
    """Write a record as one HDF5 file; a file that stood there stays whole until the new one is.

    Raises :class:`WriteError` where the folder is missing or cannot be written, or the disk is full.
    """
    with RecordWriter(path, record.channels.values(), block=len(record), compress=False) as writer:
        values = [channel.values for channel in record.channels.values()]
        for begin in range(0, len(record), LARGEST_BLOCK):
            end = begin + LARGEST_BLOCK
            writer.write(record.time[begin:end], [value[begin:end] for value in values])
        writer.finish(record.meta)
