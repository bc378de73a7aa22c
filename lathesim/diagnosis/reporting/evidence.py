"""What shows the mismatch before and after: residuals in the lesson's own simulation, and the missing force."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import fields, replace
from typing import Any, TypeVar

import numpy as np

from lathesim.diagnosis.location import Compared, largest_windows, missing_signals, places
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.records.diagnosis import ChannelTrace, Evidence, Location, MissingSignal
from lathesim.diagnosis.records.found import Found, Tried
from lathesim.diagnosis.records.shown import Shown
from lathesim.diagnosis.reporting.explanations import best_of_each, gains
from lathesim.engine.assembly import Place
from lathesim.identification.replay.experiment import Experiment
from lathesim.identification.replay.measured_motion import measured_output
from lathesim.identification.signal import LARGER_PART, SETTLING

Lines = TypeVar("Lines", ChannelTrace, MissingSignal)


def gather(validation: Experiment, found: Found, own: Compared) -> Evidence:
    """Return what the report draws, on the validation recording."""
    wires = [wire for wire in validation.machine.assembly.wires if wire.source]
    return Evidence(
        missing=tuple(_parted(one, validation.seams) for one in missing_signals(validation, found.baseline, found.model)),
        traces=tuple(_traces(validation, own, found.model.validation_fit.by_name)),
        wires=tuple(dict.fromkeys((Place.of(wire.source).part, Place.of(wire.target).part) for wire in wires)),
        tried=tuple((one.name, one.fitted.nats, one.predicted.nats) for one in best_of_each(found)),
        runners_up=tuple(runners_up(found)),
    )


def runners_up(found: Found) -> Iterator[tuple[str, str, float]]:
    """Return for each effect the next best of what was tried in its place, beside the same other effects: gains of other rounds, with
    more or less of the error found already, are none to hold it against."""
    kept = {f"{candidate.name} at {candidate.place}" for candidate in found.model.candidates}
    for own in found.worth.values():
        rivals = [one for one in found.tried if _beside(one) == _beside(own) and one.name not in kept]
        best = max((one for one in rivals if np.isfinite(one.predicted.nats)), key=gains, default=None)
        if best is not None:
            yield own.name, best.name, own.predicted.nats - best.predicted.nats


def _beside(trial: Tried) -> set[str]:
    return {candidate.part for candidate in trial.model.candidates if candidate.part != trial.candidate.part}


def _traces(validation: Experiment, own: Compared, begun: Mapping[str, float]) -> list[ChannelTrace]:
    off = {name: item.after for name, item in own.fit.items() if np.isfinite(item.after) and item.after > item.floor}
    # a closed loop brings back what dry friction does not hold
    free = set() if validation.feeds_back else unheld(validation, begun, off)
    time, recorded = validation.record.time, validation.own.recorded
    traces = [
        ChannelTrace(name, own.fit[name].unit, time, recorded[row], own.before[row], own.after[row], name not in free)
        for row, name in enumerate(validation.machine.compare)
    ]
    return [_parted(trace, validation.seams) for trace in traces]


def _parted(lines: Lines, seams: Sequence[int]) -> Lines:
    """Return lines over time with a gap where a second recording begins: a line over the seam would be a jump of the machine."""
    values = ((field.name, getattr(lines, field.name)) for field in fields(lines))
    drawn = {name: item for name, item in values if isinstance(item, np.ndarray) and item is not lines.time}
    long: dict[str, Any] = {name: np.array(item) for name, item in drawn.items() if len(item) == len(lines.time)}
    for item in long.values():
        item[list(seams)] = np.nan
    return replace(lines, **long)


def unheld(validation: Experiment, values: Mapping[str, float], shifts: Mapping[str, float]) -> set[str]:
    """Return the channels of places that keep a shift of the start (channel -> size [SI]) to the end of the lesson's own simulation with
    ``values``, of a machine of which nothing is fed back."""
    validation, values = validation.last_with(values)
    own, channels, assembly = validation.own, validation.machine.compare, validation.machine.assembly
    shown = {name: Place.of(measured_output(assembly, name)) for name in shifts}
    places = {name for name, place in shown.items() if place.port == assembly.ports(place.part).get("displacement")}
    rows = {name: row for row, name in enumerate(channels) if name in places}
    starts = own.settable(item.name for item in validation.start_states(own.plan))
    pairs = [(name, start) for name, row in rows.items() for start in starts if own.plan.unit(start) == own.plan.unit(own.channels[row])]
    names = own.settable([*values, *starts])
    given = {name: values[name] if name in values else own.given(name) for name in names}
    shifted = [{**given, start: given[start] + shifts[name]} for name, start in pairs]
    base, *moved = own.outputs(names, np.array([[run[name] for name in names] for run in (given, *shifted)]))
    ends = max(1, int(SETTLING * own.samples))
    found = set()
    for (name, _), run in zip(pairs, moved, strict=True):
        apart = np.abs(run[rows[name]] - base[rows[name]])
        first, last = (float(np.median(part)) for part in (apart[:ends], apart[-ends:]))
        if first > 0.0 and last > LARGER_PART * first:
            found.add(name)
    return found


def located(
    validation: Experiment, found: Found, evidence: Evidence, variables: Iterable[str], *, named: bool, method: Method = STANDARD
) -> Location:
    """Return where the mismatch sits, the hosts of what is named or else the parts in which the replay finds it; and on what it depends."""
    worst = places(validation, found.baseline.validation_fit)
    hosts = [Place.of(candidate.at).part for candidate in found.model.candidates] if named else []
    channels = [place.channel for place in worst if place.over_floor > 1.0]
    suspects = hosts or suspected(validation, evidence, channels, method=method)
    missing = evidence.missing[validation.machine.compare.index(worst[0].channel)].before if worst else np.zeros(1)
    windows = largest_windows(np.nan_to_num(missing), validation.machine.assembly.sample_period)
    return Location(tuple(dict.fromkeys(suspects)), tuple(channels), windows, tuple(dict.fromkeys(variables))[: Shown.most_variables])


def suspected(validation: Experiment, evidence: Evidence, off: Collection[str], method: Method = STANDARD) -> list[str]:
    """Return the parts in which much is missing, the largest share of what acts there first; ``off`` are the channels over their floor.

    A part that misses little beside the largest share is none of them. Where a sensor's reading is off, so may be what it reads, and
    rather that where several of its readings are.
    """
    compare = zip(validation.machine.compare, evidence.missing, strict=True)
    shares = [(item.share_before, item.at) for name, item in compare if name in off and np.isfinite(item.share_before)]
    most = max((share for share, _ in shares), default=0.0)
    shares = sorted((pair for pair in shares if pair[0] >= method.little * most), key=lambda pair: -pair[0])
    assembly = validation.machine.assembly
    found = []
    for part in [Place.of(at).part for _, at in shares]:
        reads: list[str] = []
        if {"measured", "reading"} <= set(assembly.ports(part)):
            reads = [Place.of(wire.source).part for wire in assembly.wires if wire.source and Place.of(wire.target).part == part]
        several = sum(at != part and Place.of(at).part == part for _, at in shares) > 1
        found += [*reads, part] if several else [part, *reads]
    return found
