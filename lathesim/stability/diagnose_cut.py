"""A recorded cut to its diagnosis: what the vibration is, when it could be told, which second cut decides, and which speeds are worth
trying.

When chatter could first have been told: the difference of two turns that comes back larger, turned by the same angle.

What repeats with the spindle, as run-out or a slot, is no part of the difference d(t) = x(t) - x(t - T). Of chatter the next difference
is mu d(t), mu the multiplier of a turn: complex in a narrow band (Hopf), or a negative number in all bands (flip). Three turns show it.
Source: T. Insperger, G. Stepan, Semi-Discretization for Time-Delay Systems (2011), multipliers.

A recording of a cut: the channel with the vibration, its sample rate, the speed of the spindle, and when it cut.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.errors import RecordingError
from lathesim.record import FloatArray, stretches
from lathesim.recordings.raw_table import RawTable
from lathesim.stability.judge import Judged, judge, judge_line
from lathesim.stability.signal_lines import Vibration, vibration, within_band
from lathesim.stability.stability_thresholds import GROWTH, ORDERS, RECORDED, SIGN

_TIME = ("time", "t", "x_value", "time_s")
_TURNING = ("taco", "tacho", "speed", "rpm", "angle", "index", "pulse", "spindle")
_IN_CUT = 0.4
"""A force above this share of its upper level is that of a cut."""
_SETTLED = 0.05
_BLOCK = 0.004
"""Length [s] of the pieces whose sizes are compared."""
_SUDDEN = 5.0
"""A piece so many times larger than all before it begins a cut."""


@dataclass(frozen=True, eq=False)
class RecordedCut:
    """The values in the cut and before it (empty where the recording begins in the cut), the sample rate [Hz], the speed [rev/s] and what
    was
    found while reading."""

    name: str
    values: FloatArray
    before: FloatArray
    rate: float
    turning: float
    findings: tuple[str, ...] = ()


def recorded_cut(
    path: Path, readers: Any, *, channel: str | None = None, speed: float | None = None, rate: float | None = None, tacho: str | None = None
) -> RecordedCut:
    """Return a cut from a recording; ``speed`` [rpm], or a ``tacho`` column with one pulse a turn; ``rate`` [Hz] where no column is the
    time.

    Raises :class:`RecordingError` in one sentence where something is missing.
    """
    from lathesim.recordings.raw_table import read_recording

    table = read_recording(path, readers)
    rate = rate or _rate(table)
    name = channel or _channel(table)
    values, column = table.column(name), table.column_name(name)
    if not np.isfinite(values).all():
        at = int(np.flatnonzero(~np.isfinite(values))[0])
        raise RecordingError(f"value {at + 1} of '{column}' is not a number.", place=str(path), remedy="Cut the recording there.")
    findings = []
    if speed is None:
        found = tacho or next((item for item in table.columns if item.lower().split(" ")[0] in _TURNING), None)
        if found is None or table.column_name(found) is None:
            remedy = "Give --speed in rpm, or --tacho with the column of a pulse a turn."
            raise RecordingError("the speed of the spindle is not known.", place=str(path), remedy=remedy)
        speed = 60.0 * turning_of(np.asarray(table.column(found)), rate, str(path))
        findings.append(f"'{found}' gives {speed:.1f} rpm")
    first, last = cutting_stretch(values, rate, speed / 60.0)
    if first > 0 or last < len(values):
        findings.append(f"it cuts from {first / rate:.2f} to {last / rate:.2f} s")
    return RecordedCut(str(column), values[first:last], values[: max(0, first - int(0.1 * rate))], rate, speed / 60.0, tuple(findings))


def _rate(table: RawTable) -> float:
    name = next((item for item in table.columns if item.lower().split(" ")[0] in _TIME), None)
    if name is None:
        raise RecordingError("no column is the time.", place=str(table.source), remedy="Give --rate, the samples a second.")
    steps = np.diff(np.asarray(table.columns[name], dtype=np.float64))
    steps = steps[np.isfinite(steps)]
    if not len(steps) or not np.median(steps) > 0.0:
        raise RecordingError("the time does not rise.", place=str(table.source), remedy="Give --rate, the samples a second.")
    return float((1e3 if table.units.get(name, "") == "ms" else 1.0) / np.median(steps))


def _channel(table: RawTable) -> str:
    names = [item for item in table.columns if item.lower().split(" ")[0] not in (*_TIME, *_TURNING)]
    if not names:
        raise RecordingError("no column holds a vibration.", place=str(table.source), remedy="Name one with --channel.")
    # of several forces the one along the normal is not known: the one that moves most against its noise
    return max(names, key=lambda item: float(np.nanstd(np.diff(table.columns[item]))))


def turning_of(pulse: FloatArray, rate: float, place: str = "") -> float:
    """Return the revolutions a second of a signal with one pulse a turn, or of an angle that rises; pulses may ring.

    Source: the distance of pulses that most of them keep, by the autocorrelation, then all pulses together.
    """
    if (np.diff(pulse) >= 0.0).all() and pulse[-1] > pulse[0]:
        return float((pulse[-1] - pulse[0]) / (2.0 * np.pi) / ((len(pulse) - 1) / rate))
    centred = pulse - np.median(pulse)
    level = 0.35 * float(np.quantile(centred, 0.9995))
    rising = np.flatnonzero((centred[1:] > level) & (centred[:-1] <= level))
    if level <= 0.0 or len(rising) < RECORDED.pulses:
        raise RecordingError("the tacho shows no pulses.", place=place, remedy="Give --speed.")
    comb = np.zeros(len(pulse))
    comb[rising] = 1.0
    smooth = np.convolve(np.fft.irfft(np.abs(np.fft.rfft(comb, 2 * len(comb))) ** 2)[: len(comb)], np.ones(9), "same")
    least = max(int(np.median(np.diff(rising)) * 0.5), int(rate / 400.0), 5)
    period = least + int(np.argmax(smooth[least : len(smooth) // 2]))
    for other in reversed([period / part for part in (2, 3, 4) if period / part > least]):
        if smooth[round(other)] > RECORDED.shorter * smooth[period]:
            period = round(other)
            break
    # a pulse that rings counts once, at its first edge
    firsts = rising[np.concatenate([[True], np.diff(rising) > RECORDED.same_pulse * period])]
    gaps = np.diff(firsts)
    near = gaps[np.abs(gaps / period - 1.0) < RECORDED.even]
    return float(rate / (near.mean() if len(near) >= RECORDED.pulses - 1 else period))


def cutting_stretch(values: FloatArray, rate: float, turning: float) -> tuple[int, int]:
    """Return the first and last sample of the cut: of a force that starts or ends near 0, or of a vibration that begins at once."""
    width = max(8, int(rate / turning))
    if len(values) < RECORDED.windows * width:
        return 0, len(values)
    begun = _onset(values, rate)
    smooth = np.convolve(values, np.ones(width) / width, "same")
    low, high = np.quantile(smooth, 0.02), np.quantile(smooth, 0.8)
    if abs(low) > abs(high):
        low, high, smooth = -high, -low, -smooth
    spread = float(np.quantile(np.abs(values - smooth), 0.9))
    if high - low < RECORDED.stands_out * spread or abs(low) > RECORDED.idle * abs(high):
        return begun, len(values)
    begins, ends = stretches(smooth > low + _IN_CUT * (high - low))
    longest = int(np.argmax(ends - begins))
    first, last = int(begins[longest]), int(ends[longest])
    # the ramps at both ends are no vibration
    margin = 2 * width
    while (
        first + margin < last
        and smooth[first] < low + (1.0 - _SETTLED) * (high - low)
        and first < begins[longest] + RECORDED.settles * width
    ):
        first += width // 4
    last = last - margin if last < len(values) else last
    return (first, last) if last - first > RECORDED.windows * width else (begun, len(values))


def _onset(values: FloatArray, rate: float) -> int:
    """Return the first sample of a vibration that begins at once after silence, 0 where none does: the entry of the tool.

    Chatter grows out of noise by some per cent in a vibration and never so suddenly.
    """
    block = max(16, int(_BLOCK * rate))
    count = len(values) // block
    size = values[: count * block].reshape(count, block).std(axis=1)
    for at in range(4, int(0.6 * count)):
        before = size[: at - 1]
        if size[at] > _SUDDEN * before.max() and before.max() < 2.0 * np.median(before):
            return (at - 1) * block
    return 0


_MOST_DIFFERENCES = 8
"""Differences of turns that are looked at together at most."""
_BAND = 0.12
"""Half width of a band over its order."""
_CHECKS_A_TURN = 4


@dataclass(frozen=True)
class FirstSign:
    """When chatter could be told [s after the beginning], and the difference of two turns before that over its largest."""

    time: float
    share: float


def first_sign(values: FloatArray, rate: float, turning: float, mean: float) -> FirstSign | None:
    """Return the first sign of chatter in a signal; ``mean`` is that of a force, 0 of other signals. None where nothing tells of it."""
    turn = rate / turning
    steps = _CHECKS_A_TURN * len(values) / turn
    in_a_row = 0
    for check in range(3 * _CHECKS_A_TURN, int(steps) + 1):
        end = check * turn / _CHECKS_A_TURN
        in_a_row = in_a_row + 1 if _grows(values, end, turn, mean) else 0
        if in_a_row >= (1 if mean > 0.0 else SIGN.checks):
            sizes = difference_sizes(values, turn)
            largest = float(np.quantile(sizes, 0.95)) if len(sizes) else 0.0
            now = sizes[max(0, min(int(end / turn) - 2, len(sizes) - 1))]
            return FirstSign(end / rate, float(now / largest) if largest > 0.0 else 1.0)
    return None


def difference_sizes(values: FloatArray, turn: float) -> FloatArray:
    """Return the standard deviation of each difference of two turns that follow each other, (turns - 1,)."""
    rows = [_piece(values, number * turn, turn) for number in range(int(len(values) / turn))]
    return np.array([float((after - before).std()) for before, after in itertools.pairwise(rows)])


def _piece(values: FloatArray, start: float, turn: float) -> FloatArray:
    """Return the turn that begins at a place between samples."""
    places = start + np.arange(int(turn))
    first = int(start)
    part = places - first
    below = part.astype(np.int64)
    inside = values[first : first + int(turn) + 2]
    above = np.minimum(below + 1, len(inside) - 1)
    share = part - below
    return np.asarray((1.0 - share) * inside[below] + share * inside[above])


def _grows(values: FloatArray, end: float, turn: float, mean: float) -> bool:
    """Whether the last turns before ``end`` [samples] show a vibration off the orders that does not die out."""
    before, after = _difference(values, end - turn, turn), _difference(values, end, turn)
    if mean > 0.0 and after.std() < SIGN.of_force * mean:
        return False
    if _changes_sign(before, after):
        return True
    order = _strongest_order(np.concatenate([before, after]))
    if order <= 0.0:
        return False
    count = min(max(math.ceil(SIGN.independent / (2.0 * _BAND * order)), 2), _MOST_DIFFERENCES)
    if end < (count + 1) * turn:
        return False
    rows = [_difference(values, end - back * turn, turn) for back in range(count - 1, -1, -1)]
    return _turns_and_grows(np.concatenate(rows), count, order)


def _changes_sign(before: FloatArray, after: FloatArray) -> bool:
    """Whether a difference comes back as large with its sign changed, in all lines that stand out of its noise: a flip."""
    spectra = np.fft.rfft(np.stack([before, after]), axis=1)
    power = (np.abs(spectra) ** 2).sum(axis=0)
    kept = power > SIGN.stands_out * np.median(power)
    if np.count_nonzero(kept) < SIGN.fewest_lines or power[kept].sum() < SIGN.narrow * power.sum():
        return False
    first, last = spectra[0, kept], spectra[1, kept]
    size, product = float(np.vdot(first, first).real), float(np.vdot(first, last).real)
    return -product >= max(size, SIGN.alike * math.sqrt(size * float(np.vdot(last, last).real)))


def _difference(values: FloatArray, end: float, turn: float) -> FloatArray:
    """Return the turn that ends at a place less the turn before, without its mean."""
    found = _piece(values, max(0.0, end - turn), turn) - _piece(values, max(0.0, end - 2.0 * turn), turn)
    return np.asarray(found - found.mean())


def _strongest_order(both: FloatArray) -> float:
    """Return the order that is strongest in two differences, 0 where none is."""
    power = np.abs(np.fft.rfft(both)) ** 2
    order = 0.5 * np.arange(len(power))
    power[order < ORDERS.lowest_order] = 0.0
    return float(order[int(np.argmax(power))]) if power.any() else 0.0


def _turns_and_grows(rows: FloatArray, count: int, top: float) -> bool:
    """Whether the band with ``count`` differences in a row comes back as large after a turn, at an angle that is none of whole orders."""
    length = len(rows)
    spectrum = np.fft.fft(rows)
    order = np.fft.fftfreq(length) * length / count
    power = np.where(order >= ORDERS.lowest_order, np.abs(spectrum) ** 2, 0.0)
    shape = np.exp(-0.5 * ((order - top) / max(1.0, _BAND * top)) ** 2)
    if float((power * shape**2).sum()) < SIGN.narrow * float(power.sum()):
        return False
    band = np.fft.ifft(2.0 * spectrum * shape)
    turn, edge = length // count, max(1, length // (12 * count))
    before, after = band[edge : length - turn - edge], band[turn + edge : length - edge]
    product = np.vdot(before, after)
    first, last = float(np.vdot(before, before).real), float(np.vdot(after, after).real)
    alike = abs(product) / math.sqrt(first * last) if first > 0.0 and last > 0.0 else 0.0
    return bool(alike >= SIGN.alike and last >= SIGN.growth * first and abs(np.angle(product)) > 2.0 * np.pi * SIGN.off_order)


_CHATTER = ("hopf", "flip")


@dataclass(frozen=True, eq=False)
class CutDiagnosis:
    """What a vibration is, the vibration itself, what it cannot be, the cut that decides between what is left, speeds [rpm] worth trying,
    when
    chatter could be told [s] and the amplitude there over the largest."""

    judged: Judged
    vibration: Vibration
    cannot_be: tuple[str, ...]
    second_cut: str
    speeds: tuple[float, ...]
    told_at: float = math.nan
    told_share: float = math.nan
    findings: tuple[str, ...] = field(default=())


def diagnose_cut(
    cut: RecordedCut, modes: tuple[float, ...] = (), other: RecordedCut | None = None, band: tuple[float, float] | None = None
) -> CutDiagnosis:
    """Return the diagnosis of a cut; ``modes`` are natural frequencies [Hz] of its tool point, ``other`` is a cut at another speed.

    With a ``band`` [Hz] only what is in it is judged.
    """
    found = vibration(cut.values, cut.rate, cut.turning)
    if band is not None:
        found = within_band(found, *band)
    quiet = None
    if len(cut.before) * cut.turning / cut.rate >= ORDERS.fewest_turns and np.ptp(cut.before) > 0.0:
        quiet = vibration(cut.before, cut.rate, cut.turning)
    judged = judge(found, modes, quiet) if band is None else judge_line(found, modes)
    if other is not None:
        judged = _with_second(judged, found, vibration(other.values, other.rate, other.turning))
    told_at, told_share = _told(cut, judged, found)
    return CutDiagnosis(
        judged, found, _cannot_be(judged), _second_cut(judged, found), _speeds(judged, found, modes), told_at, told_share, cut.findings
    )


def _with_second(judged: Judged, first: Vibration, second: Vibration) -> Judged:
    """Return the judgement after a second cut at another speed: what moves with the speed is forced or segmentation, what stays is not."""
    line = judged.line
    ratio = second.turning / first.turning
    if line is None or abs(ratio - 1.0) < 2.0 * ORDERS.moved or judged.kind in ("stable", "entry"):
        return judged
    reach = max(ORDERS.moved * line.frequency, line.width * line.resolution, 2.0 * line.resolution)
    moved = any(abs(item.frequency - ratio * line.frequency) < reach for item in second.lines)
    stayed = any(abs(item.frequency - line.frequency) < ORDERS.stayed * reach and item.share > ORDERS.something for item in second.lines)
    if moved and not stayed and judged.kind in ("hopf", "segmentation"):
        told = f"at {60 * second.turning:.0f} rpm the line is at {ratio * line.frequency:.1f} Hz: it moves with the speed"
        return Judged("segmentation", line, judged.mode, (*judged.reasons, told))
    if stayed and not moved and judged.kind in ("hopf", "segmentation"):
        told = f"at {60 * second.turning:.0f} rpm the line stays near {line.frequency:.1f} Hz: it belongs to a mode"
        return Judged("hopf" if not line.is_wide else "segmentation", line, judged.mode, (*judged.reasons, told))
    return judged


def _told(cut: RecordedCut, judged: Judged, found: Vibration) -> tuple[float, float]:
    """Return from which time on [s] chatter could be told, and how large it was then over its largest; nan for what is no chatter."""
    if judged.kind not in _CHATTER or judged.line is None:
        return math.nan, math.nan
    sign = first_sign(found.values, cut.rate, found.turning, abs(float(np.mean(cut.values))) if found.modulation > 0.0 else 0.0)
    return (sign.time, sign.share) if sign is not None else (len(cut.values) / cut.rate, 1.0)


def _cannot_be(judged: Judged) -> tuple[str, ...]:
    """Return what the deciding line cannot be, each with its reason."""
    line = judged.line
    if line is None:
        return ()
    said = []
    part = abs(line.order - round(line.order))
    if judged.kind not in ("forced", "entry"):
        if line.is_wide:
            said.append(f"forced vibration: a line {line.width * line.resolution:.0f} Hz wide is no order of the spindle")
        elif part > ORDERS.not_whole:
            said.append(f"forced vibration: order {line.order:.2f} is no whole number")
    if judged.kind != "mains" and line.is_wide:
        said.append("mains hum: that is narrow")
    elif judged.kind != "mains":
        said.append(f"mains hum: {line.frequency:.1f} Hz is no steady multiple of 50 or 60 Hz")
    if judged.kind not in _CHATTER and judged.runner_up not in _CHATTER:
        said.append("chatter that has set in: that is narrow and grows" if line.is_wide else "chatter: that is at no whole order and grows")
    elif line.is_wide and judged.kind not in _CHATTER:
        said.append("chatter that has set in: that would be one narrow line")
    if judged.kind in ("hopf", "flip") and line.late >= GROWTH.grew:
        said.append("segmentation: that is there in full from the first turn on")
    return tuple(said)


def _second_cut(judged: Judged, found: Vibration) -> str:
    line = judged.line
    speed = 60.0 * found.turning
    if judged.kind == "stable" or line is None:
        return ""
    faster = 1.1 * speed
    if judged.kind in ("hopf", "flip", "segmentation"):
        moved, stays = 1.1 * line.frequency, line.frequency
        return (
            f"The same cut at {faster:.0f} rpm: a line that moves to {moved:.0f} Hz goes with the chip or the spindle, one that stays near "
            f"{stays:.0f} Hz belongs to a mode. Half the width at {speed:.0f} rpm: chatter then vanishes, the others halve."
        )
    if judged.kind == "forced":
        return f"The same cut at {faster:.0f} rpm: forced vibration moves by 10 %, and is large where an order meets a mode."
    if judged.kind == "mains":
        return "The machine with the spindle stopped: hum stays."
    return f"The same cut at {faster:.0f} rpm: a resonance stays at {line.frequency:.0f} Hz."


def _speeds(judged: Judged, found: Vibration, modes: Sequence[float]) -> tuple[float, ...]:
    """Return speeds [rpm] at which a whole number of vibrations of the mode fits into a turn, from half to twice the present speed.

    At them the waves of two turns are in step, so that the chip keeps its thickness: the gaps between the lobes.
    """
    if judged.kind not in _CHATTER or judged.line is None:
        return ()
    natural = modes[judged.mode - 1] if judged.mode else judged.line.frequency / 1.02
    speed = 60.0 * found.turning
    found_speeds = [60.0 * natural / count for count in range(1, 200)]
    near = [value for value in found_speeds if 0.5 * speed <= value <= 2.0 * speed]
    return tuple(sorted(near, key=lambda value: abs(math.log(value / speed)))[:4])
