"""The even clock of a recording, from the times its rows carry: repeated, unordered, missing and jittered times, found and said.

When something was on, told from a column: a tool in the cut from its force, a spindle that turns from its current.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from lathesim.record import FloatArray, stretches
from lathesim.recordings.raw_table import ENOUGH_SAMPLES, Finding, counted
from lathesim.recordings.recording_thresholds import CLOCK, MOTION
from lathesim.units import in_unit


@dataclass(frozen=True)
class Threshold:
    """On from where the column rises through ``above`` until it falls through ``until_below`` [SI of the column's unit].

    A crossing counts only if the column stays on that side for ``lasting`` [s]: noise does not switch. ``until_below`` may be higher than
    ``above``; then the column must have been higher than both before it can fall. A column that begins above is on from the start.
    The channel is ``value`` [SI of the channel] while on and 0 while off.
    """

    above: float
    until_below: float
    lasting: float
    value: float


def switched(column: FloatArray, threshold: Threshold, period: float) -> npt.NDArray[np.bool_]:
    """Return for each sample of ``column`` (samples,), taken every ``period`` [s], whether it is on."""
    least = max(1, round(threshold.lasting / period))
    rises = _crossings(column > threshold.above, least)
    falls = _crossings(column < threshold.until_below, least)
    on = np.zeros(len(column), dtype=bool)
    begin = 0 if len(column) and column[0] > threshold.above else _next(rises, -1)
    while begin is not None:
        end = _next(falls, begin)
        on[begin:end] = True
        begin = None if end is None else _next(rises, end)
    return on


def _crossings(beyond: npt.NDArray[np.bool_], least: int) -> npt.NDArray[np.int64]:
    """Return the samples from which on a condition holds for at least so many samples."""
    begins, ends = stretches(beyond)
    return begins[(ends - begins >= least) & (begins > 0)]


def _next(samples: npt.NDArray[np.int64], after: int) -> int | None:
    place = int(np.searchsorted(samples, after, side="right"))
    return int(samples[place]) if place < len(samples) else None


SHORT_GAP = 5
"""Fewer missing samples than this are bridged by a straight line."""
_LONG_GAP = SHORT_GAP + 0.5
"""Periods between two rows above which a gap is a long one."""
_NODES = 5
"""Rows of a fourth divided difference."""
_ON_GRID = 0.05
"""Times this close to the even clock [periods] count as on it: loggers round their time stamps."""
_NEARLY_WHOLE = 0.2
"""Periods that a step may be away from a whole number of them for the steps to be counted one by one."""
_LATEST = 1e12
"""Times [s] that are read; nothing was recorded 30 000 years from now."""
_LONGEST = 40_000_000
"""Samples of a grid; a clock with holes cannot ask for more."""


@dataclass(frozen=True, eq=False)
class SampleGrid:
    """An even clock: ``start`` and ``period`` [s], ``length`` samples, and where the rows of the file belong on it.

    ``rows`` are the rows that are used, and ``marks`` where they lie [periods]; without these each row is a sample. On an ``even`` clock
    samples without a row stay NaN, and ``missing`` counts those of short gaps. On an uneven one the values between rows are found by
    straight lines, or held. ``bridged`` are the rows (places among those used) before a long gap that is bridged as well.
    """

    start: float
    period: float
    length: int
    rows: npt.NDArray[np.int64] | slice
    marks: FloatArray | None = None
    even: bool = True
    missing: int = 0
    bridged: npt.NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    def place(self, values: FloatArray, *, held: bool = False) -> FloatArray:
        """Return a column (rows of the file,) on the grid (``length``,); what is held acts from the sample nearest to its row."""
        used = values[self.rows]
        if self.marks is None:
            return used.copy()
        if not self.even:
            return self._between(used, self.marks, held)
        placed = np.full(self.length, np.nan)
        placed[self.marks.astype(np.int64)] = used
        for before in self.bridged:
            begin, end = (int(mark) for mark in self.marks[before : before + 2])
            placed[begin:end] = used[before] if held else np.linspace(used[before], used[before + 1], end - begin, endpoint=False)
        return placed

    def _between(self, used: FloatArray, marks: FloatArray, held: bool) -> FloatArray:
        known = np.flatnonzero(~np.isnan(used))
        if not len(known):
            return np.full(self.length, np.nan)
        grid = np.arange(self.length, dtype=np.float64)
        after = np.minimum(np.searchsorted(marks[known], grid), len(known) - 1)
        first, last = known[np.maximum(after - 1, 0)], known[after]
        if held:
            placed = used[known[np.maximum(np.searchsorted(marks[known], grid + 0.5, side="right") - 1, 0)]]
        else:
            placed = np.interp(grid, marks[known], used[known])
        wide = (marks[last] - marks[first] > _LONG_GAP) & (np.abs(grid - marks[last]) > _ON_GRID)
        placed[wide & ~(np.isin(first, self.bridged) & (last == first + 1))] = np.nan
        return placed


def with_gaps_bridged(grid: SampleGrid, moving: Collection[FloatArray], findings: list[Finding]) -> SampleGrid:
    """Return a clock whose long gaps are bridged where nothing that moves, the columns ``moving`` (rows of the file,), turns within them.

    Only where no stretch between gaps is half of the recording, and enough by itself where the clock is uneven: else a gap is a loss, and
    not the way of the clock. As long as half of the samples have a row. A straight line is off by at most half of that by which the motion
    on one side, continued, misses the row at the other end (a step in the middle; a quarter of it for a parabola).
    """
    if grid.marks is None:
        return grid
    marks = grid.marks
    edges = np.flatnonzero(np.diff(marks) > _LONG_GAP)
    longest_stretch = int(np.diff(np.concatenate([[0], edges + 1, [len(marks)]])).max())
    if not len(edges) or (2 * longest_stretch >= grid.length and (grid.even or longest_stretch >= ENOUGH_SAMPLES)):
        return grid
    straight = np.ones(len(edges), dtype=bool)
    for column in moving:
        used = column[grid.rows]
        moves = max(MOTION.moves * float(np.nanmax(used) - np.nanmin(used)), MOTION.moves_noise * row_noise(marks, used))
        straight &= [not 0.5 * _missed(marks, used, int(before)) > moves for before in edges]
    bridged = edges[straight]
    samples = int(np.sum(np.round(np.diff(marks)[bridged]) - 1.0))
    if not len(bridged) or 2 * samples > grid.length:
        return grid
    longest = bridged[np.argmax(np.diff(marks)[bridged])]
    where = f"{in_unit((marks[longest + 1] - marks[longest]) * grid.period, 'ms', '.3g')} from {marks[longest] * grid.period:.4g} s on"
    left = f"{counted(len(bridged), 'long gap', 'leaves', 'leave')} {samples} of {grid.length} samples without a row"
    findings.append(Finding("jitter", "time", f"{left}, the longest of {where}", "no motion turns there, so they are interpolated as well"))
    return replace(grid, bridged=bridged)


def _missed(marks: FloatArray, used: FloatArray, before: int) -> float:
    """Return by how much the motion on one side of a gap, continued as a straight line over it, misses the row at the other end: the
    smaller of both sides. Each line goes through the rows that are no further off than the gap is long, and through two at least."""
    width = marks[before + 1] - marks[before]
    first = min(int(np.searchsorted(marks, marks[before] - width)), max(before - 1, 0))
    last = max(int(np.searchsorted(marks, marks[before + 1] + width, side="right")), before + 3)
    missed = []
    for side, other in ((slice(first, before + 1), before + 1), (slice(before + 1, last), before)):
        at, there = marks[side] - marks[other], used[side]
        known = ~np.isnan(there)
        if np.count_nonzero(known) > 1 and not np.isnan(used[other]):
            missed.append(abs(float(np.polyfit(at[known], there[known], 1)[1]) - float(used[other])))
    return min(missed, default=0.0)


def row_noise(marks: FloatArray, values: FloatArray) -> float:
    """Return the white noise of a column at uneven times (one standard deviation): fourth divided differences, in which a cubic vanishes,
    each over the norm of its weights. Of even times these are the fourth differences. Source: Newton's divided differences."""
    known = ~np.isnan(values)
    if np.count_nonzero(known) <= _NODES:
        return 0.0
    times, there = (np.lib.stride_tricks.sliding_window_view(column[known], _NODES) for column in (marks, values))
    apart = (times[:, :, None] - times[:, None, :]) / (times[:, -1] - times[:, 0])[:, None, None]
    weights = 1.0 / np.prod(apart + np.eye(_NODES), axis=2)
    return 1.4826 * float(np.median(np.abs(np.sum(weights * there, axis=1) / np.linalg.norm(weights, axis=1))))


def regular_grid(count: int, period: float) -> SampleGrid:
    """Return the clock of rows taken at a known rate."""
    return SampleGrid(0.0, period, count, slice(None))


def even_grid(time: FloatArray, findings: list[Finding], lesson_period: float = 0.0) -> SampleGrid:
    """Return the even clock nearest to the times of the rows [s], and note in ``findings`` where they are not even. Where no even clock is
    behind them, that of the lesson is taken (``lesson_period`` [s], or the nearest multiple) if it is about as fast."""
    rows = np.flatnonzero(np.abs(time) < _LATEST)
    if len(rows) < len(time):
        findings.append(Finding("time", "time", f"{len(time) - len(rows)} rows have no time", "they are left out"))
    rows = _in_order(time, rows, findings)
    if len(rows) < 2:
        return SampleGrid(0.0, 1.0, len(rows), rows)
    coarse = _coarse(time[rows])
    if coarse is not None:
        period, distinct = coarse
        fact = f"the times have {distinct} values for {len(rows)} rows"
        findings.append(Finding("time", "time", fact, f"the program assumes even rows, {period:.6g} s apart"))
        return SampleGrid(float(time[rows[0]]), period, len(rows), rows)
    rows = _without_repeats(time, rows, findings)
    return SampleGrid(0.0, 1.0, len(rows), rows) if len(rows) < 2 else _fitted(time[rows], rows, findings, lesson_period)


def _in_order(time: FloatArray, rows: npt.NDArray[np.int64], findings: list[Finding]) -> npt.NDArray[np.int64]:
    """Sort rows that are a little out of order; of a clock that starts anew keep the longest stretch."""
    steps = np.diff(time[rows])
    backward = np.flatnonzero(steps < 0.0)
    if not len(backward):
        return rows
    forward = steps[steps > 0.0]
    usual = float(np.median(forward)) if len(forward) else 1.0
    rows = _without_rewinds(time, rows, usual, findings)
    steps = np.diff(time[rows])
    backward = np.flatnonzero(steps < 0.0)
    if not len(backward):
        return rows
    anew = backward[-steps[backward] > CLOCK.back * usual]
    if len(anew) and len(anew) <= max(CLOCK.restarts, int(CLOCK.share * len(rows))):
        edges = np.concatenate([[0], anew + 1, [len(rows)]])
        longest = max((rows[begin:end] for begin, end in itertools.pairwise(edges)), key=len)
        fact = f"the clock starts anew {counted(len(anew), 'time')}"
        done = f"kept is the longest stretch, {len(longest)} of {len(rows)} rows from row {longest[0] + 1} on"
        findings.append(Finding("time", "time", fact, done))
        rows = longest
        backward = np.flatnonzero(np.diff(time[rows]) < 0.0)
        if not len(backward):
            return rows
    findings.append(
        Finding("time", "time", f"{counted(len(backward), 'row', 'is', 'are')} earlier than the row before", "the rows are sorted by time")
    )
    return rows[np.argsort(time[rows], kind="stable")]


def _without_rewinds(time: FloatArray, rows: npt.NDArray[np.int64], usual: float, findings: list[Finding]) -> npt.NDArray[np.int64]:
    """Leave out rows that were written twice: the clock goes back to where it was a while ago, not to its start, and then runs on."""
    times = time[rows]
    back = np.flatnonzero(np.diff(times) < -CLOCK.back * usual) + 1
    if not len(back):
        return rows
    reached = np.maximum.accumulate(times)
    ends = [*back[1:], len(times)]
    rewound = [
        times[begin] > times[0] + CLOCK.back * usual and times[begin:end].max() > reached[begin - 1]
        for begin, end in zip(back, ends, strict=True)
    ]
    if not all(rewound):
        return rows
    twice = np.zeros(len(times), dtype=bool)
    for begin, end in zip(back, ends, strict=True):
        twice[begin:end] = times[begin:end] <= reached[begin - 1] + 0.5 * usual
    fact = f"the clock goes back {counted(len(back), 'time')} and runs on: {counted(int(twice.sum()), 'row')} were written twice"
    findings.append(Finding("time", "time", fact, "each is kept once"))
    return rows[~twice]


def _coarse(time: FloatArray) -> tuple[float, int] | None:
    """Return the period where the times are rounded so far that rows share them, and the number of values they take."""
    steps = np.diff(time)
    distinct = 1 + int(np.count_nonzero(steps > 0.0))
    if distinct > CLOCK.shared * len(time) or distinct < CLOCK.fewest:
        return None
    quantum = float(np.quantile(steps[steps > 0.0], 0.9))
    number = np.arange(len(time))
    period, start = np.polyfit(number, time, 1)
    if period <= 0.0 or np.abs(time - (start + period * number)).max() > CLOCK.rounded * quantum:
        return None
    return _rounded(float(period), quantum / len(time)), distinct


def _without_repeats(time: FloatArray, rows: npt.NDArray[np.int64], findings: list[Finding]) -> npt.NDArray[np.int64]:
    fresh = np.concatenate([[True], np.diff(time[rows]) > 0.0])
    repeated = len(rows) - int(np.count_nonzero(fresh))
    if repeated:
        findings.append(
            Finding(
                "time", "time", f"{counted(repeated, 'row', 'repeats', 'repeat')} the time of the row before", "the first of them is used"
            )
        )
    kept: npt.NDArray[np.int64] = rows[fresh]
    return kept


def _fitted(time: FloatArray, rows: npt.NDArray[np.int64], findings: list[Finding], lesson_period: float) -> SampleGrid:
    start = float(time[0])
    usual = float(np.median(np.diff(time)))
    if float(time[-1]) - start > _LONGEST * usual:
        fact = f"the times span {(float(time[-1]) - start) / usual:.3g} periods of {usual:.6g} s, most of them without a row"
        findings.append(Finding("time", "time", fact, "the program assumes even rows"))
        return SampleGrid(start, usual, len(rows), rows)
    period = _first_period(np.diff(time))
    slots = _slots(time, period)
    if len(np.unique(slots)) == len(slots):
        period = _rounded(_slope(slots, time), _ON_GRID * period / max(slots[-1], 1))
        slots = _slots(time, period)
    away = np.abs((time - start) / period - slots)
    length = int(slots[-1]) + 1
    lost = np.diff(slots) - 1
    short = int(lost[(lost > 0) & (lost < SHORT_GAP)].sum())
    if away.max() <= _ON_GRID and len(np.unique(slots)) == len(slots):
        if short:
            findings.append(
                Finding(
                    "gap", "", f"{counted(short, 'sample', 'is', 'are')} missing in gaps of fewer than {SHORT_GAP}", "interpolated linearly"
                )
            )
        return SampleGrid(start, period, length, rows, slots.astype(np.float64) if length > len(rows) else None, missing=short)
    steps = np.diff(time)
    period = beside(period, lesson_period)
    fact = f"the rows come unevenly, {in_unit(steps.min(), 'ms', '.3g')} to {in_unit(steps.max(), 'ms', '.3g')} apart"
    done = f"the {len(rows)} rows are interpolated onto an even clock of {in_unit(period, 'ms', '.6g')}"
    findings.append(Finding("jitter", "time", fact, f"{done}; what is held stays held"))
    moments = (time - start) / period
    return SampleGrid(start, period, int(moments[-1] + 1e-9) + 1, rows, moments, even=False)


def beside(period: float, other: float) -> float:
    """Return the nearest multiple of another period where one is as near to it as no clock is regular [s]: controllers decide on that."""
    number = round(period / other) if other > 0.0 else 0
    return number * other if number and abs(period / other - number) < _NEARLY_WHOLE else period


def _first_period(steps: FloatArray) -> float:
    """Return the usual step; where each step is nearly a whole number of them, the mean one: seconds since 1970 resolve no step better than
    a quarter of a microsecond, which adds up over the rows."""
    usual = float(np.median(steps))
    number = np.round(steps / usual)
    if np.all(number >= 1.0) and np.all(np.abs(steps / usual - number) < _NEARLY_WHOLE):
        return float(steps.sum() / number.sum())
    return usual


def _slots(time: FloatArray, period: float) -> npt.NDArray[np.int64]:
    slots: npt.NDArray[np.int64] = np.round((time - time[0]) / period).astype(np.int64)
    return slots


def _slope(slots: npt.NDArray[np.int64], time: FloatArray) -> float:
    """Return the period that fits best, through the first row."""
    number = slots.astype(np.float64)
    return float(number @ (time - time[0]) / (number @ number))


def _rounded(period: float, room: float) -> float:
    """Return the roundest number of seconds within ``room`` of the period, so that 1 kHz is exactly 1 ms."""
    for digits in range(1, 13):
        round_one = float(f"{period:.{digits}g}")
        if abs(round_one - period) <= room:
            return round_one
    return period


def bridge_short_runs(values: FloatArray, *, held: bool) -> FloatArray:
    """Return values (samples,) with short runs without a number interpolated linearly, or held."""
    missing = np.isnan(values)
    if not missing.any() or missing.all():
        return values
    begins, ends = stretches(missing)
    inside = (ends - begins < SHORT_GAP) & (begins > 0) & (ends < len(values))
    filled = values.copy()
    present = np.flatnonzero(~missing)
    for begin, end in zip(begins[inside], ends[inside], strict=True):
        if held:
            filled[begin:end] = values[begin - 1]
        elif end - begin > 1:
            filled[begin:end] = np.interp(np.arange(begin, end), present, values[present])
        else:
            filled[begin] = 0.5 * (values[begin - 1] + values[end])
    return filled
