"""The map of a machine whose names are known, and the lesson that says what a recording's channels mean."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from lathesim.lessons.simulate import Prepared
from lathesim.live.opcua.cnc_names import published_names
from lathesim.live.recording.name_map import MappedItem, map_from
from lathesim.live.sources.samples import LiveError, Signal


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
