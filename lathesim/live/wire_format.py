"""The wire format between planner and servo side, version 1. Everything is little-endian.

A frame is a header of 12 bytes and a payload::

    magic   4 bytes   b"LSET"
    version 1 byte    1
    kind    1 byte    see :class:`FrameKind`
    zero    2 bytes   0
    length  4 bytes   bytes of the payload, at most 1 MiB (64 KiB for texts)

Over TCP frames follow one another. A feedback datagram over UDP is one frame. Payloads:

    HELLO, STATUS, ERROR  a JSON object in UTF-8
    SET_POINTS            u64 number of the first set-point, u32 set-points, u16 axes, u16 0, then f64 set-point after set-point
    END                   u64 set-points in all
    FEEDBACK              u64 number of the first sample, u32 samples, u16 channels, u16 0, then f64 sample after sample

A planner greets with ``axes``, ``period`` and ``udp_port``. An onlooker greets with ``looks_on: true`` and ``udp_port``; whenever a stream
begins he is greeted with ``machine``, ``period``, ``channels`` and ``begin``, the number of its first sample, and samples are numbered on
through all streams.

A number that is not finite, a count that does not fit the length, another version or another magic ends the connection with ERROR. The
first sample has the number 0, and its time is number x period. Nothing received is ever run.
"""

from __future__ import annotations

import enum
import json
import struct
from dataclasses import dataclass
from typing import Any

import numpy as np

from lathesim.live.samples import LiveError
from lathesim.record import FloatArray

MAGIC, VERSION = b"LSET", 1
_HEADER = struct.Struct("<4sBBHI")
_NUMBERS = struct.Struct("<QIHH")
_TOTAL = struct.Struct("<Q")
LARGEST_PAYLOAD = 1 << 20
LARGEST_TEXT = 1 << 16
MOST_AXES = 64
LARGEST_PORT = 65_535
_DOUBLE = 8
"""Bytes of a number."""
_CHANNEL = 3
"""Texts that describe a channel: name, unit, and what it is; each shorter than ``_LONGEST_CHANNEL``."""
_LONGEST_CHANNEL = 200
LARGEST_DATAGRAM = 1400
"""Bytes of a feedback datagram, so that Ethernet need not cut it."""


class FrameKind(enum.IntEnum):
    """What a frame holds."""

    HELLO = 1
    SET_POINTS = 2
    END = 3
    STATUS = 4
    FEEDBACK = 5
    ERROR = 6


class WireError(LiveError):
    """A peer does not keep to the wire format."""


@dataclass(frozen=True, eq=False)
class Numbers:
    """Samples of a frame: number of the ``first`` and ``values`` (samples, columns)."""

    first: int
    values: FloatArray


@dataclass(frozen=True)
class Frame:
    """One frame: its kind and its payload as it came."""

    kind: FrameKind
    payload: bytes


def frame(kind: FrameKind, payload: bytes) -> bytes:
    """Return a frame's bytes."""
    return _HEADER.pack(MAGIC, VERSION, kind, 0, len(payload)) + payload


def text_frame(kind: FrameKind, data: dict[str, Any]) -> bytes:
    """Return a frame with a JSON object."""
    return frame(kind, json.dumps(data, allow_nan=False).encode())


def numbers_frame(kind: FrameKind, first: int, values: FloatArray) -> bytes:
    """Return a frame with samples (samples, columns); the first has the number ``first``."""
    table = np.ascontiguousarray(values, dtype="<f8")
    return frame(kind, _NUMBERS.pack(first, len(table), table.shape[1], 0) + table.tobytes())


def end_frame(total: int) -> bytes:
    """Return the frame that ends a stream of ``total`` set-points."""
    return frame(FrameKind.END, _TOTAL.pack(total))


def read_text(given: Frame) -> dict[str, Any]:
    """Return the JSON object of a frame; :class:`WireError` where there is none."""
    try:
        data = json.loads(given.payload.decode("utf-8"), parse_constant=_refuse_constant)
    except (UnicodeDecodeError, ValueError, RecursionError):
        raise WireError(f"a {given.kind.name} frame holds no JSON object.") from None
    if not isinstance(data, dict):
        raise WireError(f"a {given.kind.name} frame holds no JSON object.")
    return data


