"""From the columns of a file to a :class:`Record` whose channels are called as the machine's inputs and outputs, in SI, on an even clock.

Nothing is mended in silence: each thing found and what was done about it is a :class:`Finding`.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import numpy.typing as npt

from lathesim.errors import RecordingError
from lathesim.record import Channel, FloatArray, Meta, Record, stretches
from lathesim.recordings.raw_table import Finding, RawTable, counted, is_unit, too_short
from lathesim.recordings.recording_thresholds import EQUAL, SPIKES
from lathesim.recordings.sample_grid import (
    SHORT_GAP,
    SampleGrid,
    Threshold,
    bridge_short_runs,
    even_grid,
    regular_grid,
    switched,
    with_gaps_bridged,
)
from lathesim.units import conversion, convertible, same_dimension, si_factor

__all__ = ["BetweenRows", "Finding", "MappedRecording", "RecordingMapping", "SignalMapping", "map_recording"]

Samples = npt.NDArray[np.int64]

LEAST_SAMPLES = 20
_TOLD = 3
_LARGEST = 1e30
"""Values [SI] from here on count as missing, like NaN: sums and products of their squares would overflow. Values below the inverse count
as zero."""
_SHORTEST_PERIOD, _LONGEST_PERIOD = 1e-8, 1e6
"""Accepted times between two rows [s], from 10 ns to ten days (assumed)."""
_FAR = 30.0
"""A spike stands this many times farther out than what one sample in a hundred does ..."""
_STEEPER = 3.0
"""... and than the steps before and after its neighbours."""
_ANSWERS = 3
"""Samples within which a measurement may answer to a kick of a command."""


@dataclass(frozen=True)
class BetweenRows:
    """What a channel does between two rows.

    A driven input ``moves`` where it is interpolated, as a measured one; otherwise it is held, as a commanded one. With ``held`` a sample
    without a row repeats the one before; a place that was asked for is interpolated, unless the lesson says so. It may be ``assumed``.
    """

    moves: bool = False
    held: bool = False
    assumed: bool = False


@dataclass(frozen=True)
class SignalMapping:
    """A column and what it means: channel [``si_unit``] = column * scale, read in ``unit``, plus ``offset`` [SI].

    ``target`` is the input it drives or the output it is compared with, ``resolution`` [SI] its smallest step where it is known.
    ``also`` are columns that mean the same where the file has no ``column``; ``place`` is where the lesson says all this. With a
    ``threshold`` the column tells only when the channel is on, and has a unit of its own.
    """

    target: str
    column: str
    unit: str
    scale: float
    resolution: float | None
    role: Literal["drive", "compare"]
    si_unit: str
    offset: float = 0.0
    also: tuple[str, ...] = ()
    place: str = ""
    threshold: Threshold | None = None
    between: BetweenRows = BetweenRows()

    @property
    def kind(self) -> str:
        """The unit that says what kind of thing the column holds; one that switches an input has a unit of its own."""
        return self.si_unit if self.threshold is None else self.unit


@dataclass(frozen=True)
class RecordingMapping:
    """When the rows were taken (a column in ``time_unit``, or ``rate`` [Hz]), how many make a sample, and what the columns mean."""

    time_column: str | None
    time_unit: str
    rate: float | None
    signals: tuple[SignalMapping, ...]
    time_place: str = ""
    mean_of: int = 1
    period: float = 0.0
    """The lesson's sample period [s]; 0 where it has none."""

    def targets(self, role: Literal["drive", "compare"]) -> tuple[str, ...]:
        """Return the names of the channels of one role."""
        return tuple(signal.target for signal in self.signals if signal.role == role)


@dataclass(frozen=True, eq=False)
class MappedRecording:
    """The recording as a record, what was found on the way, and the resolution [SI] of the channels whose lesson tells it.

    Where samples lie between rows, ``taken`` are the compared channels as their rows have them [SI], and ``marks`` where these lie
    [periods]: what is interpolated has less noise than what was read.
    """

    record: Record
    findings: tuple[Finding, ...]
    resolution: dict[str, float]
    taken: Mapping[str, FloatArray] = field(default_factory=dict)
    marks: FloatArray | None = None


