"""Opening whatever timed samples come from: recordings, pipes, and servers with the map of a machine whose names are known."""

from __future__ import annotations

import asyncio
import os
import stat
import sys
from collections.abc import AsyncIterator, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.lessons.recording_mapping import mapping_of
from lathesim.lessons.simulate import Prepared
from lathesim.lessons.yaml_source import read_source
from lathesim.live.channel_names import MappedItem, map_from, published_names
from lathesim.live.connections import read_address
from lathesim.live.feedback_source import FeedbackSource
from lathesim.live.mtconnect_source import MTConnectSource, probe_items
from lathesim.live.opcua_source import OpcUaSource, browse
from lathesim.live.recording_run import BLOCK, RecordBlocks
from lathesim.live.samples import LiveError, SampleBlock, Signal, Source, run_until_stopped
from lathesim.plugins import Registry
from lathesim.record import FloatArray, is_record
from lathesim.recordings.mapping import SignalMapping
from lathesim.units import si_factor

LARGEST_LINE = 4096
"""Bytes of a line at most; a longer one is left out and told."""
_CHUNK = 1 << 16
_EVERY = 0.01
"""Seconds between two looks at a pipe that is empty."""
_NOT_KNOWN = -1
_MOST_NOTES = 20
"""Sentences about a pipe that are said; what more is odd about it is counted only."""


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
            self._note(f"a line has {len(values)} numbers, and {count} are expected")
            return None
        return values

    def _number(self, number: int) -> None:
        """Take the number of a sample: where some are missing the time goes on with it."""
        if self._offset == _NOT_KNOWN:
            self._offset = number - self._next
        self._next = number - self._offset

    def _note(self, sentence: str) -> None:
        if sentence not in self._told and len(self._told) < _MOST_NOTES:
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


class FileSource:
    """Samples of recordings, in the order of the files; each begins at its own time, moved behind the end of the one before.

    ``starts`` holds the time [s] at which each file begins. A record of this program is read in blocks, whatever its length, in the units
    that stand in it.
    """

    def __init__(self, files: Sequence[Path], prepared: Prepared, registry: Registry) -> None:
        mapping = mapping_of(prepared.case.lesson, prepared.machinery)
        self._files, self._registry = list(files), registry
        self._mapping = mapping
        self.mapped = mapping.signals
        self.starts: dict[str, float] = {}
        self._end = -np.inf

    @property
    def name(self) -> str:
        """Return the names of the files."""
        return ", ".join(str(file) for file in self._files[:3])

    @property
    def signals(self) -> tuple[Signal, ...]:
        """Return the driven inputs and compared outputs of the lesson."""
        return tuple(Signal(item.target, item.si_unit) for item in self.mapped)

    def where(self, time: float) -> str:
        """Return in which of several files a time [s] of the stream lies, as `` (april.h5, 15.0 s after it begins)``."""
        begun = [(start, name) for name, start in self.starts.items() if start <= time]
        if len(self._files) < 2 or not begun:
            return ""
        start, name = max(begun)
        return f" ({name}, {time - start:.1f} s after it begins)"

    async def blocks(self) -> AsyncIterator[SampleBlock]:
        """Return the samples of all files."""
        for file in self._files:
            for block in self._file(file):
                yield block

    def _file(self, file: Path) -> Iterator[SampleBlock]:
        offset: float | None = None
        for time, columns in self._raw(file):
            fresh = offset is None
            if offset is None:
                offset = 0.0 if not np.isfinite(self._end) else self._end + 1.0 - float(time[0])
                self.starts[file.name] = float(time[0]) + offset
            values = np.array([column * item.scale * si_factor(unit)[0] + item.offset for column, item, unit in columns])
            self._end = float(time[-1]) + offset
            yield SampleBlock(time + offset, values, (f"{file.name} begins",) if fresh and len(self._files) > 1 else (), fresh)

    def _raw(self, file: Path) -> Iterator[tuple[FloatArray, list[tuple[FloatArray, SignalMapping, str]]]]:
        if is_record(file):
            source = RecordBlocks(file)
            try:
                units = {signal.name: signal.unit for signal in source.signals}
                names = [_column(item, set(units), file) for item in self.mapped]
                for block in source.blocks(names):
                    yield block.time, [*zip(block.values, self.mapped, [units[name] for name in names], strict=True)]
            finally:
                source.close()
            return
        from lathesim.recordings.raw_table import read_recording

        table = read_recording(file, self._registry.readers)
        columns = [table.column(_column(item, set(table.columns), file)) for item in self.mapped]
        if self._mapping.time_column is not None:
            time = table.column(self._mapping.time_column) * si_factor(self._mapping.time_unit)[0]
        else:
            assert self._mapping.rate is not None
            time = np.arange(len(columns[0])) / self._mapping.rate
        for begin in range(0, len(time), BLOCK):
            part = slice(begin, begin + BLOCK)
            yield time[part], [(column[part], item, item.unit) for column, item in zip(columns, self.mapped, strict=True)]


