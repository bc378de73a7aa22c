"""Lines of a residual: what repeats in time, and what repeats along the way or with the angle of a part.

Against a variable q the residual e is transformed where it was taken, without resampling, each sample weighed by the way it stands for:

    A(k) = 2 abs(sum_i w_i e_i exp(-2 pi j k q_i)) / sum_i w_i,   w_i = abs(dq_i) taper(q_i);   against time w_i = taper(t_i)

A line that is sharp in time stays in Hz whatever the speed: a structure that swings. One that is sharp along the way of an axis or in the
angle of a spindle is an order: the screw, the motor, the encoder, the chuck. Which it is, is decided by where it holds the larger share
of the residual. Source: Randall, Vibration-based Condition Monitoring (2011), section 3.6 (order tracking); the transform where the samples
lie: Lomb, Astrophysics and Space Science 39 (1976), for one line at a time.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.fft import rfft
from scipy.ndimage import median_filter

from lathesim.diagnosis.method import STANDARD, Method
from lathesim.engine.assembly import FloatArray

_GRID = 1 << 15
"""Cells along the variable."""
_PADDING = 2
_SPREAD = 101
"""Neighbours whose median is the surroundings of an amplitude."""


@dataclass(frozen=True)
class Line:
    """A line: ``frequency`` in cycles for each ``unit`` of ``variable`` (``time``, ``position of x_axis``), its amplitude and share.

    ``amplitude`` is in the unit of the residual, ``share`` of the residual's mean square; ``unit`` is the SI unit of the variable.
    """

    variable: str
    unit: str
    frequency: float
    amplitude: float
    share: float

    @property
    def period(self) -> float:
        """Length of one repetition [``unit``]."""
        return 1.0 / self.frequency


@dataclass(frozen=True)
class Spectrum:
    """Amplitudes over frequencies [1 / ``unit``] against a variable."""

    variable: str
    unit: str
    frequency: FloatArray
    amplitude: FloatArray


def spectrum_against(residual: FloatArray, variable: str, unit: str, values: FloatArray, method: Method = STANDARD) -> Spectrum | None:
    """Return the spectrum of a residual (samples,) against ``values`` (samples,) of a variable; none where it does not move."""
    low, high = float(np.min(values)), float(np.max(values))
    if not high > low:
        return None
    in_time = variable == "time"
    step = np.abs(np.gradient(values))
    weight = np.ones_like(values) if in_time else np.where(step > method.location.commanded_standstill * step.max(), step, 0.0)
    weight = weight * np.sin(math.pi * (values - low) / (high - low)) ** 2
    total = float(weight.sum())
    if total <= 0.0:
        return None
    centred = residual - float(np.sum(weight * residual)) / total
    cells = min(_GRID, 1 << max(4, math.ceil(math.log2(len(values)))))
    place = np.minimum(((values - low) / (high - low) * cells).astype(np.int64), cells - 1)
    summed = np.bincount(place, weights=weight * centred, minlength=cells)
    amplitude = 2.0 * np.abs(rfft(summed, n=_PADDING * cells)) / total
    frequency = np.arange(len(amplitude)) / (_PADDING * (high - low))
    resolved = frequency <= _highest(values, step, cells, high - low, method)
    return Spectrum(variable, unit, frequency[resolved], amplitude[resolved])


def _highest(values: FloatArray, step: FloatArray, cells: int, span: float, method: Method) -> float:
    """Return the highest frequency that cells and samples resolve, with four of them for each repetition."""
    moving = step[step > method.location.commanded_standstill * float(step.max())]
    return min(cells / (4.0 * span), 1.0 / (4.0 * float(np.median(moving)))) if len(moving) else 0.0


def lines_of(
    residual: FloatArray, variables: Mapping[str, tuple[str, FloatArray]], motions: Sequence[FloatArray] = (), method: Method = STANDARD
) -> tuple[list[Line], list[Spectrum]]:
    """Return the lines of a residual, the strongest first, and its spectra; ``variables`` maps names to unit and values (samples,).

    The strongest line against any variable is taken out before the next is looked for: a line of the way leaves none in time behind. Of
    ways that tell it as well the first is taken. A line in time that one of the ``motions`` (speeds, directions) has too is the rhythm of
    the motion and is not told.
    """
    spectra = _spectra(residual, variables, method)
    power = float(np.mean((residual - residual.mean()) ** 2))
    rest = residual - residual.mean()
    lines: list[Line] = []
    for _ in range(2 * method.location.most_lines if power > 0.0 else 0):
        tried = [_taken_out(rest, one, variables[one.variable][1], power, method) for one in _spectra(rest, variables, method)]
        found = [item for item in tried if item is not None and item[0].share > method.location.line_share]
        if not found:
            break
        line, rest = _first_of_the_strongest(found, method)
        of_the_motion = line.variable == "time" and any(_has(motion, line, variables["time"][1], method) for motion in motions)
        if not (of_the_motion or _is_of_the_samples(line, variables[line.variable][1], method)):
            lines.append(line)
    return sorted(lines, key=lambda line: -line.share)[: method.location.most_lines], spectra


def _first_of_the_strongest(found: Sequence[tuple[Line, FloatArray]], method: Method) -> tuple[Line, FloatArray]:
    strongest = max(found, key=lambda item: item[0].share)
    if strongest[0].variable == "time":
        return strongest
    ways = (item for item in found if item[0].variable != "time")
    return next(item for item in ways if item[0].share >= method.shared.nearly_all * strongest[0].share)


def _is_of_the_samples(line: Line, values: FloatArray, method: Method = STANDARD) -> bool:
    """Return whether a line repeats with the way from sample to sample, at a speed that is held long: noise there is alike once a
    sample."""
    step = np.abs(np.gradient(values))
    periods = line.frequency * step
    near = method.location.once_a_sample
    once = (np.abs(periods - np.round(periods)) < near) & (periods > 1.0 - near)
    return line.variable != "time" and float(step[once].sum()) > method.location.held_speed * float(step.sum())


def _has(motion: FloatArray, line: Line, time: FloatArray, method: Method) -> bool:
    """Return whether a motion has a line of this frequency too."""
    centred = motion - motion.mean()
    size = abs(np.mean(centred * np.exp(-2j * math.pi * line.frequency * time)))
    return bool(2.0 * size * size > method.location.rhythm * float(np.mean(centred * centred)))


def _spectra(residual: FloatArray, variables: Mapping[str, tuple[str, FloatArray]], method: Method) -> list[Spectrum]:
    found = (spectrum_against(residual, name, unit, values, method) for name, (unit, values) in variables.items())
    return [spectrum for spectrum in found if spectrum is not None]


def _taken_out(
    residual: FloatArray, spectrum: Spectrum, values: FloatArray, power: float, method: Method
) -> tuple[Line, FloatArray] | None:
    """Return the strongest line of a spectrum, fitted by least squares, and the residual without it."""
    place = _peak(spectrum, method)
    if place is None:
        return None
    frequency = _between(spectrum.frequency, spectrum.amplitude, place)
    angle = 2.0 * math.pi * frequency * values
    basis = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    sizes, *_ = np.linalg.lstsq(basis, residual, rcond=None)
    rest = residual - basis @ sizes
    share = (float(np.mean(residual**2)) - float(np.mean(rest**2))) / power
    return Line(spectrum.variable, spectrum.unit, frequency, float(np.hypot(*sizes)), share), rest


def _peak(spectrum: Spectrum, method: Method) -> int | None:
    """Return the place of the strongest amplitude that stands out of its surroundings."""
    amplitude = spectrum.amplitude
    first = int(_PADDING * method.location.line_turns)
    if len(amplitude) < 2 * first:
        return None
    around = median_filter(amplitude, size=_SPREAD, mode="nearest")
    inner = amplitude[1:-1]
    stands_out = (inner >= amplitude[:-2]) & (inner > amplitude[2:]) & (inner > method.location.line_prominent * around[1:-1])
    stands_out[: first - 1] = False
    return int(np.argmax(np.where(stands_out, inner, 0.0))) + 1 if stands_out.any() else None


def _between(frequency: FloatArray, amplitude: FloatArray, place: int) -> float:
    """Return the frequency of a peak between the grid's, by the parabola through three points."""
    before, here, after = (float(amplitude[place + shift]) for shift in (-1, 0, 1))
    bend = before - 2.0 * here + after
    shift = 0.5 * (before - after) / bend if bend < 0.0 else 0.0
    return float(frequency[place]) + shift * float(frequency[1] - frequency[0])
