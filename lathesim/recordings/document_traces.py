"""Traces in documents: SINUMERIK traces and frequency responses in XML, and the JSON of SINUMERIK Edge.

Sources: the formats as SINUMERIK Operate 4.7 and later write them (Solution Line Trace; SAT Library, whose arrays are doubles in base 85)
and as Analyze MyWorkpiece /Capture4Analysis writes them. Left out: settings, triggers and events; low-frequency data of Edge.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from xml.parsers import expat

import numpy as np
import numpy.typing as npt

from lathesim.errors import RecordingError
from lathesim.json_text import parsed_json
from lathesim.record import FloatArray
from lathesim.recordings.raw_table import (
    MOST_VALUES,
    RawTable,
    Reader,
    TimedChannel,
    as_table,
    counted,
    refuse_size,
    timed_table,
    unique_names,
)

_HEAD = 4096
_LARGEST_XML = 10 * MOST_VALUES
"""Bytes of XML that are read: a value takes 15 of them at least."""
_DEEPEST = 64
"""Elements within elements that a document may have; traces have a dozen."""
Attributes = dict[str, str]


def _parse(path: Path, start: Callable[[str, Attributes], None], end: Callable[[str, str], None]) -> None:
    """Read a document; ``start`` gets each element with its attributes, ``end`` each with the text in it.

    A document type is refused, and with it every entity of its own. Raises :class:`RecordingError`.
    """
    if path.stat().st_size > _LARGEST_XML:
        raise RecordingError(f"the file is larger than {_LARGEST_XML // 10**6} MB.", place=str(path), remedy="Record a shorter time.")
    texts: list[list[str]] = []
    parser = expat.ParserCreate()

    def begin(name: str, attributes: Attributes) -> None:
        texts.append([])
        if len(texts) > _DEEPEST:
            raise RecordingError("the XML is nested too deeply.", place=str(path))
        start(name, attributes)

    def refuse(*_: object) -> None:
        remedy = "Save the trace again; a control writes none."
        raise RecordingError("the XML declares a document type, which is not read.", place=str(path), remedy=remedy)

    parser.buffer_text = True
    parser.StartElementHandler = begin
    parser.CharacterDataHandler = lambda text: texts[-1].append(text)
    parser.EndElementHandler = lambda name: end(name, "".join(texts.pop()))
    parser.StartDoctypeDeclHandler = refuse
    try:
        with path.open("rb") as file:
            parser.ParseFile(file)
    except (expat.ExpatError, ValueError, LookupError) as error:
        line = parser.CurrentLineNumber
        fact = f"the XML is damaged or cut off at line {line}: {error}."
        raise RecordingError(fact, place=str(path), remedy="Save the trace again.") from None


def _begins(root: bytes) -> Callable[[Path], bool]:
    """Return what tells whether a file is XML whose first element is ``root``, perhaps with more behind the name."""

    def reads(path: Path) -> bool:
        with path.open("rb") as file:
            head = file.read(_HEAD)
        return re.match(rb"(?:\xef\xbb\xbf)?\s*<[?!\w]", head) is not None and b"<" + root in head

    return reads


_NO_VALUE = 9.2e18
"""From here on a number of a trace is the pattern of bits for infinity, read as a whole number: no value (0x7ff0000000000000)."""
_EVERY = 0.95
"""Share of the promised samples from which on a channel is written at each of them, and otherwise where it changes (assumed)."""
_BESIDE = 0.05
"""Share of a period by which a record may lie beside its slot (assumed: times have six decimals, and the fastest period is 125 us)."""
_SPEEDS = {("deg", "rpm"): 6.0, ("mm", "mm/min"): 1.0 / 60.0, ("mm", "m/min"): 1000.0 / 60.0, ("mm", "mm/s"): 1.0}
"""Units of place and speed, and how many units of place a second one of speed is."""
_NEAR = 0.5 * math.log(1000.0 / 60.0 / 6.0)
"""Logarithm by which the change of a place may differ from its speed: half way between the two pairs of units that are nearest to each
other, 1000/60 and 6 times a second."""


@dataclass
class _Trace:
    """Channels of a trace by their field names, the times of its records, and for each channel the records it has a value in."""

    channels: dict[str, Attributes] = field(default_factory=dict)
    times: list[float] = field(default_factory=list)
    rows: dict[str, list[int]] = field(default_factory=dict)
    values: dict[str, list[float]] = field(default_factory=dict)
    damaged: list[int] = field(default_factory=list)
    """Records with a field that no channel has."""

    def start(self, name: str, attributes: Attributes) -> None:
        """Take a channel or a record."""
        if name == "dataSignal":
            key = attributes["id"]
            self.channels[key], self.rows[key], self.values[key] = attributes, [], []
        elif name == "rec":
            row = len(self.times)
            self.times.append(float(attributes.pop("time")))
            if attributes.keys() - self.channels.keys():
                self.damaged.append(row)
                return
            for key, text in attributes.items():
                self.rows[key].append(row)
                self.values[key].append(float(text))

    def interval(self, key: str) -> float:
        """Return the sampling period [s] of a channel as the head tells it; NaN where it does not."""
        return _number(self.channels[key].get("interval"))


@dataclass(frozen=True, eq=False)
class _Slots:
    """The even clock of a trace: its period [s], the slot of each record, and the slots whose record is not known."""

    period: float
    start: float
    places: npt.NDArray[np.int64]
    usable: npt.NDArray[np.bool_]
    lost: npt.NDArray[np.bool_]

    @property
    def times(self) -> FloatArray:
        """The times of the slots [s]."""
        times: FloatArray = self.start + self.period * np.arange(len(self.lost), dtype=np.float64)
        return times


def read_trace(path: Path) -> RawTable:
    """Read a SINUMERIK trace: each channel at the times of the fastest one, called as its variable.

    A channel with fewer values than the head promises is written where it changes, and held in between. One that is written at each of its
    samples has no value between them. Where such a sample is missing a record was lost: what is held is then unknown until it is written.
    """
    trace = _Trace()
    try:
        _parse(path, trace.start, lambda name, text: None)
    except KeyError as error:
        raise RecordingError(f"the trace is damaged: an element has no {error}.", place=str(path), remedy="Save it again.") from None
    if len(trace.times) < 2 or not any(trace.rows.values()):
        return as_table(path, {}, {}, (), {})
    slots = _slots(path, trace)
    columns, notes = _columns(trace, slots)
    names = dict(zip(trace.channels, unique_names(["time", *map(_variable, trace.channels.values())])[1:], strict=True))
    units, told = _units(trace, columns, slots.period)
    named = {"time": slots.times} | {names[key]: values for key, values in columns.items() if np.isfinite(values).any()}
    found = {"time": "s"} | {names[key]: unit for key, unit in units.items()}
    others = {
        text: names[key] for key, channel in trace.channels.items() if (text := channel.get("description", "")) and names[key] in named
    }
    return replace(as_table(path, named, found, (*notes, told), {}), other_names=others)


def _slots(path: Path, trace: _Trace) -> _Slots:
    """Return the clock of a trace. A record that is not later than the one before and earlier than the next is damaged."""
    times = np.array(trace.times)
    usable = np.ones(len(times), dtype=bool)
    between = (times[:-2] < times[1:-1]) & (times[1:-1] < times[2:])
    usable[1:-1] = between | ~(times[:-2] < times[2:])
    usable[trace.damaged] = False
    steps = np.diff(times[usable])
    periods = sorted({trace.interval(key) for key in trace.channels})
    if not periods[0] > 0.0 or not np.isfinite(periods).all():
        raise RecordingError("the head has no sampling period for a channel.", place=str(path), remedy="Save the trace again.")
    period = next((item for item in periods if (np.abs(steps - item) < _BESIDE * item).any()), 0.0)
    if not period or not (steps > 0.0).all() or not np.isfinite(times).all():
        fact = "the times of the records do not rise" if period else "no records are apart by the sampling period that the head tells"
        raise RecordingError(f"{fact}.", place=str(path), remedy="The trace is damaged; save it again.")
    start = float(times[usable][0])
    refuse_size(path, int(min((times[usable][-1] - start) / period, 1e15)), len(trace.channels))
    places = np.round((times - start) / period).astype(np.int64)
    good = places[usable]
    off_clock = np.abs((times[usable] - start) / period - good).max() > _BESIDE
    if off_clock or (np.diff(good) < 1).any():
        raise RecordingError("the records do not come on an even clock.", place=str(path), remedy="The trace is damaged; save it again.")
    lost = np.zeros(int(good[-1]) + 1, dtype=bool)
    for row in np.flatnonzero(~usable):
        before, after = places[:row][usable[:row]], places[row:][usable[row:]]
        if len(before) and len(after):
            lost[before[-1] + 1 : after[0]] = True
    return _Slots(period, start, places, usable, lost)


def _columns(trace: _Trace, slots: _Slots) -> tuple[dict[str, FloatArray], list[str]]:
    """Return the values of each channel in every slot, and what a person should know of them."""
    found: dict[str, FloatArray] = {}
    held, notes, lost = [], [], slots.lost.copy()
    recorded = np.zeros(len(lost), dtype=bool)
    recorded[slots.places[slots.usable]] = True
    for key, channel in trace.channels.items():
        kept = slots.usable[trace.rows[key]]
        at = slots.places[trace.rows[key]][kept]
        values = np.full(len(lost), np.nan)
        values[at] = np.array(trace.values[key])[kept]
        written = np.isfinite(values)
        values[~(np.abs(values) < _NO_VALUE)] = np.nan
        found[key] = values
        step = trace.interval(key) / slots.period
        promised, room = _number(channel.get("datapointCount")), len(lost) / step
        if len(at) and not abs(promised - room) <= (1.0 - _EVERY) * room:
            notes.append(f"{_variable(channel)}: the head promises {promised:g} values, and its records have room for {room:.0f}")
            promised = room
        if len(at) < _EVERY * promised:
            held.append(key)
        elif len(at) > 1:
            expected = np.arange(at[0], at[-1] + 1, max(1, round(step)))
            if written[expected][recorded[expected]].all():
                lost[expected[~recorded[expected]]] = True
    for key in held:
        found[key] = _held(found[key], lost)
    if lost.any():
        notes.append(f"{counted(int(lost.sum()), 'record', 'is', 'are')} missing; what was held there is unknown until it is written again")
    return found, notes


def _held(values: FloatArray, lost: npt.NDArray[np.bool_]) -> FloatArray:
    """Return values with each held until the next one, or until a record is lost."""
    places = np.arange(len(values))
    last = np.maximum.accumulate(np.where(np.isfinite(values), places, -1))
    gone = np.maximum.accumulate(np.where(lost & np.isnan(values), places, -1))
    found: FloatArray = np.where((last > gone) & (last >= 0), values[last], np.nan)
    return found


def _variable(channel: Attributes) -> str:
    """Return the name of a channel: the last step of its variable, with the number of its axis behind it."""
    return re.sub(r".*/(\w+) \[u\d+, (\d+)\]$", r"\1|\2", channel.get("name", "") or channel.get("description", ""))


def _number(text: str | None) -> float:
    try:
        return float(text or "nan")
    except ValueError:
        return np.nan


def _units(trace: _Trace, columns: dict[str, FloatArray], period: float) -> tuple[dict[str, str], str]:
    """Return the units of the channels, and the sentence that says what they rest on: the file tells only kinds of units.

    Places and speeds tell by each other: a place in deg changes 6 times a second by a speed in rpm, one in mm 1/60 times by one in mm/min.
    """
    kinds = {key: channel.get("unitsType", "") for key, channel in trace.channels.items()}
    places = sorted(
        (columns[key] for key, kind in kinds.items() if kind == "posn"), key=lambda values: -np.ptp(values[np.isfinite(values)])
    )
    place, speed, why = "mm", "mm/min", "the file tells kinds of units only; mm and mm/min are assumed"
    for values in places[:1]:
        for other in (columns[key] for key, kind in kinds.items() if kind == "velo"):
            change, fast = np.abs(np.diff(values)) / period, np.abs(other[1:])
            moving = np.isfinite(change) & (fast > 0.5 * np.nanmax(fast, initial=0.0))
            ratio = float(np.median(change[moving] / fast[moving])) if moving.any() else 0.0
            for (a, b), expected in _SPEEDS.items():
                if ratio > 0.0 and abs(math.log(ratio / expected)) < _NEAR:
                    place, speed, why = a, b, f"the file tells kinds of units only; its places change as its speeds say in {a} and {b}"
    units = {"posn": place, "velo": speed, "accel": f"{place}/s^2", "current": "A"}
    return {key: units.get(kind, "") for key, kind in kinds.items()}, why


_LETTERS = b"0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ!#$`()*+-/:;=?@[]^_{|}~"
"""The digits of base 85 of the SAT Library, which are not those of Adobe or of RFC 1924. A dot stands for a word of zeros."""
_DIGITS = np.full(256, 255, dtype=np.uint64)
_DIGITS[np.frombuffer(_LETTERS, dtype=np.uint8)] = np.arange(85)
_POWERS = np.array([len(_LETTERS) ** power for power in (4, 3, 2, 1, 0)], dtype=np.uint64)


def doubles_of_base85(text: str) -> FloatArray:
    """Return the doubles of an array, five digits for each word of 32 bits, the higher word first. Raises ValueError where it is none."""
    plain = "".join(text.split()).replace(".", "00000").encode("ascii")
    if len(plain) % 10:
        raise ValueError("the digits of an array are cut off")
    digits = _DIGITS[np.frombuffer(plain, dtype=np.uint8)].reshape(-1, 5)
    words = digits @ _POWERS
    if (digits >= len(_LETTERS)).any() or (words >> 32).any():
        raise ValueError("an array holds no numbers in base 85")
    return words.astype(">u4").view(">f8").astype(np.float64)


@dataclass
class _Response:
    """The arrays of a measured frequency response, gathered element by element."""

    path: list[tuple[str, str]] = field(default_factory=list)
    texts: dict[str, str] = field(default_factory=dict)
    """The last text of each named element."""
    arrays: dict[str, FloatArray] = field(default_factory=dict)
    nodes: Counter[str] = field(default_factory=Counter)
    """Time series of each signal so far."""
    series: list[TimedChannel] = field(default_factory=list)
    spectra: list[tuple[str, FloatArray, FloatArray]] = field(default_factory=list)
    """Name, frequencies [Hz] and real and imaginary parts one after the other."""

    def start(self, name: str, attributes: Attributes) -> None:
        """Take the beginning of an element."""
        self.path.append((name, attributes.get("name", "")))
        if name in ("TimeSeries", "CrossSpectrum"):
            self.arrays = {}

    def end(self, name: str, text: str) -> None:
        """Take an element with the text in it."""
        own = self.path.pop()[1]
        if name == "raw" and text.strip():
            values = doubles_of_base85(text)
            array = self.path[-1][1]
            pair = 2 if array == "m_ValueVector" and any(kind == "CrossSpectrum" for kind, _ in self.path) else 1
            if len(values) != pair * float(self.texts["m_length"]):
                raise ValueError("an array has another length than it says")
            self.arrays[array] = values
        elif name == "TimeSeries":
            first, last, count = (float(self.texts[f"m_TimeVector.{item}"]) for item in ("start", "end", "length"))
            values = self.arrays["m_ValueVector"]
            if count != len(values):
                raise ValueError("a series has another length than its times")
            node = self.texts["m_uNodeId"]
            self.nodes[node] += 1
            label = f"node_{node}_{self.nodes[node]}"
            self.series.append(TimedChannel(label, "", np.linspace(first, last, len(values)), values))
        elif name == "CrossSpectrum" and len(self.arrays) == 2:
            label = "spectrum_{m_uSignodeId}_{m_uSecondId}".format(**self.texts)
            self.spectra.append((label, self.arrays["m_FrequencyVector"], self.arrays["m_ValueVector"]))
        else:
            self.texts[own] = text.strip()


def read_response(path: Path) -> RawTable:
    """Read a frequency response that SINUMERIK measured: the time series of each signal, and the spectra over their ``frequency``."""
    found = _Response()
    try:
        _parse(path, found.start, found.end)
    except KeyError as error:
        raise RecordingError(f"the measurement is damaged: it has no {error}.", place=str(path), remedy="Save it again.") from None
    table = timed_table(path, found.series, ("the file names its signals by numbers, and tells no units",))
    columns, units = dict(table.columns), dict(table.units)
    for label, frequencies, values in found.spectra:
        if len(values) != 2 * len(frequencies):
            raise RecordingError("a spectrum has another length than its frequencies.", place=str(path), remedy="Save it again.")
        at = "frequency" if "frequency" not in columns or np.array_equal(columns["frequency"], frequencies) else f"frequency of {label}"
        columns |= {at: frequencies, f"{label} real": values[::2], f"{label} imaginary": values[1::2]}
        units[at] = "Hz"
    return as_table(path, columns, units, table.notes, {})


_LARGEST_TEXT = 2 * MOST_VALUES
"""Bytes of JSON that are read: with all its numbers as objects it takes ten times as much memory."""
_LINEAR, _TURNING = "XYZUVW", "ABCS"
"""First letters of axes that move and that turn, as DIN 66217 names them; SP is a spindle."""
_EDGE = {"ENC_POS": "{0}", "DES_POS": "{0}", "CONT_DEV": "{0}", "VEL_FFW": "{0}/s", "CURRENT": "A", "LOAD": "%"}


def reads_edge(path: Path) -> bool:
    """Return whether a file is a JSON that begins with the header of SINUMERIK Edge."""
    with path.open("rb") as file:
        head = file.read(_HEAD)
    return re.match(rb'\s*\{\s*"Header"\s*:', head) is not None and b'"SignalListHFData"' in head


def read_edge(path: Path) -> RawTable:
    """Read the high-frequency data of SINUMERIK Edge. The time is the number of the cycle times the cycle time."""
    if path.stat().st_size > _LARGEST_TEXT:
        raise RecordingError(f"the file is larger than {_LARGEST_TEXT // 10**6} MB.", place=str(path), remedy="Record a shorter time.")
    try:
        data = parsed_json(path.read_bytes())
        signals, cycle = data["Header"]["SignalListHFData"], float(data["Header"]["CycleTimeMs"]) * 1e-3
        names = [str(signal["Name"]) for signal in signals]
        units = [_edge_unit(str(signal["Name"]), str(signal["Axis"])) for signal in signals]
        rows = [row for entry in data["Payload"] for row in entry.get("HFData", ())]
        odd = [len(row) != len(names) for row in rows]
        whole = ([np.nan] * len(names) if bad else [_cell(value) for value in row] for row, bad in zip(rows, odd, strict=True))
        values = np.array(list(whole), dtype=np.float64)
    except (ValueError, KeyError, TypeError, AttributeError, OverflowError):
        raise RecordingError("the JSON is damaged, or it is none of SINUMERIK Edge.", place=str(path), remedy="Export it again.") from None
    if 2 * sum(odd) > len(rows):
        fact = f"most rows have another number of values than the {len(names)} signals of the head."
        raise RecordingError(fact, place=str(path), remedy="Export it again.")
    if not len(rows):
        return as_table(path, {}, {}, (), {})
    notes = (f"{sum(odd)} rows are damaged and count as missing",) if any(odd) else ()
    number = values[:, names.index("CYCLE")] if "CYCLE" in names else np.arange(len(rows))
    found = unique_names(["time", *names])
    columns = dict(zip(found, [cycle * number, *values.T], strict=True))
    return as_table(path, columns, dict(zip(found, ["s", *units], strict=True)), notes, {})


def _cell(value: object) -> float:
    """Return a value of a signal; NaN for a text or none."""
    return float(value) if isinstance(value, (int, float)) else np.nan


def _edge_unit(name: str, axis: str) -> str:
    """Return the unit of a signal; lengths are mm or deg as the letter of the axis says, and unknown for another letter."""
    length = "mm" if axis[:1] in _LINEAR else "deg" if axis[:1] in _TURNING else ""
    unit = _EDGE.get(name.partition("|")[0], "")
    return unit.format(length) if length or "{" not in unit else ""


DOCUMENT_READERS = [
    Reader("SINUMERIK trace", (".xml",), "trace of SINUMERIK", _begins(b"traceSession"), read_trace),
    Reader("SINUMERIK frequency response", (".xml",), "frequency response of SINUMERIK", _begins(b"ResponseTest"), read_response),
    Reader("SINUMERIK Edge", (".json",), "recording of SINUMERIK Edge", reads_edge, read_edge),
]