def _column(item: SignalMapping, known: set[str], file: Path) -> str:
    for name in (item.column, item.target, *item.also):
        if name in known:
            return name
    plain = {name.partition("[")[0].strip(): name for name in known}
    if item.column in plain:
        return plain[item.column]
    raise LiveError(f"the file has no column '{item.column}'.", place=str(file), remedy=f"It has {', '.join(sorted(known)[:8])}.")


def lesson_signals(prepared: Prepared) -> tuple[Signal, ...]:
    """Return what a recording of the lesson may hold: the inputs it drives, the outputs it compares, and the channels it records."""
    recordings = prepared.case.lesson.settings.recordings
    driven = list(recordings.drive) if recordings is not None else []
    names = dict.fromkeys([*driven, *(list(recordings.compare) if recordings is not None else []), *prepared.plan.channels])
    declared = {f"{part.name}.{name}": item for part in prepared.machinery.parts for name, item in part.component.declarations.items()}
    return tuple(Signal(name, declared[name].unit) for name in names if name in declared)


def map_for(prepared: Prepared, offered: Mapping[str, str], way: str) -> list[MappedItem]:
    """Return the map of what a server offers (place -> unit) for a lesson: by the standard names, or by the names of the channels.

    Raises :class:`LiveError` where nothing of the lesson is offered.
    """
    signals = lesson_signals(prepared)
    places = {entry.channel: "/".join(entry.path) for entry in published_names(prepared.machinery, signals)}
    channels: dict[str, dict[str, str]] = {}
    for signal in signals:
        for place in (f"Signals/{signal.name}", signal.name, places[signal.name]):
            if place in offered:
                channels[signal.name] = {way: place, "unit": offered[place], "si": signal.unit}
                break
    if not channels:
        some = ", ".join(list(offered)[:6])
        raise LiveError(f"nothing of {prepared.name} is offered there.", remedy=f"Give a --map; offered are {some or 'no numbers'}.")
    return map_from({"channels": channels}, "the lesson's map")


def recordings_for(prepared: Prepared, recorded: Sequence[str]) -> dict[str, Any]:
    """Return the ``recordings:`` of a lesson for a record with the channels ``recorded``, named as the machine names them.

    A driven input may have been recorded as itself or as the output that feeds it. Raises :class:`LiveError` where one is missing.
    """
    lesson = prepared.case.lesson
    given = lesson.settings.recordings
    if given is None:
        raise LiveError("the lesson has no 'recordings:'.", place=str(lesson.path), remedy="Say there what is driven and compared.")
    drive: dict[str, dict[str, str]] = {}
    for target in given.drive:
        column = target if target in recorded else prepared.machinery.sources.get(target, "")
        if column not in recorded:
            raise LiveError(f"the recording has no '{target}', which drives the lesson.", remedy="Add it to the map.")
        drive[target] = {"column": column, "unit": prepared.machinery.declared(target).unit}
    compare = {}
    for target, entry in given.compare.items():
        if target in recorded:
            compare[target] = {"column": target, "unit": prepared.machinery.declared(target).unit}
            if entry.resolution is not None:
                compare[target]["resolution"] = entry.resolution
    if not compare:
        raise LiveError(
            "the recording has no channel that the lesson compares.", remedy=f"Add one of {', '.join(given.compare)} to the map."
        )
    return {"time": {"column": "time", "unit": "s"}, **({"drive": drive} if drive else {}), "compare": compare}


