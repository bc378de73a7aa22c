"""Noise drawn beforehand: the same numbers for every engine and every block length.

Each ``Noise`` has a stream of its own, numpy's Philox keyed by (seed, part.name). The stream is cut into chunks of fixed length, each with
its own counter, so that any stretch of samples can be drawn without the ones before it.
"""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Iterable

import numpy as np

from lathesim.engine.assembly import FloatArray

_CHUNK = 4096


def draw_noise(names: Iterable[str], seed: int, first: int, count: int) -> FloatArray:
    """Return standard normal numbers, shape (names, count), for the samples from ``first`` on."""
    rows = [_stretch(name, seed, first, count) for name in names]
    return np.array(rows) if rows else np.zeros((1, 1))


@functools.lru_cache(maxsize=64)
def _chunk(key: int, chunk: int) -> FloatArray:
    """Return one chunk of a stream; neighbouring blocks of a run, and runs with the same seed, share it."""
    numbers = np.random.Generator(np.random.Philox(key=key, counter=[0, 0, 0, chunk])).standard_normal(_CHUNK)
    numbers.flags.writeable = False
    return numbers


def _stretch(name: str, seed: int, first: int, count: int) -> FloatArray:
    key = int.from_bytes(hashlib.sha256(f"{seed}:{name}".encode()).digest()[:16], "little")
    chunks = range(first // _CHUNK, (first + max(count, 1) - 1) // _CHUNK + 1)
    numbers = [_chunk(key, chunk) for chunk in chunks]
    offset = first - chunks[0] * _CHUNK
    return np.concatenate(numbers)[offset : offset + count]
