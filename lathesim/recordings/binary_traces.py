"""Binary traces: KUKA's in the form of DIAdem, and MCAP, MF4 and TDMS, each read by a library of the extra ``traces``.

Sources: National Instruments, DIAdem data file format (header of a ``.dat``); the specifications of MCAP, of ROS messages and of CDR (OMG
DDS-RTPS, chapter 10). Left out: bit masks and text of DIAdem; messages of MCAP in protobuf, flatbuffers and ROS services.
"""

from __future__ import annotations

import contextlib
import gc
import importlib.util
import io
import logging
import re
import struct
import sys
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.errors import RecordingError
from lathesim.json_text import parsed_json
from lathesim.record import FloatArray
from lathesim.recordings.binary_files import refuse_deadly_file
from lathesim.recordings.number_rows import head_lines
from lathesim.recordings.raw_table import MOST_VALUES, RawTable, Reader, TimedChannel, as_table, refuse_size, timed_table, unique_names
from lathesim.recordings.recording_thresholds import READING

_DIADEM = re.compile(r"#BEGINCHANNELHEADER\s*\n(.*?)#ENDCHANNELHEADER", re.DOTALL)
_TYPES = {"REAL64": "f8", "REAL32": "f4", "INT32": "i4", "INT16": "i2", "WORD16": "u2", "WORD32": "u4"}
_NAME, _UNIT, _KIND, _FILE, _ORDER, _TYPE, _COUNT, _POINTER, _OFFSET, _FACTOR = (
    "200", "202", "210", "211", "213", "214", "220", "221", "240", "241",
)  # fmt: skip
"""Keys of a channel's header."""
_ORDERS = {"BLOCK": True, "CHANNEL": False}
"""Whether the values of a row stand together, or those of a channel."""
_IMPLICIT = ("IMPLIZIT", "IMPLICIT")
_LONGEST_HEADER = 1 << 20
"""Bytes of a header that are read: it has half a kilobyte for a channel."""
_NO_VALUE = 9.8e34
"""From here on a number of DIAdem means no value (9.9e34)."""


def reads_diadem(path: Path) -> bool:
    """Return whether a file is a header of DIAdem, as a KUKA trace has it."""
    text = "\n".join(head_lines(path)[:200])
    return "#BEGINCHANNELHEADER" in text and re.search(r"^210,(EX|IM)PLI[CZ]IT", text, re.MULTILINE) is not None


def read_diadem(path: Path) -> RawTable:
    """Read the channels of a header with their values from the files beside it."""
    if path.stat().st_size > _LONGEST_HEADER:
        raise RecordingError(f"the header has more than {_LONGEST_HEADER} bytes.", place=str(path), remedy="Save fewer channels.")
    text = path.read_text(encoding="utf-8", errors="replace")
    order = ">" if re.search(r"^112,Low -> High", text, re.MULTILINE) else "<"
    columns: dict[str, FloatArray] = {}
    units: dict[str, str] = {}
    channels = [dict(re.findall(r"^(\d+),(.*?)\s*$", block, re.MULTILINE)) for block in _DIADEM.findall(text)]
    widths = Counter(channel.get(_FILE) for channel in channels)
    names = unique_names([channel.get(_NAME, "").strip() for channel in channels])
    for name, channel in zip(names, channels, strict=True):
        try:
            count, offset, factor = int(channel[_COUNT]), float(channel[_OFFSET]), float(channel[_FACTOR])
            refuse_size(path, count, len(channels))
            if channel[_KIND] in _IMPLICIT:
                values = np.arange(count, dtype=np.float64)
            else:
                values = _stored(path, channel, count, order, widths[channel[_FILE]])
        except (KeyError, ValueError) as error:
            fact = f"the header of the channel '{name}' is damaged: {error}."
            raise RecordingError(fact, place=str(path), remedy="Save the trace again.") from None
        scaled = values * factor + offset
        scaled[np.abs(values) > _NO_VALUE] = np.nan
        columns[name], units[name] = scaled, channel.get(_UNIT, "").strip("[] ")
    notes = () if len({len(values) for values in columns.values()}) < 2 else ("the channels differ in length",)
    return as_table(path, columns, units, notes, {})