def map_recording(table: RawTable, mapping: RecordingMapping) -> MappedRecording:
    """Return the recording in SI on an even clock that begins at 0; ``meta`` keeps the start and the period.

    Short gaps, short runs without a number, and long gaps in which no motion turns are interpolated linearly; of a recording with other
    gaps the longest whole stretch is kept. Raises :class:`RecordingError` where a column is missing or what is left has fewer than 20
    samples.
    """
    findings = [Finding("reading", "", note, "") for note in table.notes if not note.startswith("left out")]
    columns = {signal.target: _column(table, signal, findings) for signal in mapping.signals}
    findings += [_as_assumed(signal) for signal in mapping.signals if signal.between.assumed]
    time, began = _time(table, mapping, findings)
    _same_length(table, mapping, columns, time)
    count = len(next(iter(columns.values())))
    _enough(table, count)
    grid = regular_grid(count, 1.0 / mapping.rate) if mapping.rate is not None else even_grid(time, findings, mapping.period)
    if grid.length >= LEAST_SAMPLES and not _SHORTEST_PERIOD <= grid.period <= _LONGEST_PERIOD:
        fact = f"the rows are {grid.period:.3g} s apart, outside 10 ns to 1e6 s."
        raise RecordingError(fact, place=mapping.time_place or str(table.source), remedy="Check the column and the unit of the time.")
    channels = {signal.target: _in_si(columns[signal.target], signal) for signal in mapping.signals}
    empty = [name for name, values in channels.items() if _mostly_missing(name, values, findings)]
    present = {name: values for name, values in channels.items() if name not in empty}
    held = {signal.target for signal in mapping.signals if signal.between.held}
    grid = with_gaps_bridged(grid, [values for name, values in present.items() if name not in held], findings)
    # a column that switches an input is what a sensor shows, and no command
    commanded = [signal.target for signal in mapping.signals if signal.role == "drive" and signal.threshold is None]
    values = _bridged(grid, present, commanded, held, findings)
    _enough(table, grid.length)
    length, period = grid.length // mapping.mean_of, grid.period * mapping.mean_of
    if length < LEAST_SAMPLES:
        fact = f"{mapping.mean_of} rows make a sample, and {grid.length} rows make {length} of them; at least {LEAST_SAMPLES} are needed."
        raise RecordingError(fact, place=mapping.time_place or str(table.source), remedy="Write a smaller 'mean_of', or record longer.")
    if mapping.mean_of > 1:
        values = {name: column[: length * mapping.mean_of].reshape(length, -1).mean(axis=1) for name, column in values.items()}
    begin, end = _whole_stretch(values, length, period, findings)
    _enough(table, end - begin, findings)
    for signal in mapping.signals:
        if signal.threshold is not None and signal.target in values:
            values[signal.target] = _switch(values[signal.target], signal, signal.threshold, period, begin, findings)
    units = {signal.target: signal.si_unit for signal in mapping.signals}
    resolution = {signal.target: signal.resolution for signal in mapping.signals if signal.resolution}
    kept = {
        name: Channel(name, units[name], values[name][begin:end] if name in values else np.full(end - begin, np.nan)) for name in channels
    }
    meta: Meta = {
        "sample_period": period,
        "original_start": began + grid.start + begin * period,
        "source": str(table.source),
        "status": "complete",
    }
    record = Record(np.arange(end - begin, dtype=np.float64) * np.float64(period), kept, meta)
    if grid.marks is None or mapping.mean_of > 1:
        return MappedRecording(record, tuple(findings), resolution)
    taken = {name: present[name][grid.rows] for name in mapping.targets("compare") if name in present}
    return MappedRecording(record, tuple(findings), resolution, taken, grid.marks)


def _as_assumed(signal: SignalMapping) -> Finding:
    """Return a sentence on the assumed course of a driven input between two rows."""
    assumed, held = ("force or torque is assumed to be measured, and interpolated linearly between rows", "true' if it was commanded")
    if not signal.between.moves:
        assumed, held = ("voltage is assumed to be commanded, and held until the next row", "false' if it was measured")
    return Finding("driven", signal.target, f"the {assumed}", f"write 'held: {held}")


