"""The lines of a vibration signal: what stands out of its noise, how wide it is, which order of the spindle, how it grows.

Source: P. D. Welch, IEEE Trans. Audio Electroacoust. 15 (1967); R. B. Randall, Vibration-based Condition Monitoring (2011), orders and
envelopes.

What a signal could not foretell of itself: the mark that tells segments of a chip from a mode that noise shakes.

A linear system that Gaussian noise drives has Gaussian prediction errors, however narrow its band. A chip that breaks lets the force fall
at once, and each fall is a prediction error that stands out, all to one side; a resonance between tool and sensor does not hide it.
Source: R. B. Randall, Vibration-based Condition Monitoring (2011), linear prediction and kurtosis; L. H. Koopmans, The Spectral Analysis of
Time Series (1995), prediction.

The speed of the spindle, found better than it was told, from what repeats with it.

What repeats every turn stays in the mean of all turns, and only at the right speed. Only low orders are asked: near a high one any
vibration is a whole multiple of some speed close by. Source: P. D. McFadden, Mech. Syst. Signal Process. 1 (1987), averaging in step.

What a vibration keeps from turn to turn: the mark that tells chatter from noise.

Chatter repeats itself: after a turn it is a complex multiple of what it was, so its band is coherent over turns, and its amplitude is
steady once it has set in. A mode that the noise of the cut shakes is narrow-band Gaussian noise: it forgets, and its envelope follows
Rayleigh's distribution, whose standard deviation is sqrt(4/pi - 1) = 0.52 of its mean. Chips that break in segments have a steady
amplitude but a phase that walks. Source: S. O. Rice, Bell Syst. Tech. J. 23 (1944); T. Insperger, G. Stepan,
Semi-Discretization for Time-Delay Systems (2011), multipliers of a turn.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.ndimage import median_filter

from lathesim.errors import RecordingError
from lathesim.record import FloatArray
from lathesim.stability.stability_thresholds import LINES, ORDERS, REPEATS, SHORT

_TURNS = 2.0
"""Distance in turns over which the memory of a band is judged: whole and half orders both come back to themselves in two."""
_BANDS = (0.06, 0.2)
"""Half widths of a band over its frequency, assumed: wider than a mode, so that the band does not make a memory of its own; and as wide as
segments that scatter by 15 %. Noise varies as much in both, so the steadier one counts."""
_BAND_TURNS = 0.3
_OF_NOISE = math.sqrt(4.0 / math.pi - 1.0)


@dataclass(frozen=True)
class TurnMemory:
    """Of the later half of a vibration's band: ``kept``, the coherence with itself two turns before, from 0 to 1; ``variation``, the
    standard deviation of its envelope over the mean; and ``independent``, how many values of the envelope are independent of each other."""

    kept: float
    variation: float
    independent: float = 1.0

    @property
    def is_steady(self) -> bool:
        """Whether the amplitude varies less than that of noise would, which varies by 0.52 give or take 0.52/sqrt(2 independent)."""
        return self.variation < _OF_NOISE - REPEATS.errors * _OF_NOISE / math.sqrt(2.0 * max(self.independent, 1.0))


def turn_memory(values: FloatArray, rate: float, turning: float, frequency: float, *, orders: bool = False) -> TurnMemory:
    """Return the memory of the band around a frequency [Hz]; whole orders of the spindle in it are taken off unless ``orders`` asks."""
    kept, variation, independent = 0.0, math.inf, 1.0
    rest = values if orders else without_orders(values, rate, turning)
    for place, share in enumerate(_BANDS[:1] if orders else _BANDS):
        band = _later(_analytic(rest, rate, frequency, max(_BAND_TURNS * turning, share * frequency)), rate / turning)
        if place == 0:
            kept = _coherence(band, round(_TURNS * rate / turning))
        envelope = np.abs(band)
        mean = float(envelope.mean()) if len(envelope) else 0.0
        varies = float(envelope.std()) / mean if mean > 0.0 else math.inf
        if varies < variation:
            variation, independent = varies, independent_values(band)
    return TurnMemory(kept, variation, independent)


def independent_values(band: Any) -> float:
    """Return how many values of a complex band are independent: its length over the sum of the squares of its autocorrelation.

    Source: J. S. Bendat, A. G. Piersol, Random Data (2010), section 8.2.
    """
    if len(band) < 2:
        return 1.0
    spectrum = np.abs(np.fft.fft(band)) ** 2
    total = float((spectrum**2).sum())
    return max(1.0, float(spectrum.sum() ** 2) / total) if total > 0.0 else 1.0


def _later(band: Any, turn: float) -> Any:
    """Return the later half of a band less half a turn at its end; all of a short one."""
    edge = int(0.5 * turn)
    later = band[len(band) // 2 : len(band) - edge]
    return later if len(later) > 2 * _TURNS * turn else band[edge : len(band) - edge]


def _coherence(band: Any, lag: int) -> float:
    """Return how alike a band is to itself ``lag`` samples before, from 0 to 1."""
    if len(band) <= lag + SHORT.beyond:
        return 0.0
    now, before = band[lag:], band[:-lag]
    size = math.sqrt(float(np.vdot(now, now).real) * float(np.vdot(before, before).real))
    return float(abs(np.vdot(before, now)) / size) if size > 0.0 else 0.0


def turn_shares(values: FloatArray, rate: float, turning: float) -> tuple[float, float]:
    """Return the shares of the power that repeat every turn, and that repeat every turn with the sign changed: whole and half orders.

    They are the power of the mean turn, and of the mean with alternating signs, less what noise leaves in means of so many turns.
    """
    rows = _turns(values, rate / turning)
    total = float(rows.var())
    if len(rows) < SHORT.turns or not total > 0.0:
        return 0.0, 0.0
    signs = np.where(np.arange(len(rows)) % 2 == 0, 1.0, -1.0)[:, None]
    shares = []
    for turned in (rows, signs * rows):
        mean = turned.mean(axis=0)
        left = float(((turned - mean) ** 2).mean()) / (len(rows) - 1)
        shares.append(max(0.0, float((mean**2).mean()) - left) / total)
    return shares[0], shares[1]


def _turns(values: FloatArray, turn: float) -> FloatArray:
    """Return whole turns of a signal, (turns, samples of a turn), straight between samples."""
    count, samples = int((len(values) - 1) / turn), int(turn)
    places = (np.arange(count)[:, None] + np.arange(samples)[None, :] / samples) * turn
    return np.interp(places.ravel(), np.arange(len(values)), values).reshape(count, samples)


def without_orders(values: FloatArray, rate: float, turning: float) -> FloatArray:
    """Return a signal less its mean turn."""
    turn = rate / turning
    mean = _turns(values, turn).mean(axis=0)
    place = np.mod(np.arange(len(values)), turn) / turn * len(mean)
    return np.asarray(values - np.interp(place, np.arange(len(mean) + 1), np.append(mean, mean[0])))


def _analytic(values: FloatArray, rate: float, frequency: float, half_band: float) -> Any:
    spectrum = np.fft.fft(values)
    place = np.fft.fftfreq(len(values), 1.0 / rate)
    return 2.0 * np.fft.ifft(spectrum * np.exp(-0.5 * ((place - frequency) / half_band) ** 2))


_ORDER = 60
"""Values before that foretell the next, assumed: enough for a dozen modes and the filter of a sensor."""
_PARTS = 8
"""Parts of a signal, whose median counts, so that one event is not taken for many."""
_FEWEST = 400


def prediction_errors(values: FloatArray) -> FloatArray:
    """Return what each value differs by from its best linear prediction by ``_ORDER`` values before, over the standard deviation."""
    from scipy.linalg import solve_toeplitz
    from scipy.signal import lfilter

    centred = values - values.mean()
    alike = np.fft.irfft(np.abs(np.fft.rfft(centred, 2 * len(centred))) ** 2)[: _ORDER + 1] / len(centred)
    if not alike[0] > 0.0:
        return np.zeros(0)
    alike[0] *= 1.0 + 1e-9
    errors = lfilter(np.concatenate([[1.0], -solve_toeplitz(alike[:_ORDER], alike[1:])]), [1.0], centred)[_ORDER:]
    return np.asarray(errors / max(float(errors.std()), 1e-300))


def departure_from_gaussian(values: FloatArray) -> float:
    """Return by how many standard errors skewness or kurtosis of the prediction errors are away from those of Gaussian noise.

    The standard errors are sqrt(6/n) and sqrt(24/n), and that of the median of parts is larger by sqrt(pi/2).
    """
    errors = prediction_errors(values)
    if len(errors) < _PARTS * _FEWEST:
        return 0.0
    moments = []
    for part in np.array_split(errors, _PARTS):
        z = (part - part.mean()) / max(float(part.std()), 1e-300)
        moments.append((float((z**3).mean()) / math.sqrt(6.0), (float((z**4).mean()) - 3.0) / math.sqrt(24.0)))
    skew, tails = np.abs(np.median(np.array(moments), axis=0)).tolist()
    return float(max(skew, tails)) * math.sqrt(len(errors) / (0.5 * math.pi))


_ORDERS = 6.0
_PER_TURN = 24
"""Values of a turn after the low pass, for so many orders."""


def refined_speed(values: FloatArray, rate: float, turning: float) -> float:
    """Return the revolutions a second near ``turning`` at which most power repeats with every turn or two; else the given ones."""
    low, slow = _low_orders(values, rate, turning)
    turns = len(low) * turning / slow
    if turns < SHORT.turns:
        return turning
    # at the highest order the ends of the record are out of step by a quarter of a vibration between two trials
    step = 0.25 / (_ORDERS * turns)
    count = max(1, math.ceil(ORDERS.speed_reach / step))
    trials = turning * (1.0 + ORDERS.speed_reach * np.arange(-count, count + 1) / count)
    shares = [min(sum(turn_shares(low, slow, float(trial))), 1.0 - 1e-9) for trial in trials]
    best = int(np.argmax(shares))
    gained = 0.5 * turns * math.log((1.0 - shares[count]) / (1.0 - shares[best]))
    return float(trials[best]) if gained > ORDERS.speed_sure else turning


def _low_orders(values: FloatArray, rate: float, turning: float) -> tuple[FloatArray, float]:
    """Return a signal of low orders alone, and its sample rate."""
    slow = _PER_TURN * turning
    if slow >= rate:
        return values, rate
    spectrum = np.fft.rfft(values)
    spectrum[np.fft.rfftfreq(len(values), 1.0 / rate) > (_ORDERS + 0.5) * turning] = 0.0
    low = np.fft.irfft(spectrum, len(values))
    return np.interp(np.arange(int(len(values) * slow / rate)) * rate / slow, np.arange(len(values)), low), slow


_BINS_OF_AN_OCTAVE, _FEWEST_OF_A_BIN = 12, 4
"""Bins of an octave in which humps are looked for, as in sound analysis, and lines of the spectrum in each at least."""
_TURNS_OF_A_WINDOW = 24
_MOST_LINES = 24


@dataclass(frozen=True)
class VibrationLine:
    """A line: frequency [Hz], order of the spindle, share of the power of the vibration, width [Hz] over the narrowest possible, and the
    growth of its envelope: ``rate`` [1/s] while it grows, ``late`` amplitude over ``early`` one."""

    frequency: float
    order: float
    share: float
    width: float
    rate: float
    late: float
    resolution: float

    @property
    def is_wide(self) -> bool:
        """Whether the line is wider than a steady vibration would be."""
        share = self.width * self.resolution / max(self.frequency, 1e-9)
        return self.width > 1.0 and share > LINES.wide


@dataclass(frozen=True, eq=False)
class Vibration:
    """A signal in the cut: values without trend, sample rate [Hz], speed [rev/s], its lines, the share of its power in noise, its
    standard deviation over its mean, 0 where it has none, and by how many standard errors it is no Gaussian noise beside its orders."""

    values: FloatArray
    rate: float
    turning: float
    lines: tuple[VibrationLine, ...]
    resolution: float
    modulation: float = 0.0
    departure: float = 0.0


def vibration(values: FloatArray, rate: float, turning: float, fewest: float = ORDERS.fewest_turns) -> Vibration:
    """Return the lines of a signal of ``rate`` [Hz] at ``turning`` turns a second; :class:`RecordingError` where it is too short."""
    if not turning > 0.0:
        raise RecordingError(f"the speed is {60.0 * turning:g} rpm.", remedy="Give the speed of the spindle with --speed.")
    if len(values) * turning / rate < fewest:
        raise RecordingError(f"the recording holds {len(values) * turning / rate:.1f} turns.", remedy=f"Record at least {fewest:.0f}.")
    if rate < LINES.samples * turning:
        raise RecordingError(f"{rate:g} samples a second are too few at {turning:g} revolutions a second.", remedy="Sample faster.")
    clean = _without_trend(np.asarray(values, dtype=np.float64), rate, turning)
    if not np.any(clean):
        raise RecordingError("the signal does not move.", remedy="Choose another channel with --channel.")
    frequency, power, resolution = _spectrum(clean, rate, turning)
    floor = _floor(power)
    turning = refined_speed(clean, rate, turning)
    lowest = ORDERS.lowest_order * turning
    total = float(power[frequency >= lowest].sum())
    found: list[tuple[float, float, float]] = []
    used = np.zeros(len(power), dtype=bool)
    for place in np.argsort(-power / floor):
        if len(found) == _MOST_LINES or power[place] < LINES.out_of_noise * floor[place]:
            break
        if used[place] or frequency[place] < lowest:
            continue
        low, high = _extent(power, int(place), float(floor[place]))
        peak = int(place)
        share = float(np.maximum(power[low : high + 1] - floor[low : high + 1], 0.0)[~used[low : high + 1]].sum()) / total
        used[max(0, low - 1) : high + 2] = True
        if share > LINES.least_share:
            found.append((_centre(frequency, power, peak), share, _half_width(power, peak) * resolution))
    found += _bands(frequency, power, floor, used, lowest, resolution, total)
    found.sort(key=lambda item: -item[1])
    lines = tuple(_line(clean, rate, turning, resolution, *item) for item in found)
    mean = abs(float(np.mean(values)))
    swing = float(clean.std())
    # a signal without a mean, as of an accelerometer, tells nothing of contact
    modulation = swing / mean if mean > LINES.mean_counts * swing else 0.0
    return Vibration(clean, rate, turning, lines, resolution, modulation, departure_from_gaussian(without_orders(clean, rate, turning)))


def _bands(
    frequency: FloatArray, power: FloatArray, floor: FloatArray, used: Any, lowest: float, resolution: float, total: float
) -> list[tuple[float, float, float]]:
    """Return broad humps that no narrow line is part of, as lines: frequency, share of the power, width over the narrowest."""
    free = np.where(used, floor, power)
    last = int(math.log2(frequency[-1] / max(lowest, resolution)) * _BINS_OF_AN_OCTAVE)
    if last < 2:
        return []
    edges = np.searchsorted(frequency, max(lowest, resolution) * 2.0 ** (np.arange(last + 1) / _BINS_OF_AN_OCTAVE))
    # bins of equal relative width: a hump of some per cent of its frequency fills as many of them wherever it lies
    bins = [(low, high) for low, high in itertools.pairwise(edges.tolist()) if high - low >= _FEWEST_OF_A_BIN]
    if len(bins) < SHORT.bins:
        return []
    level = np.array([float(free[low:high].mean()) for low, high in bins])
    around = median_filter(level, size=min(2 * _BINS_OF_AN_OCTAVE + 1, len(level)) | 1, mode="nearest")
    place = int(np.argmax(level / around))
    if level[place] < LINES.hump_out_of_noise * around[place]:
        return []
    low = high = place
    while low > 0 and level[low - 1] > LINES.hump_edge * level[place]:
        low -= 1
    while high < len(level) - 1 and level[high + 1] > LINES.hump_edge * level[place]:
        high += 1
    lines = slice(bins[low][0], bins[high][1])
    share = float(np.maximum(free[lines] - around[place], 0.0).sum()) / total
    middle = float((frequency[lines] * free[lines]).sum() / free[lines].sum())
    is_noise = (lines.stop - lines.start) * resolution > LINES.widest_hump * middle
    return [(middle, share, max(2.0, float(lines.stop - lines.start)))] if share > LINES.least_share and not is_noise else []


def within_band(found: Vibration, low: float, high: float) -> Vibration:
    """Return a vibration with one line, that of a band [Hz]: its middle, share, and width between the halves of its power."""
    frequency, power, resolution = _spectrum(found.values, found.rate, found.turning)
    inside = (frequency >= low) & (frequency <= high)
    if np.count_nonzero(inside) < SHORT.band:
        raise RecordingError(f"the band from {low:g} to {high:g} Hz holds fewer than four lines.", remedy="Make it wider.")
    around = ((frequency >= LINES.below * low) & (frequency < low)) | ((frequency > high) & (frequency <= LINES.above * high))
    floor = float(np.median(power[around])) if around.any() else 0.0
    over = np.maximum(power[inside] - floor, 0.0)
    total = float(power[frequency >= ORDERS.lowest_order * found.turning].sum())
    if not over.sum() > 0.0:
        return replace(found, lines=())
    middle = float((frequency[inside] * over).sum() / over.sum())
    half = int(np.searchsorted(np.cumsum(np.sort(over)[::-1]), 0.5 * over.sum())) + 1
    width = max(0.0, float(half - 3))
    return replace(found, lines=(_line(found.values, found.rate, found.turning, resolution, middle, float(over.sum()) / total, width),))


def _without_trend(values: FloatArray, rate: float, turning: float) -> FloatArray:
    """Return a signal less what changes over more than three turns."""
    width = int(3.0 * rate / turning) | 1
    if width >= len(values):
        return np.asarray(values - values.mean(), dtype=np.float64)
    smooth = np.cumsum(np.concatenate([[0.0], np.pad(values, width // 2, mode="reflect")]))
    mean = (smooth[width:] - smooth[:-width]) / width
    again = np.cumsum(np.concatenate([[0.0], np.pad(mean, width // 2, mode="reflect")]))
    return np.asarray(values - (again[width:] - again[:-width]) / width, dtype=np.float64)


def _spectrum(values: FloatArray, rate: float, turning: float) -> tuple[FloatArray, FloatArray, float]:
    from scipy.signal import welch

    length = min(len(values), max(int(_TURNS_OF_A_WINDOW * rate / turning), 256))
    frequency, power = welch(values, rate, "hann", nperseg=length, noverlap=length // 2, detrend="constant", scaling="density")
    return np.asarray(frequency), np.asarray(power * (rate / length)), rate / length


def _floor(power: FloatArray) -> FloatArray:
    """Return the noise around each line, by the running median, over no less than a millionth of the largest line."""
    around = max(31, len(power) // 24) | 1
    return np.asarray(np.maximum(median_filter(power, size=min(around, len(power)), mode="nearest") * 1.4, 1e-9 * power.max()))


def _extent(power: FloatArray, place: int, floor: float) -> tuple[int, int]:
    level = max(2.5 * floor, 0.02 * power[place])
    low = high = place
    while low > 0 and power[low - 1] > level and place - low < LINES.reach:
        low -= 1
    while high < len(power) - 1 and power[high + 1] > level and high - place < LINES.reach:
        high += 1
    return low, high


def _half_width(power: FloatArray, place: int) -> float:
    """Return the width of a line at a quarter of its power, over that of a steady vibration (2.9 lines of a Hann window)."""
    low, high = _extent(power, place, 0.1 * power[place])
    return max(0.0, (high - low + 1 - 4.0))


def _centre(frequency: FloatArray, power: FloatArray, place: int) -> float:
    if not 0 < place < len(power) - 1:
        return float(frequency[place])
    a, b, c = (math.log(max(float(power[place + step]), 1e-300)) for step in (-1, 0, 1))
    curve = a - 2.0 * b + c
    shift = 0.5 * (a - c) / curve if curve < 0.0 else 0.0
    return float(frequency[place] + min(max(shift, -0.5), 0.5) * (frequency[1] - frequency[0]))


def _line(
    values: FloatArray, rate: float, turning: float, resolution: float, frequency: float, share: float, width: float
) -> VibrationLine:
    growth, late = _growth(envelope_of(values, rate, frequency, max(0.45 * turning, 3.0 * resolution)), rate, frequency, turning)
    return VibrationLine(frequency, frequency / turning, share, width, growth, late, resolution)


def envelope_of(values: FloatArray, rate: float, frequency: float, half_band: float) -> FloatArray:
    """Return the amplitude of the vibration within a band around a frequency [Hz], (samples,)."""
    return np.asarray(np.abs(_analytic(values, rate, frequency, 0.5 * half_band)))


def _growth(envelope: FloatArray, rate: float, frequency: float, turning: float) -> tuple[float, float]:
    """Return the steepest lasting rate of growth [1/s], negative for a decay, and the amplitude at the end over that at the beginning."""
    edge = min(len(envelope) // 12, int(0.5 * rate / turning))
    inner = envelope[edge : len(envelope) - edge]
    part = max(1, len(inner) // 20)
    steps = np.array([np.sqrt(np.mean(inner[at * part : (at + 1) * part] ** 2)) for at in range(len(inner) // part)])
    logs = np.log(np.maximum(steps, 1e-12 * max(float(steps.max()), 1e-300)))
    time = np.arange(len(logs)) * part / rate
    span = max(3, len(logs) // 4)
    slopes = [float(np.polyfit(time[at : at + span], logs[at : at + span], 1)[0]) for at in range(len(logs) - span + 1)]
    return max(slopes, key=abs) if slopes else 0.0, float(np.exp(np.mean(logs[-3:]) - np.mean(logs[:2])))
