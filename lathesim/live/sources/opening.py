"""Opening whatever timed samples come from: a machine on the network by its address, a pipe, or recordings."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from lathesim.lessons.simulate import Prepared
from lathesim.lessons.yaml_source import read_source
from lathesim.live.mtconnect.mtconnect_source import MTConnectSource, probe_items
from lathesim.live.opcua.opcua_source import OpcUaSource, browse
from lathesim.live.recording.name_map import MappedItem, map_from
from lathesim.live.recording.record_mapping import lesson_signals, map_for
from lathesim.live.servo.feedback_source import FeedbackSource
from lathesim.live.sources.addresses import read_address
from lathesim.live.sources.file_source import FileSource
from lathesim.live.sources.pipe_source import PipeSource, is_pipe
from lathesim.live.sources.samples import LiveError, Source
from lathesim.live.sources.until_stopped import run_until_stopped
from lathesim.plugins import Registry
from lathesim.units import si_factor

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
