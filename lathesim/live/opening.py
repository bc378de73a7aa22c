"""Opening whatever timed samples come from, with the map of a machine whose names are known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from lathesim.lessons.simulate import Prepared
from lathesim.lessons.yaml_source import read_source
from lathesim.live.cnc_names import published_names
from lathesim.live.connections import read_address
from lathesim.live.feedback_source import FeedbackSource
from lathesim.live.file_source import FileSource
from lathesim.live.mtconnect_source import MTConnectSource, probe_items
from lathesim.live.name_map import MappedItem, map_from
from lathesim.live.opcua_source import OpcUaSource, browse
from lathesim.live.pipe_source import PipeSource, is_pipe
from lathesim.live.samples import LiveError, Signal, Source, run_until_stopped
from lathesim.plugins import Registry
from lathesim.units import si_factor


def lesson_signals(prepared: Prepared) -> tuple[Signal, ...]:
    """Return what a recording of the lesson may hold: the inputs it drives, the outputs it compares, and the channels it records."""
    recordings = prepared.case.lesson.settings.recordings
    driven = list(recordings.drive) if recordings is not None else []
    compared = list(recordings.compare) if recordings is not None else []
    names = dict.fromkeys([*driven, *compared, *prepared.plan.channels])
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
    declared = {f"{part.name}.{name}": item.unit for part in prepared.machinery.parts for name, item in part.component.declarations.items()}
    if given is None:
        raise LiveError("the lesson has no 'recordings:'.", place=str(lesson.path), remedy="Say there what is driven and compared.")
    feeding = {wire.target: wire.source for wire in prepared.machinery.wires if wire.source}
    drive: dict[str, dict[str, str]] = {}
    for target in given.drive:
        column = target if target in recorded else feeding.get(target, "")
        if column not in recorded:
            raise LiveError(f"the recording has no '{target}', which drives the lesson.", remedy="Add it to the map.")
        drive[target] = {"column": column, "unit": declared[target]}
    compare = {}
    for target, entry in given.compare.items():
        if target in recorded:
            compare[target] = {"column": target, "unit": declared[target]}
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