def _stored(path: Path, channel: Mapping[str, str], count: int, order: str, width: int) -> FloatArray:
    """Return the values of a channel from its file in the folder of the header; ``width`` channels share it, value by value in a block."""
    name = re.split(r"[\\/]", channel[_FILE])[-1]
    file = next((other for other in sorted(path.parent.iterdir()) if other.name.lower() == name.lower() and other.is_file()), None)
    if file is None:
        raise RecordingError(
            f"the values stand in '{name}', which is not beside it.", place=str(path), remedy="Put both files into a folder."
        )
    kind, pointer = np.dtype(order + _TYPES[channel[_TYPE]]), int(channel[_POINTER]) - 1
    block = _ORDERS[channel[_ORDER]]
    if block and not (file.stat().st_size == count * width * kind.itemsize and 0 <= pointer < width):
        fact = f"{name} has {file.stat().st_size} bytes, and the header promises {count} values of {width} channels."
        raise RecordingError(fact, place=str(path), remedy="Save the trace again.")
    if not block and not 0 <= pointer <= file.stat().st_size // kind.itemsize - count:
        raise RecordingError(f"{name} is shorter than the header promises.", place=str(path), remedy="Save the trace again.")
    stored = np.memmap(file, dtype=kind, mode="r")
    found: FloatArray = np.asarray(stored[pointer::width] if block else stored[pointer : pointer + count], dtype=np.float64)
    return found


@dataclass(frozen=True)
class LibraryForm:
    """A kind of file that a library of the extra ``traces`` reads: its first bytes, a trial in another process, and how it is read."""

    name: str
    suffixes: tuple[str, ...]
    mark: bytes
    module: str
    trial: str
    channels: Callable[[Path], RawTable]

    def reads(self, path: Path) -> bool:
        """Return whether a file begins as this kind."""
        with path.open("rb") as file:
            return file.read(len(self.mark)) == self.mark

    def read(self, path: Path) -> RawTable:
        """Read a file; :class:`RecordingError` where the library is missing, or does not read it."""
        if importlib.util.find_spec(self.module) is None:
            fact = f"{self.name} files need the package '{self.module}', which is not installed."
            raise RecordingError(fact, place=str(path), remedy="Install it with: python -m pip install 'lathesim[traces]'")
        with _silent():
            try:
                refuse_deadly_file(path, self.trial)
                return self.channels(path)
            except RecordingError:
                raise
            except Exception:  # these libraries raise what they like over a damaged file
                pass
            gc.collect()  # and once more where they take a half-opened one down
        raise RecordingError(f"the {self.name} file is damaged or cut off.", place=str(path), remedy="Save it again.")

    @property
    def reader(self) -> Reader:
        """The reader of such files."""
        return Reader(self.name, self.suffixes, f"{self.name} file", self.reads, self.read)


@contextlib.contextmanager
def _silent() -> Iterator[None]:
    """Keep warnings, log lines, prints, and what fails while an object is taken down, from the user."""
    before, hook = logging.root.manager.disable, sys.unraisablehook
    logging.disable(logging.CRITICAL)
    sys.unraisablehook = lambda unraisable: None
    try:
        with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            warnings.simplefilter("ignore")
            yield
    finally:
        logging.disable(before)
        sys.unraisablehook = hook


def _read_mf4(path: Path) -> RawTable:
    from asammdf import MDF

    series = []
    with MDF(path) as file:
        counts = [(group.channel_group.cycles_nr, len(group.channels)) for group in file.groups]
        refuse_size(path, max((rows for rows, _ in counts), default=0), 1)
        if sum(rows * channels for rows, channels in counts) > MOST_VALUES:
            raise RecordingError(f"the file has more than {MOST_VALUES} values.", place=str(path), remedy="Keep fewer signals.")
        for signal in file.iter_channels(skip_master=True):
            if signal.samples.dtype.kind in "fiub" and signal.samples.ndim == 1:
                values = signal.samples.astype(np.float64)
                if signal.invalidation_bits is not None:
                    values[np.asarray(signal.invalidation_bits, dtype=bool)] = np.nan
                series.append(TimedChannel(signal.name, signal.unit or "", signal.timestamps.astype(np.float64), values))
    return timed_table(path, series)


_LEAD = struct.Struct("<4sIIQQ")
"""The head of a segment of TDMS: tag, contents, version, and the bytes from behind it to the next segment and to the values."""


def _check_segments(path: Path) -> None:
    """Raise ValueError where the segments of a TDMS file do not follow one another up to its end; the library would read on."""
    size, place = path.stat().st_size, 0
    with path.open("rb") as file:
        while place < size:
            file.seek(place)
            tag, _, _, following, values = _LEAD.unpack(file.read(_LEAD.size).ljust(_LEAD.size, b"\0"))
            place += _LEAD.size + following
            if tag != b"TDSm" or values > following or place > size:
                raise ValueError("the file is cut off within a segment")


