"""Values that stay where they are while the machine moves: frozen channels and clipped ones.

Time offsets between channels, from what they have in common: their motion, or the noise that one hands on to the other.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
import numpy.typing as npt

from lathesim.record import FloatArray, stretches
from lathesim.recordings.raw_table import Finding
from lathesim.recordings.recorded_channel import MOTION_UNITS, Pair, RecordedChannel, rate
from lathesim.recordings.recording_thresholds import CLIPPED, CLOCK, FROZEN, MOTION, ROUNDING
from lathesim.units import in_unit

_BEFORE = 10
"""Samples before a step in which a motion, differentiated, shows nothing of it yet."""
_LONG = 30
"""A channel is called frozen after this many equal samples at least."""
_COUNTS = 2.0
"""Of its smallest steps: what a channel may stand behind its partner that goes on."""
_DITHER = 3.5
"""Of its smallest steps: what a channel that stands still goes to and fro."""
_READ = ("A", "N", "N*m")
_REPEATED, _TURNING = 0.5, 0.2
"""Share of the samples that repeat the one before, at the most, and of those at which a channel turns round, at the least, in noise."""
_GRAZES, _GRAZED = 3, 10
"""Samples for which noise grazes a level, and how often it does where it is cut off there."""
_FULL_SCALE = (7, 24)
"""Bits of converters whose largest and smallest numbers are known when they are seen."""
_OFF = 0.02
"""How far, in its steps, the end of a converter may be off."""
_STANDING = 120
"""Samples without noise at one end from which on a force that is measured is cut off there."""


def frozen_channels(channels: list[RecordedChannel], found_pairs: list[Pair], period: float) -> list[Finding]:
    """Find stretches in which a channel repeats one value while the machine goes on, as a logger leaves them that lost its source."""
    findings = []
    for channel in channels:
        if channel.constant or channel.unit == "1":
            continue
        begins, ends = stretches(channel.steps == 0.0)
        lengths = ends - begins + 1
        long = lengths >= max(_LONG, FROZEN.longer * _usual_run(lengths))
        stuck = [
            (int(begin), int(end) + 1)
            for begin, end in zip(begins[long], ends[long], strict=True)
            if _is_frozen(channel, int(begin), int(end) + 1, channels, found_pairs)
        ]
        if stuck:
            begin, end = max(stuck, key=lambda run: run[1] - run[0])
            more = f", the longest of {len(stuck)} such stretches" if len(stuck) > 1 else ""
            when = f"{begin * period:.6g} to {(end - 1) * period:.6g} s"
            fact = f"it is frozen at {channel.values[begin]:.6g} {channel.unit} from {when}{more}"
            findings.append(Finding("frozen", channel.name, fact, "leave this stretch out, or record again", True))
    return findings


def _usual_run(lengths: npt.NDArray[np.int64]) -> float:
    """Return the length of the runs in which most samples lie that repeat at all, without the longest few."""
    if len(lengths) < FROZEN.runs:
        return 0.0
    ordered = np.sort(lengths)[:-5]
    return float(ordered[int(np.searchsorted(np.cumsum(ordered) / max(float(ordered.sum()), 1.0), 0.5))])


def _is_frozen(channel: RecordedChannel, begin: int, end: int, channels: list[RecordedChannel], found_pairs: list[Pair]) -> bool:
    """Return whether a run of equal values, samples ``begin`` to ``end`` - 1, cannot be the machine's own rest."""
    value = channel.values[begin]
    extreme = value in (channel.values.max(), channel.values.min())
    if extreme and np.count_nonzero(channel.values == value) > FROZEN.comes_again * (end - begin):
        return False
    for pair in found_pairs:
        if channel in (pair.first, pair.second) and abs(pair.correlation) > MOTION.alike:
            if _leaves_partner(pair, channel, begin, end) and not (channel is pair.second and _is_stepped(pair, end)):
                return True
            if channel.unit in ("m", "rad"):
                return False
    if channel.driven:
        return False
    others = [other for other in channels if other is not channel]
    if value in (0.0, channel.values.max(), channel.values.min()) or not _stops_on_its_way(channel, begin):
        return False
    if _jumps_at_end(channel, end):
        return any(_moves(other, begin, end) for other in others if other.group == channel.group or other.driven)
    if _all_stand_still(others, begin, end):
        return False
    return _noise_is_gone(channel, begin, end) and any(_alive(other, begin, end) for other in others if not other.driven)