def rows_as_taken(table: RawTable, mapping: RecordingMapping, findings: list[Finding]) -> tuple[FloatArray, dict[str, FloatArray]]:
    """Return the times [s] of the rows, as the file tells them, and the values [SI] of each compared channel; NaN where none was written.

    Nothing is put on an even grid: way-points come when they come. Raises :class:`RecordingError` where a column is missing.
    """
    wanted = [signal for signal in mapping.signals if signal.role == "compare"]
    columns = {signal.target: _in_si(_column(table, signal, findings), signal) for signal in wanted}
    rows = len(next(iter(columns.values())))
    if mapping.rate is not None:
        return np.arange(rows) / mapping.rate, columns
    time, began = _time(table, mapping, findings)
    _same_length(table, mapping, columns, time)
    return time + began, columns


def _column(table: RawTable, signal: SignalMapping, findings: list[Finding]) -> FloatArray:
    """Return the column of a signal in ``signal.unit`` and before its scale."""
    found = table.column_name(signal.column)
    if found is not None:
        _note_other_name(table, signal.target, signal.column, found, findings)
        _check_header_unit(table.units[found], signal, findings)
        return table.columns[found]
    for name in (signal.target, *signal.also) if signal.threshold is None else ():
        unit = table.units.get(name, "")
        if name in table.columns and (unit == signal.si_unit or (is_unit(unit) and convertible(unit, signal.si_unit))):
            fact = f"the file has no column '{signal.column}', but one called '{name}' in {unit}"
            findings.append(Finding("mapping", signal.target, fact, "it is used"))
            return table.columns[name] * (conversion(unit, signal.si_unit) / conversion(signal.unit, signal.kind) / signal.scale)
    raise RecordingError(f"{table.source.name} has no column '{signal.column}'.", place=signal.place, remedy=table.near(signal.column))


def _note_other_name(table: RawTable, channel: str, asked: str, found: str, findings: list[Finding]) -> None:
    """Note a column that is mapped by another header line, or by its position."""
    if table.other_names.get(asked) == found != asked:
        findings.append(Finding("mapping", channel, f"'{asked}' is the column that the file calls '{found}'", ""))


def _check_header_unit(header: str, signal: SignalMapping, findings: list[Finding]) -> None:
    """Note where the file names another unit than the lesson; with a scale in the lesson that is meant."""
    if not header or header == signal.unit or signal.scale != 1.0 or not is_unit(header):
        return
    if not convertible(header, signal.kind):
        fact = f"the file calls '{signal.column}' {header} and the lesson reads it as {signal.unit}"
        findings.append(Finding("unit", signal.target, fact, "the lesson's unit is used"))
        return
    ratio = conversion(header, signal.kind) / conversion(signal.unit, signal.kind)
    if abs(ratio - 1.0) > EQUAL:
        fact = f"the unit of '{signal.column}' is {header} in the file and {signal.unit} in the lesson, a factor of {ratio:.6g}"
        findings.append(
            Finding("unit", signal.target, fact, f"the lesson's unit is used; write unit: {header} there if the file is right", True)
        )


def _in_si(column: FloatArray, signal: SignalMapping) -> FloatArray:
    with np.errstate(over="ignore", invalid="ignore"):
        values = column * (signal.scale * conversion(signal.unit, signal.kind)) + signal.offset
    values[~(np.abs(values) < _LARGEST)] = np.nan
    values[np.abs(values) < 1.0 / _LARGEST] = 0.0
    return values


def _time(table: RawTable, mapping: RecordingMapping, findings: list[Finding]) -> tuple[FloatArray, float]:
    """Return the times of the rows since the first of them [s], and that one; empty where a rate tells them.

    The first is taken away in the file's own unit: in seconds since 1970 milliseconds are no whole numbers any more.
    """
    if mapping.time_column is None:
        return np.zeros(0), 0.0
    name = table.column_name(mapping.time_column)
    unit = mapping.time_unit
    if name is None and table.units.get("time") == "s":
        findings.append(
            Finding("mapping", "time", f"the file has no column '{mapping.time_column}', but one called 'time' in s", "it is used")
        )
        name, unit = "time", "s"
    if name is None:
        raise RecordingError(
            f"{table.source.name} has no column '{mapping.time_column}' for the time.",
            place=mapping.time_place,
            remedy=table.near(mapping.time_column),
        )
    if name != "time":
        _note_other_name(table, "time", mapping.time_column, name, findings)
    header = table.units[name]
    if is_unit(header) and same_dimension(header, "s") and abs(si_factor(header)[0] / si_factor(unit)[0] - 1.0) > EQUAL:
        fact = f"the time is in {header} in the file and in {unit} in the lesson"
        findings.append(Finding("unit", "time", fact, f"the lesson's unit is used; write unit: {header} there if the file is right", True))
    times, factor = table.columns[name], si_factor(unit)[0]
    known = times[np.isfinite(times)]
    first = float(known[0]) if len(known) else 0.0
    with np.errstate(over="ignore", invalid="ignore"):
        return (times - first) * factor, first * factor