def _read_tdms(path: Path) -> RawTable:
    from nptdms import TdmsFile

    _check_segments(path)
    series: list[TimedChannel] = []
    plain: dict[str, FloatArray] = {}
    units: dict[str, str] = {}
    with TdmsFile.open(path) as file:
        channels = [channel for group in file.groups() for channel in group.channels()]
        if sum(len(channel) for channel in channels) > MOST_VALUES:
            raise RecordingError(f"the file has more than {MOST_VALUES} values.", place=str(path), remedy="Keep fewer signals.")
        single = len({channel.name for channel in channels}) == len(channels)
        for channel in channels:
            values = np.asarray(channel[:])
            if values.dtype.kind not in "fiub" or not len(values):
                continue
            name = channel.name if single else f"{channel.group_name}/{channel.name}"
            unit = str(channel.properties.get("unit_string", ""))
            if channel.properties.get("wf_increment", 0.0) > 0.0:
                series.append(TimedChannel(name, unit, channel.time_track(), values.astype(np.float64)))
            else:
                plain[name], units[name] = values.astype(np.float64), unit
    if series:
        table = timed_table(path, series)
        plain, units = {**table.columns, **plain}, {**table.units, **units}
    return as_table(path, plain, units, table.notes if series else ("the file tells no sampling period",), {})


_SIZES = {
    "bool": "?", "byte": "B", "char": "B", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I",
    "int64": "q", "uint64": "Q", "float32": "f", "float64": "d",
}  # fmt: skip
"""Types of numbers in messages of ROS, as :mod:`struct` names them."""
_FIELD = re.compile(r"^[ \t]*([\w/]+)(?:<=\d+)?(\[(?:<=)?\d*\])?[ \t]+(\w+)(?:[ \t]+[^=\s#][^#\n]*)?[ \t]*(?:#.*)?\r?$", re.MULTILINE)
Fields = list[tuple[str, str, str]]
"""Type, array and name of each field of a message."""


def message_types(name: str, text: str) -> dict[str, Fields]:
    """Return the fields of a message, under an empty name, and of the messages in it by their names without package."""
    own, *others = re.split(r"^=+\s*$", text, flags=re.MULTILINE)
    found = {"": _FIELD.findall(own)}
    for other in others:
        head, _, body = other.strip().partition("\n")
        found[re.split(r"[/ ]", head.strip())[-1]] = _FIELD.findall(body)
    return found


@dataclass
class RosMessage:
    """The bytes of a message, read value by value; those of ROS 2 (CDR) are aligned, those of ROS 1 are not."""

    data: bytes
    types: Mapping[str, Fields]
    aligned: bool
    order: str = "<"
    place: int = 0
    begin: int = 0

    def number(self, kind: str) -> float:
        """Return the next number."""
        size = struct.calcsize(kind)
        if self.aligned:
            self.place += -(self.place - self.begin) % size
        (value,) = struct.unpack_from(self.order + kind, self.data, self.place)
        self.place += size
        return float(value) if kind != "I" else value

    def text(self) -> str:
        """Return the next text."""
        length = int(self.number("I"))
        found = self.data[self.place : self.place + length]
        if len(found) != length:
            raise ValueError("a text is cut off")
        self.place += length
        return found.decode("utf-8", errors="replace").rstrip("\0")

    def values(self, kind: str = "") -> dict[str, Any]:
        """Return the fields of a message by name: numbers, texts, messages, and lists of them."""
        found: dict[str, Any] = {}
        for item, array, name in self.types[kind]:
            if not array:
                found[name] = self.value(item)
                continue
            count = int(array.strip("[]") or 0) if array.strip("[]").isdigit() else int(self.number("I"))
            if count > len(self.data):
                raise ValueError("a list is longer than its message")
            found[name] = [self.value(item) for _ in range(count)]
        return found

    def value(self, kind: str) -> Any:
        """Return the next value of a type."""
        if kind in _SIZES:
            return self.number(_SIZES[kind])
        if kind == "string":
            return self.text()
        if kind in ("time", "duration"):
            return {"sec": self.number("I"), "nanosec": self.number("I")}
        return self.values(kind.rpartition("/")[2])