def _all_stand_still(channels: list[RecordedChannel], begin: int, end: int) -> bool:
    """Return whether the machine stands still: its command and all of its places repeat one value each. A controller then gives the same
    voltage all the time, while a table sticks within one count and a current is as noisy as ever."""
    shown = [channel for channel in channels if channel.driven or channel.unit in ("m", "rad")]
    if all(channel.driven for channel in shown):
        return False
    # a second sensor, which closes no loop, may be as noisy as ever
    room = [0.0 if channel.driven else _DITHER * _count(channel) for channel in shown]
    return all(np.ptp(channel.values[begin:end]) <= most for channel, most in zip(shown, room, strict=True))


def _leaves_partner(pair: Pair, channel: RecordedChannel, begin: int, end: int) -> bool:
    """Return whether the partner goes on while the channel stands, and the channel then catches up in one step."""
    if channel is pair.second:
        gone = np.abs(np.ptp(pair.expected[begin:end])) * abs(pair.slope)
    elif channel.unit == pair.second.unit:
        gone = np.abs(np.ptp(pair.second.values[begin:end])) / max(abs(pair.slope), 1e-300)
    else:
        return False
    if gone < max(FROZEN.gone * channel.span, _COUNTS * _count(channel)) or end + FROZEN.after >= len(channel.values):
        return False
    step, after = abs(channel.steps[end - 1]), float(np.abs(channel.steps[end + 1 : end + FROZEN.after]).max())
    return _jumps_at_end(channel, end) or bool(step > FROZEN.leap * after + FROZEN.noise * channel.roughness)


def _is_stepped(pair: Pair, end: int) -> bool:
    """Return whether a command, the second of a pair, goes by a step to another value, sample ``end``, while the motion still does what it
    said before: a spindle's speed is commanded so. Of one that was frozen the motion is there already."""
    command = pair.second
    if not command.driven or end >= len(command.values):
        return False
    motion = pair.slope * (pair.expected[max(end - _BEFORE, 0)] - pair.expected.mean()) + command.values.mean()
    return bool(abs(motion - command.values[end - 1]) < abs(motion - command.values[end]))


def _count(channel: RecordedChannel) -> float:
    """Return the smallest step a channel makes: while its partner goes no further, it may well stand."""
    moving = np.abs(channel.steps[channel.steps != 0.0])
    return float(moving.min()) if len(moving) else 0.0


def _moves(channel: RecordedChannel, begin: int, end: int) -> bool:
    inside = channel.values[begin:end]
    return not channel.constant and float(np.ptp(inside)) > MOTION.moves * channel.span + MOTION.moves_noise * channel.roughness


def _stops_on_its_way(channel: RecordedChannel, begin: int) -> bool:
    """Return whether a channel changes up to the begin of a run and enters it without a jump; a cut that ends leaves its force by one."""
    before = channel.steps[max(begin - FROZEN.after, 0) : begin]
    moving = len(before) == FROZEN.after and float(np.mean(before == 0.0)) < FROZEN.resting
    last = before[-3:]
    return moving and float(np.abs(last).max()) <= channel.usual_step


def _jumps_at_end(channel: RecordedChannel, end: int) -> bool:
    """Return whether the channel leaves the run by a step that it makes nowhere else in motion."""
    if end >= len(channel.values):
        return False
    step = abs(channel.values[end] - channel.values[end - 1])
    return bool(step > FROZEN.jump * channel.usual_step and step > FROZEN.noise * channel.roughness)


def _alive(channel: RecordedChannel, begin: int, end: int) -> bool:
    """Return whether a channel changes from sample to sample all through a stretch."""
    return float(np.mean(channel.steps[begin : end - 1] == 0.0)) < FROZEN.alive


def _noise_is_gone(channel: RecordedChannel, begin: int, end: int) -> bool:
    """Return whether a channel whose samples are hardly ever equal repeats one value all through a long run; a place may well rest."""
    if channel.unit in ("m", "rad"):
        return False
    around = np.concatenate([channel.steps[max(begin - 200, 0) : begin], channel.steps[end - 1 : end + 199]])
    turns = float(np.mean(around[1:] * around[:-1] < 0.0)) if len(around) > FROZEN.least_noise else 0.0
    return turns > FROZEN.alive and float(np.mean(around == 0.0)) < FROZEN.alive and end - begin >= 2 * _LONG