def _same_length(table: RawTable, mapping: RecordingMapping, columns: dict[str, FloatArray], time: FloatArray) -> None:
    lengths = {signal.column: len(columns[signal.target]) for signal in mapping.signals if signal.target in columns}
    if mapping.time_column is not None:
        lengths[mapping.time_column] = len(time)
    if len(set(lengths.values())) > 1:
        told = ", ".join(f"{name} {length}" for name, length in lengths.items())
        raise RecordingError(f"the columns differ in length: {told}.", place=str(table.source), remedy="Map columns of one measurement.")


def _enough(table: RawTable, count: int, findings: Sequence[Finding] = ()) -> None:
    if count < LEAST_SAMPLES:
        raise too_short(
            str(table.source), count, f"; at least {LEAST_SAMPLES} are needed", findings, "Record longer, or map other columns."
        )


def _switch(
    column: FloatArray, signal: SignalMapping, threshold: Threshold, period: float, begin: int, findings: list[Finding]
) -> FloatArray:
    """Return the channel that a column switches, and say when it is on (times from sample ``begin`` on)."""
    on = switched(column, threshold, period)
    begins, ends = stretches(on)
    level = f"{threshold.above / si_factor(signal.unit)[0]:g} {signal.unit}"
    if not len(begins):
        largest = f"{float(np.nanmax(column)) / si_factor(signal.unit)[0]:.4g} {signal.unit}"
        fact = f"'{signal.column}' never stays above {level}; the largest value is {largest}."
        raise RecordingError(fact, place=signal.place, remedy="Write a lower threshold, or a shorter 'lasting'.")
    times = [f"{(first - begin) * period:.4g} to {(last - begin) * period:.4g} s" for first, last in zip(begins, ends, strict=True)]
    told = ", ".join(times[:_TOLD]) + (f" and {len(times) - _TOLD} times more" if len(times) > _TOLD else "")
    fact = f"'{signal.column}' is above {level} from {told}"
    findings.append(Finding("switch", signal.target, fact, "the channel is on there and 0 elsewhere"))
    return np.where(on, threshold.value, 0.0)


def _mostly_missing(name: str, values: FloatArray, findings: list[Finding]) -> bool:
    missing = int(np.count_nonzero(np.isnan(values)))
    if 2 * missing <= len(values):
        return False
    fact = f"{missing} of {len(values)} values are missing" if missing < len(values) else f"none of the {len(values)} values is a number"
    findings.append(Finding("missing", name, fact, "the channel is left empty", True))
    return True


def _bridged(
    grid: SampleGrid, channels: dict[str, FloatArray], commanded: Collection[str], held: Collection[str], findings: list[Finding]
) -> dict[str, FloatArray]:
    """Put channels on the grid; runs of up to four samples without a number are bridged, longer ones stay NaN.

    Single samples far from their neighbours are bridged too, except where a ``commanded`` input kicks: what was commanded was done, and
    what is measured beside a kick answers to it.
    """
    on_grid = {}
    placed_at = {name: grid.place(values, held=name in held) for name, values in channels.items()}
    kicks = np.concatenate([np.zeros(0, dtype=np.int64), *[_spikes(placed_at[name]) for name in placed_at if name in commanded]])
    for name, values in channels.items():
        placed = placed_at[name]
        cleaned = _without_spikes(name, placed, kicks, grid.period, findings, is_command=name in commanded)
        bridged = bridge_short_runs(cleaned, held=name in held)
        count = int(np.count_nonzero(np.isnan(placed) & ~np.isnan(bridged))) - grid.missing
        if count > 0 and np.isnan(values).any():
            fact = f"{counted(count, 'value', 'is', 'are')} missing, in runs of fewer than {SHORT_GAP}"
            findings.append(Finding("missing", name, fact, "interpolated linearly"))
        on_grid[name] = bridged
    return on_grid