def _flat(value: Any, prefix: str, names: list[str]) -> Iterator[tuple[str, float]]:
    """Yield the numbers in a message with their paths. Numbers of a list are called as the texts of the list ``name`` beside it."""
    if isinstance(value, Mapping):
        own = value.get("name")
        texts = own if isinstance(own, list) and all(isinstance(item, str) for item in own) else names
        for key, item in value.items():
            yield from _flat(item, f"{prefix}.{key}", texts)
    elif isinstance(value, list):
        for number, item in enumerate(value[: READING.matrix]):
            yield from _flat(item, f"{prefix}.{names[number] if len(names) == len(value) else number}", names)
    elif isinstance(value, (int, float)):
        yield prefix, float(value)


@dataclass
class _Topic:
    """The messages of a channel: when each was taken [ns], and of each number in them where and what it was."""

    times: list[float] = field(default_factory=list)
    numbers: dict[str, tuple[list[int], list[float]]] = field(default_factory=dict)

    def take(self, message: Any, logged: int) -> None:
        """Take a message; the stamp in its header counts before the time at which it was logged."""
        row = len(self.times)
        stamp = message.get("header", {}).get("stamp", {}) if isinstance(message, Mapping) else {}
        seconds, rest = stamp.get("sec", stamp.get("secs")), stamp.get("nanosec", stamp.get("nsec", stamp.get("nsecs", 0)))
        self.times.append(logged if seconds is None else 1e9 * seconds + rest)
        for name, value in _flat({key: item for key, item in message.items() if key != "header"}, "", []):
            rows, values = self.numbers.setdefault(name, ([], []))
            rows.append(row)
            values.append(value)


def _read_mcap(path: Path) -> RawTable:
    from mcap.reader import make_reader

    topics: dict[str, _Topic] = {}
    types: dict[int, dict[str, Fields]] = {}
    left_out: dict[str, str] = {}
    held = 0
    with path.open("rb") as file:
        for schema, channel, message in make_reader(file, validate_crcs=True).iter_messages(log_time_order=False):
            topic = topics.setdefault(channel.topic, _Topic())
            if channel.message_encoding == "json":
                topic.take(parsed_json(message.data), message.log_time)
            elif channel.message_encoding in ("cdr", "ros1") and schema is not None and schema.encoding in ("ros2msg", "ros1msg"):
                known = types.setdefault(schema.id, message_types(schema.name, schema.data.decode("utf-8", errors="replace")))
                topic.take(_ros(message.data, known, channel.message_encoding == "cdr").values(), message.log_time)
            else:
                left_out[channel.topic] = channel.message_encoding
            held += len(message.data)
            if held > _LARGEST:
                raise RecordingError("the messages take more than 0.8 GB.", place=str(path), remedy="Keep fewer topics.")
    first = min((min(topic.times) for topic in topics.values() if topic.times), default=0.0)
    series = []
    for name, topic in topics.items():
        times: FloatArray = (np.array(topic.times) - first) * 1e-9
        for item, (rows, values) in topic.numbers.items():
            column = np.full(len(times), np.nan)
            column[rows] = values
            series.append(TimedChannel(f"{name}{item}", "", times, column))
    told = tuple(f"left out, as its encoding '{encoding}' is not read: {topic}" for topic, encoding in left_out.items())
    return timed_table(path, series, told)


def _ros(data: bytes, types: Mapping[str, Fields], aligned: bool) -> RosMessage:
    """Return a message of ROS at its first value; CDR has a head of four bytes, the second of which tells the order of bytes."""
    return RosMessage(data, types, True, "<" if data[1] & 1 else ">", 4, 4) if aligned else RosMessage(data, types, False)


_LARGEST = 8 * MOST_VALUES
"""Bytes of messages that are read."""
LIBRARY_FORMS = (
    LibraryForm("MCAP", (".mcap",), b"\x89MCAP0\r\n", "mcap", "import sys; from mcap.reader import make_reader; "
                "sum(1 for _ in make_reader(open(sys.argv[1], 'rb'), validate_crcs=True).iter_messages(log_time_order=False))", _read_mcap),
    LibraryForm("MF4", (".mf4", ".mdf", ".dat"), b"MDF     ", "asammdf", "import sys; from asammdf import MDF; "
                "sum(1 for _ in MDF(sys.argv[1]).iter_channels())", _read_mf4),
    LibraryForm("TDMS", (".tdms",), b"TDSm", "nptdms", "import sys; from nptdms import TdmsFile; TdmsFile.read(sys.argv[1])", _read_tdms),
)  # fmt: skip
BINARY_TRACE_READERS = [
    *(form.reader for form in LIBRARY_FORMS),
    Reader("KUKA trace", (".dat",), "header of a KUKA trace", reads_diadem, read_diadem),
]
