"""The shape of a signal in words: pulses, steps or a sine, or none of them.

    piecewise constant   s_k = c_j            between two jumps
    sine                 s_k = a sin(2 pi f t_k) + b cos(2 pi f t_k) + c

The kind that explains more of the power is taken, where it explains nearly all. Source: Bendat, Piersol, Random Data, 4th ed. 2010,
section 11.5 (least squares at the largest line of a periodogram).
"""

from __future__ import annotations

import itertools

import numpy as np
import numpy.typing as npt
from scipy.fft import rfft, rfftfreq
from scipy.optimize import minimize_scalar

from lathesim.analysis.display_unit import shown_with_unit
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.method.recording_checks import CheckLimits
from lathesim.diagnosis.records.added_signal import Shape
from lathesim.engine.assembly import FloatArray


def shape_of(values: FloatArray, period: float, unit: str, method: Method = STANDARD) -> Shape:
    """Return the shape of a signal (samples,): of a command, which is arithmetic, as little may stay unexplained as with any other fault
    mended."""
    limits = method.recording_checks
    largest = float(np.max(np.abs(values), initial=0.0))
    on = np.abs(values) > limits.little_off * largest
    if largest == 0.0 or not on.any():
        return Shape("", (), 0.0)
    first, last = int(np.argmax(on)), len(on) - int(np.argmax(on[::-1]))
    whole = ((first * period, last * period),)
    steps, sine = _steps(values, period, unit, limits), _sine(values[first:last], period, unit, limits)
    best = max((steps, Shape(sine.words, whole, sine.share, repeats=True)), key=lambda shape: shape.share)
    return best if best.share > 1.0 - limits.follows**2 else Shape("", whole, 0.0)


def _steps(values: FloatArray, period: float, unit: str, limits: CheckLimits) -> Shape:
    """Return the shape of a signal as levels between jumps; a share of 0 where there are nearly as many jumps as samples."""
    edges = np.flatnonzero(np.abs(np.diff(values)) > limits.signal_jump * float(np.ptp(values))) + 1
    bounds = [0, *edges.tolist(), len(values)]
    if not len(edges) or len(bounds) > len(values) / limits.signal_samples:
        return Shape("", (), 0.0)
    pairs = list(itertools.pairwise(bounds))
    levels = np.array([float(np.median(values[begin:end])) for begin, end in pairs])
    left = np.concatenate([values[begin:end] - level for (begin, end), level in zip(pairs, levels, strict=True)])
    on = np.abs(levels) > limits.little_off * float(np.max(np.abs(levels)))
    stretches = tuple((begin * period, end * period) for (begin, end), is_on in zip(pairs, on, strict=True) if is_on)
    return Shape(_levels_in_words(pairs, levels, on, period, unit, limits), stretches, _explained(values, left))


def _levels_in_words(
    pairs: list[tuple[int, int]], levels: FloatArray, on: npt.NDArray[np.bool_], period: float, unit: str, limits: CheckLimits
) -> str:
    sizes, lengths = levels[on], np.array([end - begin for begin, end in pairs])[on] * period
    size = _span(np.unique(np.round(sizes, 12)), unit, limits)
    returns = bool(np.all(on[:-1] ^ on[1:])) and not on[-1]
    if returns:
        many = "a pulse" if len(sizes) == 1 else f"{len(sizes)} pulses"
        return f"{many} of {size}, {_span(lengths, 's', limits)} long"
    return f"a step of {size}" if len(sizes) == 1 else f"{len(sizes)} steps of {size}"


def _span(values: FloatArray, unit: str, limits: CheckLimits) -> str:
    low, high = float(np.min(values)), float(np.max(values))
    if high - low <= limits.little_off * max(abs(low), abs(high)):
        return shown_with_unit(float(np.median(values)), unit, 3)
    return f"{shown_with_unit(low, unit, 3)} to {shown_with_unit(high, unit, 3)}"


def _sine(values: FloatArray, period: float, unit: str, limits: CheckLimits) -> Shape:
    """Return a signal as one sine about a constant."""
    if len(values) < 2 * limits.signal_samples:
        return Shape("", (), 0.0)
    time = np.asarray(np.arange(len(values)) * period, dtype=np.float64)
    resolution = 1.0 / (len(values) * period)
    power = np.abs(rfft(values - values.mean(), n=4 * len(values))) ** 2
    lines = rfftfreq(4 * len(values), period)
    start = float(lines[int(np.argmax(power))])
    found = minimize_scalar(
        lambda f: float(np.sum(_beside_sine(values, time, f)[0] ** 2)),
        bounds=(max(start - resolution, 0.25 * resolution), start + resolution), method="bounded", options={"xatol": 1e-6 * resolution},
    )  # fmt: skip
    left, amplitude = _beside_sine(values, time, float(found.x))
    if found.x * period * limits.signal_samples > 1.0 or found.x < resolution:
        return Shape("", (), 0.0)
    return Shape(f"a sine of {shown_with_unit(amplitude, unit, 3)} at {found.x:.4g} Hz", (), _explained(values - values.mean(), left))


def _beside_sine(values: FloatArray, time: FloatArray, frequency: float) -> tuple[FloatArray, float]:
    """Return what the best sine of a frequency leaves (samples,), and its amplitude."""
    angle = 2.0 * np.pi * frequency * time
    columns = np.column_stack([np.sin(angle), np.cos(angle), np.ones_like(angle)])
    found = np.linalg.lstsq(columns, values, rcond=None)[0]
    return values - columns @ found, float(np.hypot(found[0], found[1]))


def _explained(values: FloatArray, left: FloatArray) -> float:
    return 1.0 - float(np.sum(left**2)) / max(float(np.sum(values**2)), 1e-300)
