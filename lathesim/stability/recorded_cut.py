"""A recording of a cut: the channel with the vibration, its sample rate, the speed of the spindle, and when it cut."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.errors import RecordingError
from lathesim.record import FloatArray
from lathesim.recordings.raw_table import RawTable

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
    from lathesim.recordings.reading import read_recording

    table = read_recording(path, readers)
    rate = rate or _rate(table)
    name = channel or _channel(table)
    column = table.column_name(name)
    if column is None:
        raise RecordingError(f"the file has no column '{name}'.", place=str(path), remedy=table.near(name))
    values = np.asarray(table.columns[column], dtype=np.float64)
    if not np.isfinite(values).all():
        at = int(np.flatnonzero(~np.isfinite(values))[0])
        raise RecordingError(f"value {at + 1} of '{column}' is not a number.", place=str(path), remedy="Cut the recording there.")
    findings = []
    if speed is None:
        found = tacho or next((item for item in table.columns if item.lower().split(" ")[0] in _TURNING), None)
        if found is None or table.column_name(found) is None:
            remedy = "Give --speed in rpm, or --tacho with the column of a pulse a turn."
            raise RecordingError("nothing tells the speed of the spindle.", place=str(path), remedy=remedy)
        speed = 60.0 * turning_of(np.asarray(table.column(found)), rate, str(path))
        findings.append(f"'{found}' gives {speed:.1f} rpm")
    first, last = cutting_stretch(values, rate, speed / 60.0)
    if first > 0 or last < len(values):
        findings.append(f"it cuts from {first / rate:.2f} to {last / rate:.2f} s")
    return RecordedCut(column, values[first:last], values[: max(0, first - int(0.1 * rate))], rate, speed / 60.0, tuple(findings))


def _rate(table: RawTable) -> float:
    name = next((item for item in table.columns if item.lower().split(" ")[0] in _TIME), None)
    if name is None:
        raise RecordingError("no column is the time.", place=str(table.source), remedy="Give --rate, the samples a second.")
    steps = np.diff(np.asarray(table.columns[name], dtype=np.float64))
    steps = steps[np.isfinite(steps)]
    if not len(steps) or not np.median(steps) > 0.0:
        raise RecordingError("the time does not rise.", place=str(table.source), remedy="Give --rate, the samples a second.")
    unit = table.units.get(name, "")
    return float((1e3 if unit == "ms" else 1.0) / np.median(steps))


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
    steps = np.diff(pulse)
    if (steps >= 0.0).all() and pulse[-1] > pulse[0]:
        return float((pulse[-1] - pulse[0]) / (2.0 * np.pi) / ((len(pulse) - 1) / rate))
    centred = pulse - np.median(pulse)
    level = 0.35 * float(np.quantile(centred, 0.9995))
    rising = np.flatnonzero((centred[1:] > level) & (centred[:-1] <= level))
    if level <= 0.0 or len(rising) < 4:
        raise RecordingError("the tacho shows no pulses.", place=place, remedy="Give --speed.")
    comb = np.zeros(len(pulse))
    comb[rising] = 1.0
    spectrum = np.abs(np.fft.rfft(comb, 2 * len(comb))) ** 2
    repeats = np.fft.irfft(spectrum)[: len(comb)]
    smooth = np.convolve(repeats, np.ones(9), "same")
    least = max(int(np.median(np.diff(rising)) * 0.5), int(rate / 400.0), 5)
    period = least + int(np.argmax(smooth[least : len(smooth) // 2]))
    shorter = [period / part for part in (2, 3, 4) if period / part > least]
    for other in reversed(shorter):
        if smooth[round(other)] > 0.6 * smooth[period]:
            period = round(other)
            break
    # a pulse that rings counts once, at its first edge
    firsts = rising[np.concatenate([[True], np.diff(rising) > 0.3 * period])]
    gaps = np.diff(firsts)
    near = gaps[np.abs(gaps / period - 1.0) < 0.06]
    return float(rate / (near.mean() if len(near) >= 3 else period))


def cutting_stretch(values: FloatArray, rate: float, turning: float) -> tuple[int, int]:
    """Return the first and last sample of the cut: of a force that starts or ends near 0, or of a vibration that begins at once."""
    width = max(8, int(rate / turning))
    if len(values) < 8 * width:
        return 0, len(values)
    begun = _onset(values, rate)
    smooth = np.convolve(values, np.ones(width) / width, "same")
    low, high = np.quantile(smooth, 0.02), np.quantile(smooth, 0.8)
    if abs(low) > abs(high):
        low, high, smooth = -high, -low, -smooth
    spread = float(np.quantile(np.abs(values - smooth), 0.9))
    if high - low < 3.0 * spread or abs(low) > 0.3 * abs(high):
        return begun, len(values)
    inside = smooth > low + _IN_CUT * (high - low)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], inside.astype(int), [0]])))
    begins, ends = edges[::2], edges[1::2]
    longest = int(np.argmax(ends - begins))
    first, last = int(begins[longest]), int(ends[longest])
    # the ramps at both ends are no vibration
    margin = 2 * width
    while first + margin < last and smooth[first] < low + (1.0 - _SETTLED) * (high - low) and first < begins[longest] + 20 * width:
        first += width // 4
    last = last - margin if last < len(values) else last
    return (first, last) if last - first > 8 * width else (begun, len(values))


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
