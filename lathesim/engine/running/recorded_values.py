"""The recorded numbers of a run, one row a channel, in one array that grows as blocks come in.

Where the length of the run is known the array has it from the start, so that every number is written once more and no page is asked for
twice; memory that is not written to costs nothing.
"""

from __future__ import annotations

import numpy as np

from lathesim.engine.assembly import FloatArray

_LARGEST_START = 2**24
"""Numbers the array has at most before there are any: 128 MB."""


class RecordedValues:
    """Collects blocks of shape (channels, samples); ``expected`` is how many samples there will be, 0 where that is not known."""

    def __init__(self, channels: int, expected: int) -> None:
        self._room = np.empty((channels, min(expected, _LARGEST_START // max(1, channels))))
        self._samples = 0

    @property
    def values(self) -> FloatArray:
        """What was collected, shape (channels, samples)."""
        return self._room[:, : self._samples]

    def add(self, block: FloatArray) -> None:
        """Copy a block behind the others."""
        end = self._samples + block.shape[1]
        if end > self._room.shape[1]:
            larger = np.empty((self._room.shape[0], max(end, 2 * self._room.shape[1])))
            larger[:, : self._samples] = self.values
            self._room = larger
        self._room[:, self._samples : end] = block
        self._samples = end
