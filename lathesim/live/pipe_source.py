"""Lines of numbers from a pipe as a source, as LinuxCNC's halsampler writes them: one line a sample, one column a pin."""

from __future__ import annotations

import asyncio
import os
import stat
import sys
from collections.abc import AsyncIterator, Sequence
from pathlib import Path

import numpy as np

from lathesim.live.samples import LiveError, SampleBlock, Signal
from lathesim.record import FloatArray

LARGEST_LINE = 4096
"""Bytes of a line at most; a longer one is left out and told."""
_CHUNK = 1 << 16
_EVERY = 0.01
"""Seconds between two looks at a pipe that is empty."""
_NOT_KNOWN = -1


class PipeSource:
    """Samples from a pipe, or with ``-`` from the standard input, one line each.

    A line holds the values of ``signals`` in their order, each with a factor to SI, parted by blanks or commas. One number more at the
    front is the number of the sample, as ``halsampler -t`` writes it. The word ``overrun`` is a gap. Every sample is a ``period`` [s] after
    the one before. What is no line of numbers is left out, and told once.
    """

    def __init__(self, place: str, signals: Sequence[tuple[Signal, float]], period: float) -> None:
        self.name = "the standard input" if place == "-" else place
        self._place, self._period = place, period
        self.signals = tuple(signal for signal, _ in signals)
        self._factors = np.array([factor for _, factor in signals])
        self._next = 0
        self._offset = _NOT_KNOWN
        self._notes: list[str] = []
        self._told: set[str] = set()
        self.remarks: list[str] = []

    async def blocks(self) -> AsyncIterator[SampleBlock]:
        """Return the samples as they come, until the pipe ends; memory is at most a line and what was read last."""
        descriptor = self._open()
        rest, begun = b"", False
        try:
            while True:
                try:
                    data = os.read(descriptor, _CHUNK)
                except BlockingIOError:
                    await asyncio.sleep(_EVERY)
                    continue
                if not data and not begun and self._place != "-":
                    await asyncio.sleep(_EVERY)  # nobody writes to it yet
                    continue
                begun = True
                *lines, rest = (rest + data).split(b"\n")
                if not data:
                    lines = [rest]
                elif len(rest) > LARGEST_LINE:
                    self._note(f"a line is longer than {LARGEST_LINE} bytes")
                    rest = b"x"  # what follows of it is no line of numbers either
                block = self._block(lines)
                if block is not None:
                    yield block
                if not data:
                    return
                await asyncio.sleep(0)
        finally:
            os.set_blocking(descriptor, True)
            os.close(descriptor)

    def _open(self) -> int:
        try:
            descriptor = os.dup(sys.stdin.fileno()) if self._place == "-" else os.open(self._place, os.O_RDONLY | os.O_NONBLOCK)
        except OSError as error:
            raise LiveError(f"the pipe cannot be read: {error.strerror}.", place=self._place, remedy="Is it there?") from None
        os.set_blocking(descriptor, False)
        return descriptor

    def _block(self, lines: Sequence[bytes]) -> SampleBlock | None:
        numbers, rows = [], []
        for text in lines:
            row = self._row(text)
            if row is not None:
                numbers.append(self._next)
                rows.append(row)
                self._next += 1
        if not rows:
            return None
        notes, self._notes = tuple(self._notes), []
        return SampleBlock(np.array(numbers) * self._period, np.array(rows).T * self._factors[:, None], notes)

    def _row(self, text: bytes) -> FloatArray | None:
        line = text.decode("ascii", "replace").strip()
        if not line or line.startswith("#"):
            return None
        if line.startswith("overrun"):
            self._next += 1
            self._note("the sampler ran over: samples are lost")
            return None
        words = line.replace(",", " ").split()
        try:
            values = np.array([float(word) for word in words[:200]])
        except ValueError:
            self._note("a line holds no numbers")
            return None
        count = len(self._factors)
        if len(values) == count + 1 and np.isfinite(values[0]):
            self._number(int(values[0]))
            values = values[1:]
        if len(values) != count:
            self._note(f"a line has {len(values)} numbers, and {count} are due")
            return None
        return values

    def _number(self, number: int) -> None:
        """Take the number of a sample: where some are missing the time goes on with it."""
        if self._offset == _NOT_KNOWN:
            self._offset = number - self._next
        self._next = number - self._offset

    def _note(self, sentence: str) -> None:
        if sentence not in self._told and len(self._told) < 20:
            self._told.add(sentence)
            self._notes.append(sentence)


def is_pipe(place: str) -> bool:
    """Return whether a source is the standard input or a named pipe."""
    if place == "-":
        return True
    try:
        return stat.S_ISFIFO(Path(place).stat().st_mode)
    except OSError:
        return False