def clipped_channels(found_pairs: list[Pair], period: float) -> list[Finding]:
    """Find measured motion with flat tops at one level beyond which its partner goes on."""
    findings: list[Finding] = []
    for pair in found_pairs:
        channel = pair.second
        if channel.driven or channel.unit not in MOTION_UNITS or pair.correlation < MOTION.loosely or channel.unit != pair.first.unit:
            continue
        if any(finding.channel == channel.name for finding in findings):
            continue
        inner = (channel.values > channel.values.min()) & (channel.values < channel.values.max())
        if np.count_nonzero(inner) < CLIPPED.inner:
            continue
        slope, constant = np.polyfit(pair.expected[inner], channel.values[inner], 1)
        beyond = slope * pair.expected + constant
        spread = float(np.quantile(np.abs(channel.values[inner] - beyond[inner]), 0.99))
        for level, sign in ((channel.values.max(), 1.0), (channel.values.min(), -1.0)):
            flat = channel.values == level
            over = sign * (beyond - level)
            if (
                np.count_nonzero(flat) >= _LONG
                and np.median(over[flat]) > max(CLIPPED.beyond * channel.span, CLIPPED.spread * spread)
                and _longest(flat) >= _LONG
            ):
                begin, end = (int(edge[np.argmax(stretches(flat)[1] - stretches(flat)[0])]) for edge in stretches(flat))
                side = "above" if sign > 0.0 else "below"
                fact = (
                    f"it is clipped {side} {level:.6g} {channel.unit}: {np.count_nonzero(flat)} samples stand there, the longest run from "
                    f"{begin * period:.6g} to {(end - 1) * period:.6g} s, while {pair.first.name} goes on"
                )
                findings.append(Finding("clipped", channel.name, fact, "widen the range of the instrument and record again", True))
                break
    return findings


def clipped_readings(channels: list[RecordedChannel]) -> list[Finding]:
    """Find currents and forces whose noise ends at one level: a drive at its limit is read with the noise of its sensor, a range that is
    too small is not, and where the reading comes near it the noise is cut off sample by sample. A force that is no controller's may also
    jump right beyond its range, as a cut begins."""
    findings = []
    commanded = {channel.part for channel in channels if channel.driven}
    for channel in (item for item in channels if item.unit in _READ and not item.driven and not item.constant):
        jumps = channel.unit == "N" and channel.part not in commanded
        ends = (float(channel.values.max()), float(channel.values.min()))
        levels = [level for level in ends if level != 0.0 and _cuts_noise(channel, level, jumps=jumps)] or _full_scale(channel, ends)
        if levels:
            stand = int(np.count_nonzero(np.isin(channel.values, levels)))
            where = " and ".join(f"{level:.6g}" for level in levels)
            count = f"{stand} of {len(channel.values)} samples stand there"
            fact = f"it is clipped at {where} {channel.unit}: {count}, without the noise of the rest"
            findings.append(Finding("clipped", channel.name, fact, "widen the range of the instrument and record again", True))
    return findings


def _full_scale(channel: RecordedChannel, ends: tuple[float, float]) -> list[float]:
    """Return both ends of a channel that stands long at each where they are those of a converter in steps: 2^n - 1 and -2^n."""
    count = float(np.diff(np.unique(channel.values)).min(initial=np.inf))
    powers = 2.0 ** np.arange(*_FULL_SCALE)
    if not np.isfinite(count) or not np.any(np.abs(ends[0] / count + 1.0 - powers) < _OFF) or abs(ends[0] + count + ends[1]) > _OFF * count:
        return []
    return list(ends) if all(_longest(channel.values == end) >= _LONG for end in ends) else []


def _longest(flat: npt.NDArray[np.bool_]) -> int:
    begins, ends = stretches(flat)
    return int((ends - begins).max(initial=0))


def _cuts_noise(channel: RecordedChannel, level: float, *, jumps: bool) -> bool:
    """Return whether the noise of a channel ends at a level: where it grazes it, or, if it ``jumps`` there, in one very long run."""
    flat = channel.values == level
    if np.count_nonzero(flat) < _LONG:
        return False
    begins, ends = stretches(flat)
    lengths = ends - begins
    inside = ~(flat[1:] | flat[:-1])
    steps = channel.steps[: len(inside)][inside]
    noisy = len(steps) > 2 * _LONG and np.mean(steps == 0.0) < _REPEATED and np.mean(steps[1:] * steps[:-1] < 0.0) > _TURNING
    grazed = np.count_nonzero(lengths <= _GRAZES) >= _GRAZED
    return bool(noisy and lengths.max() >= _LONG and (grazed or (jumps and lengths.max() >= _STANDING)))


_LATE = 4
"""Samples by which a command may lag the measurement it is made from."""
_LONGEST = 400
"""Samples to either side among which a shift is looked for."""
_SHORT, _HALF = 10.0, 0.5
"""Samples up to which a shift is held against how far apart the two are, and what share of it that must show."""
_ROUNDED = 5.0
"""Largest prediction error that the rounding of a converter causes [steps] (assumed)."""
_CLEAR, _STRONG = 12.0, 0.4
"""A peak of the correlation of noise stands this many times above what chance leaves, and is this high."""