def _without_spikes(
    name: str, values: FloatArray, kicks: Samples, period: float, findings: list[Finding], *, is_command: bool
) -> FloatArray:
    """Take out single samples that stand far from both neighbours, which agree, and that no kick of a command explains."""
    spikes = _spikes(values)
    if is_command and len(spikes):
        findings.append(Finding("spike", name, _far_out(spikes, period), "taken as commanded"))
    spikes = spikes[np.abs(spikes[:, None] - kicks).min(axis=1, initial=len(values)) > _ANSWERS]
    if is_command or not len(spikes):
        return values
    findings.append(Finding("spike", name, _far_out(spikes, period), "interpolated linearly"))
    mended = values.copy()
    mended[spikes] = np.nan
    return mended


def _far_out(spikes: Samples, period: float) -> str:
    count, when = len(spikes), f"{float(spikes[0]) * period:.6g} s"
    where = f"its neighbours, at {when}" if count == 1 else f"their neighbours, the first at {when}"
    return f"{counted(count, 'sample', 'stands', 'stand')} far from {where}"


def _spikes(values: FloatArray) -> Samples:
    """Return where single samples stand far from both neighbours, which agree; pulses that come regularly are signal."""
    none = np.zeros(0, dtype=np.int64)
    if len(values) < SPIKES.least:
        return none
    away = np.full(len(values), np.nan)
    away[1:-1] = np.abs(values[1:-1] - 0.5 * (values[:-2] + values[2:]))
    apart = np.full(len(values), np.nan)
    apart[1:-1] = np.abs(values[2:] - values[:-2])
    # a ramp that turns round goes on as steeply as it came
    slope = np.full(len(values), np.nan)
    slope[2:-2] = np.maximum(np.abs(values[1:-3] - values[:-4]), np.abs(values[4:] - values[3:-1]))
    usual = float(np.nanquantile(away, 0.99)) if np.isfinite(away).any() else 0.0
    alone = (apart < SPIKES.apart * away) & ~(away < _STEEPER * slope)
    spikes = np.flatnonzero((away > _FAR * usual) & alone) if usual > 0.0 else none
    between = np.diff(spikes)
    regular = len(spikes) > SPIKES.most and float(np.std(between)) < SPIKES.regular * float(np.mean(between))
    return none if len(spikes) > max(SPIKES.most, int(SPIKES.share * len(values))) or regular else spikes


def _whole_stretch(values: dict[str, FloatArray], length: int, period: float, findings: list[Finding]) -> tuple[int, int]:
    """Return the longest stretch of samples in which every channel has a number."""
    whole = np.ones(length, dtype=bool)
    for column in values.values():
        whole &= ~np.isnan(column)
    if whole.all():
        return 0, length
    begins, ends = stretches(whole)
    if not len(begins):
        return 0, 0
    longest = int(np.argmax(ends - begins))
    begin, end = int(begins[longest]), int(ends[longest])
    left = length - (end - begin)
    blamed = [name for name, column in values.items() if np.isnan(column).any()]
    channel = "" if len(blamed) == len(values) else ", ".join(blamed)
    gaps = f"{len(begins) - 1} gaps" if len(begins) > 2 else "a gap" if len(begins) == 2 else "missing values at an end"
    apart = (begins[1:] - ends[:-1] + 1) * period
    longest = int(np.argmax(apart)) if len(apart) else 0
    where = f", the longest of up to {apart[longest]:.3g} s from {(ends[longest] - 1) * period:.4g} s on" if len(apart) else ""
    fact = f"the recording has {gaps} too long to interpolate{where}"
    kept = f"kept is the longest whole stretch, {begin * period:.6g} to {(end - 1) * period:.6g} s"
    findings.append(Finding("gap", channel, fact, f"{kept}; {counted(left, 'sample', 'is', 'are')} left out"))
    return begin, end