def read_numbers(given: Frame) -> Numbers:
    """Return the samples of a frame; :class:`WireError` where counts and length differ or a number is not finite."""
    if len(given.payload) < _NUMBERS.size:
        raise WireError(f"a {given.kind.name} frame of {len(given.payload)} bytes is too short.")
    first, count, columns, _ = _NUMBERS.unpack_from(given.payload)
    if not 1 <= columns <= MOST_AXES or len(given.payload) != _NUMBERS.size + _DOUBLE * count * columns:
        told = f"{count} samples of {columns} columns"
        raise WireError(f"a {given.kind.name} frame says {told} and holds {len(given.payload) - _NUMBERS.size} bytes.")
    values = np.frombuffer(given.payload, dtype="<f8", offset=_NUMBERS.size).reshape(count, columns).astype(np.float64)
    if not np.isfinite(values).all():
        number = first + int(np.nonzero(~np.isfinite(values))[0][0])
        raise WireError(f"sample {number} holds a number that is not finite.")
    return Numbers(first, values)


def read_total(given: Frame) -> int:
    """Return how many set-points a stream had."""
    if len(given.payload) != _TOTAL.size:
        raise WireError(f"an END frame has {len(given.payload)} bytes, and {_TOTAL.size} are expected.")
    return int(_TOTAL.unpack(given.payload)[0])


class Decoder:
    """Cuts a stream of bytes into frames, however it was cut on its way; holds at most one frame and what was fed last."""

    def __init__(self) -> None:
        self._bytes = bytearray()

    def feed(self, data: bytes) -> list[Frame]:
        """Return the frames that are whole now; :class:`WireError` at the first header that cannot be."""
        self._bytes += data
        found = []
        begin = 0
        while len(self._bytes) - begin >= _HEADER.size:
            kind, length = _checked(bytes(self._bytes[begin : begin + _HEADER.size]))
            end = begin + _HEADER.size + length
            if len(self._bytes) < end:
                break
            found.append(Frame(kind, bytes(self._bytes[begin + _HEADER.size : end])))
            begin = end
        del self._bytes[:begin]
        return found

    @property
    def waiting(self) -> int:
        """Return how many bytes of an unfinished frame wait."""
        return len(self._bytes)


def read_datagram(data: bytes) -> Frame:
    """Return the frame of a datagram; :class:`WireError` where it is not exactly one."""
    if len(data) < _HEADER.size:
        raise WireError(f"a datagram of {len(data)} bytes is too short.")
    kind, length = _checked(data[: _HEADER.size])
    if len(data) != _HEADER.size + length:
        raise WireError(f"a datagram says {length} bytes and holds {len(data) - _HEADER.size}.")
    return Frame(kind, data[_HEADER.size :])


def samples_of_a_datagram(columns: int) -> int:
    """Return how many samples of ``columns`` numbers fit into a datagram; at least one."""
    return max(1, (LARGEST_DATAGRAM - _HEADER.size - _NUMBERS.size) // (8 * columns))


def _checked(header: bytes) -> tuple[FrameKind, int]:
    magic, version, kind, zero, length = _HEADER.unpack(header)
    if magic != MAGIC:
        raise WireError(f"the peer sent {magic!r} where a frame begins with {MAGIC!r}.", remedy="Is it another program's port?")
    if version != VERSION:
        raise WireError(f"the peer speaks version {version}, and this program version {VERSION}.")
    if kind not in set(FrameKind) or zero:
        raise WireError(f"there is no frame of kind {kind}.")
    known = FrameKind(kind)
    largest = LARGEST_PAYLOAD if known in (FrameKind.SET_POINTS, FrameKind.FEEDBACK) else LARGEST_TEXT
    if length > largest:
        raise WireError(f"a {known.name} frame of {length} bytes is too long; {largest} are the most.")
    return known, length


def _refuse_constant(name: str) -> float:
    raise ValueError(name)


def describes_channel(row: object) -> bool:
    """Return whether a part of a greeting is the description of a channel."""
    if not isinstance(row, list) or len(row) != _CHANNEL:
        return False
    return all(isinstance(text, str) and len(text) < _LONGEST_CHANNEL for text in row)