def shifted_channels(channels: list[RecordedChannel], found_pairs: list[Pair], period: float) -> list[Finding]:
    """Return the time offsets between measured channels that show one motion, and between a measured channel and the command made from it.

    They are told with their value and are no fault by themselves: a slow sensor is late too.
    """
    findings = []
    for pair in found_pairs:
        first, second = pair.first, pair.second
        if first.driven or second.driven or pair.correlation < MOTION.alike:
            continue
        late = motion_shift(pair.expected, second.values, first.unit == second.unit)
        if late is not None and abs(late) > 1.0 and _is_as_far_apart(pair, late):
            findings.append(Finding("shift", second.name, f"it comes {_told(late, period)} {first.name}", ""))
        skew = _skew(pair)
        if skew is not None:
            fact = f"its clock runs {1e6 * abs(skew):.0f} ppm {'slower' if skew > 0 else 'faster'} than that of {first.name}"
            findings.append(Finding("skew", second.name, fact, ""))
    for command in channels:
        if command.driven or command.unit != "V":
            continue
        places = [channel for channel in channels if channel.unit in MOTION_UNITS and channel.group == command.group and not channel.driven]
        if _is_rounding(command):
            continue
        shifts = [(height, late, place) for place in places for late, height in [noise_shift(place.values, command.values)]]
        if shifts and (best := max(shifts, key=lambda item: item[0]))[0] > _STRONG and abs(best[1]) >= _LATE:
            fact = f"its noise comes {_told(best[1], period)} that of {best[2].name}, from which it is made"
            done = "no controller knows the noise to come; shift one of the columns" if best[1] < 0 else ""
            findings.append(Finding("shift", command.name, fact, done, best[1] < 0))
    return findings


def _is_rounding(command: RecordedChannel) -> bool:
    """Return whether the prediction errors of a command are within the steps of the converter behind which it was recorded. Such noise is
    the rounding of the converter and comes from no other channel."""
    new, sizes = _whitened(command.values), np.abs(command.steps)
    changes = sizes[sizes > ROUNDING * float(np.abs(command.values).max())]
    if new is None or not len(changes):
        return True
    size = 1.4826 * float(np.median(np.abs(new))) * float(np.abs(np.diff(command.values, 2)).max())
    return size < _ROUNDED * float(changes.min())


def _is_as_far_apart(pair: Pair, late: float) -> bool:
    """Return whether two places differ as a shift by so many samples would make them.

    Rates of two staircases may be alike at any shift, while the places themselves are never a count apart. A place and a speed are as alike
    at any shift in a single slow stroke.
    """
    if pair.first.unit != pair.second.unit:
        return _is_more_alike(pair.expected, pair.second.values, late)
    if abs(late) > _SHORT:
        return True
    speed = rate(pair.expected, 1.0)
    apart = pair.expected - pair.second.values
    apart = apart - apart.mean()
    shown = float(apart @ speed) / max(float(speed @ speed), 1e-300)
    return shown * late > _HALF * late * late


def _is_more_alike(first: FloatArray, second: FloatArray, late: float) -> bool:
    """Return whether two signals (samples,) are more alike at a shift [samples] than at none, by more than chance gives at one of M.

    With h the correlation, (1 - h^2) of the power is left. The gain n/2 log((1 - h_0^2) / (1 - h^2)) counts n independent samples of that,
    n = N (1 - r) / (1 + r) with r the correlation of one sample with the next (Bartlett, J. Royal Statistical Society 98, 1935).
    Among M shifts chance reaches log(M).
    """
    one, other = first - first.mean(), second - second.mean()
    lags, height = _correlation(one, other)
    unshifted, shifted = (float(height[int(np.argmin(np.abs(lags - place)))]) for place in (0.0, late))
    moved = round(late)
    behind, ahead = one[max(0, -moved) : len(one) - max(0, moved)], other[max(0, moved) : len(other) + min(0, moved)]
    left = ahead - float(ahead @ behind) / float(behind @ behind) * behind
    alike = max(0.0, float(left[1:] @ left[:-1]) / max(float(left @ left), 1e-300))
    independent = len(left) * (1.0 - alike) / (1.0 + alike)
    gained = 0.5 * independent * math.log(max(1.0 - unshifted**2, 1e-300) / max(1.0 - shifted**2, 1e-300))
    return gained > math.log(len(lags))


def _told(late: float, period: float) -> str:
    return f"{in_unit(abs(late) * period, 'ms')} ({abs(late):.1f} samples) {'after' if late > 0.0 else 'before'}"


