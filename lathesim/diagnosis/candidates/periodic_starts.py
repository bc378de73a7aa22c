"""Where a periodic effect is looked for: the wavelengths, over the place of a part, at which the missing signals are strongest.

A ripple, a pitch error or an eccentricity repeats over position; fitting its period from a typical one ends in the nearest wrong hump. The
periodogram over position, |sum_k r_k exp(-i w x_k)|^2, is taken of every missing signal: the samples are summed into fine bins of x and
transformed at once. Source: Lomb, Least-squares frequency analysis of unequally spaced data, Astrophysics and Space Science 39 (1976).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.fft import next_fast_len, rfft, rfftfreq

from lathesim.diagnosis.location import FORCES, direction_of, missing_signal
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.engine.assembly import FloatArray, Place
from lathesim.identification.records import Candidate, Fitted
from lathesim.identification.replay.experiment import Experiment
from lathesim.identification.replay.measured_motion import measured_output, velocity_of
from lathesim.identification.roles import acting

PERIODS = ("lead", "turn", "period", "signal_period", "length")
"""What effects call the place after which they repeat."""
_ORDER = "order"
_SIZES = ("amplitude", "ripple")
_SHARE = "share"
BEYOND_TYPICAL = 1.3
"""Factor by which a wavelength may lie outside the typical range."""


@dataclass(frozen=True)
class _Wave:
    """A candidate that repeats over a place: which of its parameters says how long it is, and which how large."""

    candidate: Candidate
    names: tuple[str, ...]
    length: str
    size: str

    @property
    def sizes(self) -> list[tuple[str, str]]:
        """The parameters that say how large it is, each with what its signal is multiplied with: nothing, or the direction of a friction
        that turns its sign round, or the driving force of a ripple in proportion to it."""
        how = self.candidate.effect.identification
        turns = how.periodic and how.against_motion
        sizes = [(self.size, "direction" if turns else "")]
        return sizes + ([(_SHARE, "drive")] if _SHARE in self.names and self.size != _SHARE else [])

    @property
    def column(self) -> int:
        """The column of the length among the parameters."""
        return self.names.index(self.length)


def _waves_of(candidates: Sequence[Candidate]) -> Iterator[_Wave]:
    """Return those of some candidates that repeat over a place."""
    for candidate in candidates:
        names = tuple(Place.of(name).port for name in candidate.parameters)
        length = next((name for name in (*PERIODS, _ORDER) if name in names), "")
        size = next((name for name in (*_SIZES, *candidate.effect.neutral) if name in names), "")
        if length and size:
            yield _Wave(candidate, names, length, size)


def wave_points(experiment: Experiment, fitted: Fitted, candidates: list[Candidate], method: Method = STANDARD) -> dict[str, FloatArray]:
    """Return starting values by candidate part for effects that repeat over a place: strongest wavelengths, three phases."""
    places = _places(experiment)
    missing = [missing_signal(experiment, fitted, row) for row in range(len(experiment.machine.compare))]
    signals = [_standardised(one.values) for one in missing]
    forces = {one.unit: math.sqrt(2.0) * float(np.std(one.values)) for one in missing if one.unit in FORCES}
    # what is missing is known in the band of the motion; a shorter ripple shows in the residual's second differences
    fast = [_standardised(np.diff(row, n=2, prepend=[row[0], row[0]])) for row in fitted.residual]
    spectra: dict[tuple[str, str], list[tuple[FloatArray, FloatArray]]] = {}
    found: dict[str, FloatArray] = {}
    for wave in _waves_of(candidates):
        candidate = wave.candidate
        host, place, velocity = places.get(_repeats_along(candidate), ("", None, None))
        if place is None or velocity is None:
            continue
        points = []
        for size, factor in wave.sizes:
            key = (candidate.at if factor == "drive" else host, factor)
            if key not in spectra:
                shortest = _shortest(candidates, {name for name, (other, *_) in places.items() if other == host})
                times = _multiplied_with(experiment, candidate, factor, velocity, method)
                spectra[key] = [_periodogram(place, kind, times, shortest) for kind in (signals, fast)]
            # beside a dry friction a ripple as small as on a small machine moves nothing
            least = forces.get(experiment.sensed.plan.unit(f"{candidate.part}.{size}"), 0.0)
            points += _points_of(wave, size, least, _lengths(spectra[key], wave, place))
        if points:
            # whole numbers a turn are tried besides
            found[candidate.part] = np.vstack([points, candidate.points]) if wave.length == _ORDER else np.array(points)
    return found


def _repeats_along(candidate: Candidate) -> str:
    """Return the part over whose place a candidate repeats."""
    return candidate.part if candidate.effect.identification.along else Place.of(candidate.at).part


def _multiplied_with(experiment: Experiment, candidate: Candidate, factor: str, velocity: FloatArray, method: Method) -> FloatArray | None:
    """Return what the signal of a wave is multiplied with; a ripple goes with the direction where nothing is known to drive it."""
    if not factor:
        return None
    driving = _driving(experiment, candidate.at) if factor == "drive" else None
    return direction_of(velocity, method=method) if driving is None else driving


def _range_of_lengths(wave: _Wave, place: FloatArray) -> tuple[float, float]:
    """Return the shortest and the longest wave that is looked for."""
    candidate = wave.candidate
    # the shortest waves of the range are no longer than samples are apart on a fast axis: chance has lines there
    low, high = float(candidate.points[:, wave.column].min()), float(candidate.usual[wave.column])
    if wave.length == _ORDER:
        low, high = (2.0 * math.pi / order for order in reversed(candidate.effect.identification.typical[_ORDER]))
    else:
        # a belt's pulley turns once in a tenth of a metre, a fine screw once in a quarter of a millimetre; a force must be there five
        # times and not two, as other slow ones are there too
        least, other_geometry = 2.0 if candidate.effect.site == "measured" else 5.0, 10.0
        high = max(high, min(float(np.ptp(place)) / least, other_geometry * high))
        low /= other_geometry
    return max(low, 2.0 * BEYOND_TYPICAL * _way_per_sample(place)), high


def _lengths(spectra: Sequence[tuple[FloatArray, FloatArray]], wave: _Wave, place: FloatArray) -> list[float]:
    """Return the wavelengths at which spectra are strongest, and besides those of which few are on the whole way."""
    low, high = _range_of_lengths(wave, place)
    lengths = [length for spectrum in spectra for length in _strongest(*spectrum, low / BEYOND_TYPICAL, high * BEYOND_TYPICAL)]
    # so few waves in the whole way are no line of a periodogram, and its trend takes a part of them
    few, usual = float(np.ptp(place)) / np.array([1.0, 1.5, 2.0, 3.0]), float(wave.candidate.usual[wave.column])
    return lengths + [length for length in few if low < length < usual]


def _points_of(wave: _Wave, size: str, least: float, lengths: Sequence[float]) -> list[FloatArray]:
    """Return a starting point for each wavelength and phase, of the usual ``size`` or the ``least``."""
    names, candidate, points = wave.names, wave.candidate, []
    usual = max(least, float(np.median(candidate.points[:, names.index(size)])))
    for length in lengths:
        for phase in (third * 2.0 * math.pi / 3.0 for third in (0, 1, -1)):
            point = np.where(np.isin(names, ["phase", "second_phase"]), phase, candidate.neutral)
            point[wave.column] = 2.0 * math.pi / length if wave.length == _ORDER else length
            point[names.index(size)] = min(usual, float(candidate.high[names.index(size)]))
            points.append(point)
    return points


def cycle_of(experiment: Experiment, candidate: Candidate, length: float) -> float:
    """Return by how much a wavelength changes where one wave more fits into the way of the recording; infinite where no way is known."""
    seen = _places(experiment).get(_repeats_along(candidate))
    return math.inf if seen is None else length * length / float(np.ptp(seen[1]))


def _places(experiment: Experiment) -> dict[str, tuple[str, FloatArray, FloatArray]]:
    """Return by part which part moves, its place and its velocity: of a moving part its own, of a sensor those of the part it looks at,
    of an effect that repeats along something else that, as simulated."""
    motion = experiment.motion
    assembly = experiment.machine.assembly
    found: dict[str, tuple[str, FloatArray, FloatArray]] = {}
    for name, part in assembly.by_name.items():
        ports = part.component.ports
        host = name if "displacement" in ports else Place.of(measured_output(assembly, f"{name}.{ports.get('reading', '')}")).part
        of_host = assembly.ports(host)
        place, velocity = (motion.get(f"{host}.{of_host.get(role, '')}") for role in ("displacement", "flow"))
        if place is not None and velocity is not None and np.ptp(place) > 0.0:
            found[name] = (host, place, velocity)
    for candidate in experiment.candidates:
        if candidate.effect.identification.along:
            way = experiment.way_of(candidate)
            if np.ptp(way) > 0.0:
                found[candidate.part] = (candidate.part, way, velocity_of(way, experiment.machine.assembly.sample_period))
    return found


def _way_per_sample(place: FloatArray) -> float:
    """Return the way from one sample to the next where it moves slowly: what repeats within two of them cannot be told from a slow wave."""
    steps = np.abs(np.diff(place))
    return float(np.quantile(steps[steps > 0.0], 0.25)) if np.any(steps > 0.0) else 0.0


def _driving(experiment: Experiment, part: str) -> FloatArray | None:
    """Return what drives a part in the replay, as a multiple of its usual size; none where nothing is wired to it."""
    plan = experiment.sensed.plan
    source = next((source for target, source in acting(plan.assembly) if Place.of(target).part == part), "")
    if source not in plan.channels:
        return None
    drive = np.nan_to_num(experiment.sensed.channel([], [], plan.channels.index(source)))
    size = float(np.sqrt(np.mean(drive * drive)))
    return np.asarray(drive / size) if size > 0.0 else None


def _standardised(values: FloatArray) -> FloatArray:
    spread = float(np.std(values))
    return (values - float(np.mean(values))) / spread if spread > 0.0 and np.isfinite(spread) else np.zeros_like(values)


def _shortest(candidates: list[Candidate], at: set[str]) -> float:
    """Return the shortest wavelength that a candidate at one of some parts may have."""
    inside = [candidate for candidate in candidates if at & {Place.of(candidate.at).part, candidate.part}]
    there = [(candidate, column, Place.of(name).port) for candidate in inside for column, name in enumerate(candidate.parameters)]
    lengths = [float(candidate.least[column]) for candidate, column, name in there if name in PERIODS]
    lengths += [2.0 * math.pi / candidate.effect.identification.typical[_ORDER][1] for candidate, _, name in there if name == _ORDER]
    return min(lengths, default=math.inf) / BEYOND_TYPICAL


def _periodogram(place: FloatArray, signals: list[FloatArray], times: FloatArray | None, shortest: float) -> tuple[FloatArray, FloatArray]:
    """Return waves per length and power, summed over the signals ``times`` a factor; the slowest trend over the place is taken out."""
    span = float(np.ptp(place))
    bins = int(np.clip(6.0 * span / shortest, 256, 1 << 18)) if math.isfinite(shortest) else 4096
    index = np.minimum(((place - place.min()) / span * bins).astype(np.int64), bins - 1)
    padded = next_fast_len(4 * bins, real=True)
    power = np.zeros(padded // 2 + 1)
    slow = np.vander(2.0 * (place - place.min()) / span - 1.0, 4)
    for signal in signals:
        values = signal if times is None else signal * times
        left = values - slow @ np.linalg.lstsq(slow, values, rcond=None)[0]
        power += np.abs(rfft(np.bincount(index, weights=left, minlength=bins), padded)) ** 2
    return np.asarray(rfftfreq(padded, span / bins)), power


def _strongest(waves: FloatArray, power: FloatArray, low: float, high: float) -> list[float]:
    """Return the wavelengths between two that are strongest, one, and that stand out most from their neighbours: what is missing is the
    noisier the shorter the wave, and a long one stands out where it is not the largest."""
    inside = (waves > 1.0 / high) & (waves < 1.0 / low)
    found: list[int] = []
    for strength, many in ((power, 1), (power / np.maximum(_background(power), 1e-300), 2)):
        left = np.where(inside, strength, 0.0)
        for other in found:
            left[_beside(other)] = 0.0
        for _ in range(many):
            if left.max(initial=0.0) > 0.0:
                found.append(int(np.argmax(left)))
                left[_beside(found[-1])] = 0.0
    return [float(1.0 / waves[place]) for place in found]


def _beside(place: int) -> slice:
    """Return the places of a padded periodogram that one line spreads over."""
    spread = 8
    return slice(max(0, place - spread), place + spread + 1)


def _background(power: FloatArray) -> FloatArray:
    """Return what a periodogram is around each wave: the median over stretches that grow with the wave number."""
    edges = np.unique(np.r_[0, np.geomspace(64, len(power), 40).astype(np.int64)])
    middles = [0.5 * (begin + end) for begin, end in itertools.pairwise(edges)]
    medians = [float(np.median(power[begin:end])) for begin, end in itertools.pairwise(edges)]
    return np.interp(np.arange(len(power)), middles, medians)