_AGENT_PORT, _SERVO_PORT = 5000, 5600


def open_source(places: Sequence[str], map_file: Path | None, prepared: Prepared, registry: Registry) -> Source:
    """Return the source of a lesson: a machine's address, ``-`` or a named pipe, or recordings that follow one another.

    Raises :class:`LiveError` where they are of different kinds, or cannot be opened.
    """
    alone = len(places) == 1
    if alone and is_pipe(places[0]):
        return _pipe(places[0], prepared)
    if alone and "://" in places[0]:
        return open_machine(places[0], map_file, prepared)
    if any("://" in place or is_pipe(place) for place in places):
        raise LiveError("one machine is watched at a time.", remedy="Several recordings may follow one another.")
    return FileSource([Path(place) for place in places], prepared, registry)


def live(places: Sequence[str]) -> bool:
    """Return whether samples come at their own times: from a machine or a pipe, and not from recordings."""
    return any("://" in place or is_pipe(place) for place in places)


def _pipe(place: str, prepared: Prepared) -> PipeSource:
    """Return a pipe whose columns are the driven inputs and the compared outputs of the lesson, in the units of its ``recordings:``."""
    recordings = prepared.case.lesson.settings.recordings
    mapped = {**recordings.drive, **recordings.compare} if recordings is not None else {}
    if not mapped:
        raise LiveError("the lesson does not say what is recorded.", place=str(prepared.case.lesson.path), remedy="Add 'recordings:'.")
    units = {signal.name: signal for signal in lesson_signals(prepared)}
    columns = [(units[name], si_factor(entry.unit)[0] if entry.unit else 1.0) for name, entry in mapped.items()]
    return PipeSource(place, columns, prepared.plan.assembly.sample_period)


def open_machine(
    url: str, map_file: Path | None, prepared: Prepared | None, every: float = 0.0, queue: int = 5000
) -> OpcUaSource | MTConnectSource | FeedbackSource:
    """Return the source at ``opc.tcp://host:port``, ``http://host:port`` or ``tcp://host:port``: what a map names, a lesson knows, or is
    offered.

    ``every`` [s] is the sampling that is asked for, ``queue`` the values the server keeps. Raises :class:`LiveError` where nothing answers.
    """
    if url.startswith("tcp:"):
        return FeedbackSource(read_address(url, "tcp", _SERVO_PORT))
    if not url.startswith(("opc.tcp:", "http:")):
        remedy = "Write opc.tcp://127.0.0.1:4840, http://127.0.0.1:5000 or tcp://127.0.0.1:5600."
        raise LiveError(f"'{url}' is no address of a machine.", remedy=remedy)
    opcua = url.startswith("opc.tcp:")
    items = _items(url, map_file, prepared, opcua)
    if opcua:
        return OpcUaSource(url, items, interval=every, queue=queue)
    return MTConnectSource(read_address(url, "http", _AGENT_PORT), items, every or 0.1)


def _items(url: str, map_file: Path | None, prepared: Prepared | None, opcua: bool) -> list[MappedItem]:
    if map_file is not None:
        return map_from(read_source(map_file, what="map").data, str(map_file))
    way = "path" if opcua else "item"
    if opcua:
        offered = dict(run_until_stopped(lambda stop: browse(url))[0])
    else:
        address = read_address(url, "http", _AGENT_PORT)
        offered = dict(run_until_stopped(lambda stop: probe_items(address))[0])
    if prepared is not None:
        return map_for(prepared, offered, way)
    channels = {name.removeprefix("Signals/").replace("/", "."): {way: name, "unit": unit} for name, unit in offered.items()}
    return map_from({"channels": channels}, "what is offered")