def motion_shift(first: FloatArray, second: FloatArray, same_kind: bool = True) -> float | None:
    """Return by how many samples ``second`` comes after ``first``, from the correlation of their rates; None where they tell nothing."""
    one, other = (rate(first, 1.0), rate(second, 1.0)) if same_kind else (first, second)
    one, other = one - one.mean(), other - other.mean()
    if not (one.any() and other.any()):
        return None
    lags, height = _correlation(one, other)
    near = np.abs(lags) <= _half_period(one)
    lags, height = lags[near], height[near]
    peak = int(np.argmax(height))
    if peak in (0, len(height) - 1):
        return None
    bend = height[peak - 1] - 2.0 * height[peak] + height[peak + 1]
    return float(lags[peak] + (0.5 * (height[peak - 1] - height[peak + 1]) / bend if bend < 0.0 else 0.0))


def _half_period(values: FloatArray) -> int:
    """Return half the period of a motion in samples, at most the longest shift: where its autocorrelation has its first negative minimum.

    A period later a motion that repeats is like itself again: a shift beyond half of one cannot be told from a shorter one.
    """
    from scipy.signal import fftconvolve

    longest = min(_LONGEST, len(values) // 4)
    alike = fftconvolve(values, values[::-1], mode="full")[len(values) - 1 : len(values) + longest + 1]
    turns = np.flatnonzero((alike[1:-1] < 0.0) & (alike[1:-1] <= alike[:-2]) & (alike[1:-1] < alike[2:])) + 1
    return int(turns[0]) if len(turns) else longest


def noise_shift(first: FloatArray, second: FloatArray) -> tuple[int, float]:
    """Return by how many samples the noise of ``first`` appears later in ``second``, and the correlation there; 0 where it does not."""
    one, other = _whitened(first), _whitened(second)
    if one is None or other is None:
        return 0, 0.0
    lags, height = _correlation(one, other)
    height = np.abs(height)
    peak = int(np.argmax(height))
    chance = 1.4826 * float(np.median(height)) + 1e-300
    return (int(lags[peak]), float(height[peak])) if height[peak] > _CLEAR * chance else (0, 0.0)


def _whitened(values: FloatArray, order: int = 8) -> FloatArray | None:
    """Return what is new in every sample: the error of a linear prediction from the samples before, large ones cut."""
    second = np.diff(values, 2)
    if not second.any():
        return None
    second = second / np.abs(second).max()
    rows = np.column_stack([second[order - lag : len(second) - lag] for lag in range(1, order + 1)])
    target = second[order:]
    if not rows.any():
        return None
    normal = rows.T @ rows + 1e-9 * np.eye(order) * float(np.mean(np.square(rows)) * len(rows))
    new: FloatArray = target - rows @ np.linalg.solve(normal, rows.T @ target)
    limit = 4.0 * 1.4826 * float(np.median(np.abs(new)))
    return np.clip(new, -limit, limit) if limit > 0.0 else None


def _correlation(one: FloatArray, other: FloatArray) -> tuple[npt.NDArray[np.int64], FloatArray]:
    """Return lags and the correlation of the middle of ``one`` with the piece of ``other`` that comes as much later."""
    from scipy.signal import fftconvolve

    longest = min(_LONGEST, len(one) // 4)
    middle = one[longest : len(one) - longest]
    overlap = fftconvolve(other, middle[::-1], mode="valid")
    energy = np.cumsum(np.concatenate([[0.0], np.square(other)]))
    beneath = energy[len(middle) :] - energy[: len(energy) - len(middle)]
    return np.arange(-longest, longest + 1), overlap / np.sqrt(beneath * float(np.square(middle).sum()) + 1e-300)


def _skew(pair: Pair, pieces: int = 6) -> float | None:
    """Return the clock skew of the second channel against the first, where the shift grows along the recording without doubt."""
    edges = np.linspace(0, len(pair.expected), pieces + 1).astype(int)
    shifts, middles = [], []
    for begin, end in itertools.pairwise(edges):
        piece = motion_shift(pair.expected[begin:end], pair.second.values[begin:end], pair.first.unit == pair.second.unit)
        if piece is not None and abs(piece) < _LONGEST / 2:
            shifts.append(piece)
            middles.append(0.5 * (begin + end))
    if len(shifts) < pieces - 1:
        return None
    slope, constant = np.polyfit(middles, shifts, 1)
    left = float(np.std(np.asarray(shifts) - (slope * np.asarray(middles) + constant)))
    grown = abs(slope) * len(pair.expected)
    return float(slope) if grown > 1.0 and grown > CLOCK.skew * left else None
