"""The stability lobes: the limit of the chip width over the spindle speed, by any of three methods.

The growth of a small difference from turn to turn, in the engine: a cut in the loop with the tool modes, run for some turns.

The cut is that of the part RegenerativeCut, in contact always, so that the run from a small displacement is the difference of two runs. The
displacement over one turn is a snapshot. Snapshots follow each other as y(j+1) = M y(j); the largest eigenvalue of M, found by dynamic mode
decomposition, is the multiplier.

Source: P. J. Schmid, J. Fluid Mech. 656 (2010), dynamic mode decomposition. Left out: growth so fast that one turn spans many decades.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from lathesim.components.chatter import MillingCut, RegenerativeCut, ToolMode
from lathesim.components.spindles import SteadySpindle
from lathesim.engine.assembly import Assembly, Part, Wire
from lathesim.engine.wiring import Plan, wire
from lathesim.errors import LessonError
from lathesim.record import FloatArray
from lathesim.stability.frequency_limit import WidthLimit, between_lines, limit_at, limit_of_response, limits_of_lines, smallest_limit
from lathesim.stability.lesson_settings import Cut, Milling, with_modes
from lathesim.stability.periodic_delay import DelayEquation, chatter_frequency, kind_of, milling, smallest_unstable, turning
from lathesim.stability.stability_thresholds import MAP, ROUNDING
from lathesim.stability.tool_point import FrequencyResponse, Mode, ToolPoint
from lathesim.units import in_unit

STEPS_OF_A_VIBRATION = 100
"""Steps of the quickest natural period, at least. With RK4 and cubic interpolation they leave less than 1e-4 of the growth."""
FEWEST_STEPS = 240
"""Steps of a turn, at least."""
TURNS = 48
"""Turns of a run: the first third lets the quicker modes die out."""
_RANK = 12
"""Modes of the decomposition at most, assumed: more only fit rounding."""
_SMALLEST, _LARGEST = 1e-290, 1e250
_SEED = 1e-6


@dataclass(frozen=True)
class Rig:
    """A tool point at a spindle speed [rpm], wired with the cut: ``plan``, the samples of a turn and the length of a sample [s]."""

    plan: Plan
    samples_of_a_turn: int
    period: float


def rig(
    tool: ToolPoint,
    stiffness: float,
    speed: float,
    *,
    steps_of_a_vibration: int = STEPS_OF_A_VIBRATION,
    fewest_steps: int = FEWEST_STEPS,
    values: dict[str, float] | None = None,
    record: tuple[str, ...] = (),
) -> Rig:
    """Return a rig; ``values`` are further parameters of its cut [SI], ``record`` further channels to record.

    The step divides the turn, so that a cell is a step.
    """
    if not speed > 0.0:
        raise LessonError(f"the speed is {speed:g} rpm.", remedy="Give one above 0.")
    turn = 60.0 / speed
    count = max(fewest_steps, math.ceil(steps_of_a_vibration * max(mode.frequency for mode in tool.modes) * turn))
    period = turn / count
    parts, wires = _modes(tool)
    given = {name: value for name, value in (values or {}).items() if name != "feed"}
    cut = {"cutting_stiffness": stiffness, "always_in_contact": 1.0, **given}
    cutting = Part("cut", RegenerativeCut, cut, memory_lengths={"surface": 2 * count})
    return _rig(parts, wires, cutting, speed, (values or {}).get("feed", 0.0), count, period, record)


def _rig(
    modes: list[Part], wires: list[Wire], cut: Part, speed: float, feed: float, count: int, period: float, record: tuple[str, ...] = ()
) -> Rig:
    """Return modes in a row and a cut behind the last of them, on a spindle that turns steadily at a speed [rpm]."""
    last = modes[-1].name
    spindle = Part("spindle", SteadySpindle, {"target": 2.0 * math.pi * speed / 60.0})
    wires = [
        *wires,
        Wire("cut.angle", "spindle.angle"),
        Wire("cut.spindle_speed", "spindle.speed"),
        Wire("cut.displacement", f"{last}.displacement"),
        Wire("cut.velocity", f"{last}.velocity"),
        Wire("cut.feed", constant=feed),
        Wire("cut.width", constant=1e-3),
    ]
    assembly = Assembly((*modes, spindle, cut), tuple(wires), period, period, record=(f"{last}.displacement", *record))
    return Rig(wire(assembly), count, period)


def _modes(tool: ToolPoint) -> tuple[list[Part], list[Wire]]:
    """Return the modes in a row. A factor mu becomes a force angle beta with cos(beta - alpha) cos(alpha) = mu."""
    parts: list[Part] = []
    wires: list[Wire] = []
    for number, (mode, factor) in enumerate(zip(tool.modes, tool.factors, strict=True), 1):
        across = math.acos(min(max(factor / math.cos(mode.direction), -1.0), 1.0))
        values = {"frequency": mode.frequency, "damping": mode.damping, "stiffness": mode.stiffness, "direction": mode.direction}
        values["force_angle"] = mode.direction + across
        parts.append(Part(f"mode_{number}", ToolMode, values, start={"swing": _SEED}))
        wires += [Wire(f"mode_{number}.force", "cut.force"), Wire(f"mode_{number}.drag", "cut.drag")]
        if number > 1:
            wires.append(Wire(f"mode_{number}.before", f"mode_{number - 1}.displacement"))
            wires.append(Wire(f"mode_{number}.before_rate", f"mode_{number - 1}.velocity"))
    return parts, wires


def milling_rig(mode: Mode, cut: Milling, speed: float) -> Rig:
    """Return a rig that mills with one mode along the feed at a speed [rpm]; its turn is the time of a tooth."""
    if not speed > 0.0:
        raise LessonError(f"the speed is {speed:g} rpm.", remedy="Give one above 0.")
    tooth = 60.0 / (speed * cut.teeth)
    count = max(FEWEST_STEPS, math.ceil(STEPS_OF_A_VIBRATION * mode.frequency * tooth))
    period = tooth / count
    values = {"frequency": mode.frequency, "damping": mode.damping, "stiffness": mode.stiffness}
    given = {"teeth": float(cut.teeth), "tangential": cut.tangential, "normal": cut.normal, "entry": cut.entry, "leave": cut.leave}
    cutting = Part("cut", MillingCut, {**given, "always_in_contact": 1.0}, memory_lengths={"kept": 2 * count * cut.teeth})
    modes = [Part("mode_1", ToolMode, values, start={"swing": _SEED})]
    return _rig(modes, [Wire("mode_1.hammer", "cut.force")], cutting, speed, 0.0, count, period)


def growth(rig: Rig, widths: FloatArray, turns: int = TURNS) -> list[complex]:
    """Return the multiplier of a turn at each chip width [m]; infinity where the vibration grows beyond all bounds."""
    from lathesim.engine.batch import Batch

    def reduce(values: FloatArray) -> complex:
        return turn_multiplier(values[0], rig.samples_of_a_turn)

    batch = Batch(rig.plan, turns * rig.samples_of_a_turn, noisy=False)
    return batch.run(["cut.width"], np.asarray(widths, dtype=float)[:, None], reduce)


def turn_multiplier(displacement: FloatArray, samples_of_a_turn: int) -> complex:
    """Return the multiplier of largest size by which the displacement goes from turn to turn; ``displacement`` (turns x samples,)."""
    turns = len(displacement) // samples_of_a_turn
    snapshots = displacement[: turns * samples_of_a_turn].reshape(turns, samples_of_a_turn).T
    largest = np.abs(snapshots).max(axis=0)
    good = np.isfinite(largest) & (largest < _LARGEST) & (largest > _SMALLEST)
    usable = int(np.argmin(good)) if not good.all() else turns
    if usable < MAP.snapshots:
        return complex(math.inf)
    # each pair of turns counts alike, however much the vibration grew before it
    kept = snapshots[:, usable // 3 : usable]
    scale = np.abs(kept).max(axis=0)
    scale = np.maximum(scale[:-1], scale[1:])
    before, after = kept[:, :-1] / scale, kept[:, 1:] / scale
    left, sizes, right = np.linalg.svd(before, full_matrices=False)
    rank = min(_RANK, int(np.count_nonzero(sizes > ROUNDING * sizes[0])), before.shape[1] // 2)
    reduced = left[:, :rank].T @ after @ right[:rank].T / sizes[:rank]
    values: Any = np.linalg.eigvals(reduced)
    found = complex(values[np.argmax(np.abs(values))])
    return complex(found.real, abs(found.imag))


def vibration_frequency(made: Rig, width: float, multiplier: complex) -> float:
    """Return the frequency [Hz] of the strongest vibration of a rig at a chip width [m] whose multiplier of a turn is known.

    It is one of (arg(multiplier) + 2 pi k)/(2 pi tau): which one, the spectrum of the last turns says.
    """
    from lathesim.engine.batch import Batch

    batch = Batch(made.plan, TURNS * made.samples_of_a_turn, noisy=False)
    (displacement,) = batch.run(["cut.width"], np.array([[width]]), lambda values: values[0].copy())
    count = 8 * made.samples_of_a_turn
    spectrum = np.abs(np.fft.rfft(displacement[-count:] * np.hanning(count), 4 * count))
    turn = made.samples_of_a_turn * made.period
    turns = float(np.argmax(spectrum)) / (4 * count * made.period) * turn
    part = abs(math.atan2(multiplier.imag, multiplier.real)) / (2.0 * math.pi)
    places = [sign * part + k for sign in (-1.0, 1.0) for k in (math.floor(turns), math.floor(turns) + 1)]
    return min(places, key=lambda item: abs(item - turns)) / turn


_AT_ONCE = 6
_RISE = 1.15
_CLOSE = 2e-4
"""The limit is known when its bracket is this narrow."""


def time_limit(made: Rig, guess: float, largest: float) -> tuple[float, complex]:
    """Return the smallest chip width [m] at which a rig chatters, and the multiplier there; infinity where none up to ``largest``.

    Widths are raised from ``guess`` by a seventh at a time until one grows; then the bracket is halved, each half by a line through its
    ends.
    """
    low, low_rate = 0.0, -math.inf
    width = guess
    while True:
        widths = np.asarray(width * _RISE ** np.arange(_AT_ONCE), dtype=np.float64)
        found = growth(made, widths)
        rates = [_rate(value) for value in found]
        above = next((place for place, rate in enumerate(rates) if rate > 0.0), None)
        if above is None:
            low, low_rate = float(widths[-1]), rates[-1]
            width = low * _RISE
            if width > largest:
                return math.inf, 0j
            continue
        if above == 0 and low == 0.0:
            width = 0.5 * float(widths[0])
            if width < ROUNDING * guess:
                return 0.0, found[0]
            continue
        if above > 0:
            low, low_rate = float(widths[above - 1]), rates[above - 1]
        return _refined(made, low, low_rate, float(widths[above]), rates[above], found[above])


def _rate(multiplier: complex) -> float:
    size = abs(multiplier)
    return math.log(size) if 0.0 < size < math.inf else math.copysign(50.0, size - 1.0)


def _refined(made: Rig, low: float, low_rate: float, high: float, high_rate: float, at_high: complex) -> tuple[float, complex]:
    """Return the width between two at which the rate is 0, by false position held to the middle where it lags."""
    for _ in range(12):
        if high - low < _CLOSE * high:
            break
        part = min(max(-low_rate / (high_rate - low_rate), 0.05), 0.95)
        width = low + part * (high - low)
        near = 0.1 * _CLOSE * high
        probe = np.array([max(width - near, 0.5 * (low + width)), min(width + near, 0.5 * (high + width))])
        for at, value in zip(probe.tolist(), growth(made, probe), strict=True):
            rate = _rate(value)
            if rate > 0.0 and at < high:
                high, high_rate, at_high = at, rate, value
            elif rate <= 0.0 and at > low:
                low, low_rate = at, rate
    part = -low_rate / (high_rate - low_rate) if high_rate > low_rate else 0.5
    return low + part * (high - low), at_high


METHODS = ("frequency", "collocation", "time")
_WIDEST = 50.0
"""Times the smallest limit up to which a limit is looked for by collocation and in the time domain, assumed: nobody cuts wider."""
Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class LobePoint:
    """The limit at a speed, and how stability is lost there: "Hopf" or "flip"."""

    limit: WidthLimit
    kind: str


@dataclass(frozen=True)
class StabilityMap:
    """Limits over speed with the method they come from, the smallest of all speeds, and sentences worth telling."""

    points: tuple[LobePoint, ...]
    method: str
    smallest: WidthLimit
    findings: tuple[str, ...] = field(default=())


def stability_map(cut: Cut, speeds: Sequence[float], method: str, progress: Progress | None = None) -> StabilityMap:
    """Return the limit at each speed [rpm].

    An interrupted cut and milling need the method "collocation" or "time", :class:`LessonError` otherwise. A measured response is taken as
    it is by the method "frequency"; the others fit modes to it, which is said.
    """
    for speed in speeds:
        if not speed > 0.0 or not math.isfinite(speed):
            raise LessonError(f"the speed is {speed:g} rpm.", remedy="Give speeds above 0.")
    if method == "frequency":
        if cut.share < 1.0 or cut.milling is not None:
            word = "An interrupted cut" if cut.milling is None else "Milling"
            raise LessonError(f"{word.lower()} has no limit in the frequency domain.", remedy="Use the method 'collocation'.")
        return _by_frequency(cut, speeds)
    tool, fitted = with_modes(cut)
    # what holds at any speed is known in closed form for an uninterrupted cut only
    whole = cut.milling is None and cut.share == 1.0
    smallest = smallest_limit(tool, cut.stiffness) if whole else WidthLimit(math.nan, math.nan)
    findings = (*(cut.tool.findings if isinstance(cut.tool, FrequencyResponse) else ()), *((fitted,) if fitted else ()))
    points = []
    for place, speed in enumerate(speeds):
        points.append(_by_collocation(cut, tool, speed) if method == "collocation" else _by_time(cut, tool, speed))
        if progress is not None:
            progress(place + 1, len(speeds))
    if isinstance(cut.tool, FrequencyResponse) and any(point.limit.frequency > cut.tool.highest for point in points):
        findings += (f"Limits with chatter above {cut.tool.highest:g} Hz rest on the residual term, beyond the measured response.",)
    if any(math.isinf(point.limit.width) for point in points):
        findings += (f"'stable' means up to {in_unit(_widest(cut, first_guess(cut, tool)), 'mm')}; wider cuts were not tried.",)
    return StabilityMap(tuple(points), method, smallest, findings)


def _by_frequency(cut: Cut, speeds: Sequence[float]) -> StabilityMap:
    tool = cut.tool
    if isinstance(tool, FrequencyResponse):
        lines, values = between_lines(tool.frequency, tool.receptance_values)
        tool = replace(tool, frequency=lines, receptance_values=values, coherence=None, hits=None, forces=None)
        response = cut.factor * tool.receptance_values
        lowest = int(np.argmin(response.real))
        reach = -0.5 / (cut.stiffness * float(response.real[lowest])) if response.real[lowest] < 0.0 else math.inf
        smallest = WidthLimit(math.nan, reach, float(tool.frequency[lowest]))
        if cut.process_damping > 0.0:
            limits = [
                limit_of_response(
                    tool,
                    cut.factor,
                    math.cos(cut.direction) ** 2,
                    cut.stiffness,
                    speed,
                    process_damping=cut.process_damping,
                    diameter=cut.diameter,
                )
                for speed in speeds
            ]
        else:
            limits = limits_of_lines(tool.frequency, response, cut.stiffness, np.asarray(speeds))
        findings = tool.findings
        if tool.window_rate:
            findings += (
                f"the response was weighted by a window of {tool.window_rate:.3g} 1/s and looks more damped than the tool point is",
            )
    else:
        limits = [limit_at(tool, cut.stiffness, speed, process_damping=cut.process_damping, diameter=cut.diameter) for speed in speeds]
        smallest, findings = smallest_limit(tool, cut.stiffness), ()
    points = tuple(LobePoint(limit, "Hopf" if math.isfinite(limit.width) else "") for limit in limits)
    return StabilityMap(points, "frequency", smallest, findings)


def equation_of(cut: Cut, tool: ToolPoint, speed: float) -> Callable[[float], DelayEquation]:
    """Return what makes the delay equation of a cut at a speed [rpm] from a chip width [m]."""
    mill = cut.milling
    if mill is None:
        return lambda width: turning(
            tool, cut.stiffness, width, speed, process_damping=cut.process_damping, diameter=cut.diameter, share=cut.share
        )
    mode = one_mode(tool)
    return lambda width: milling(mode, mill.tangential, mill.normal, width, speed, teeth=mill.teeth, entry=mill.entry, leave=mill.leave)


def one_mode(tool: ToolPoint) -> Mode:
    """Return the mode along the feed that milling takes; :class:`LessonError` where there are several."""
    if len(tool.modes) != 1:
        raise LessonError(f"milling takes one mode, along the feed, and there are {len(tool.modes)}.", remedy="Give one mode.")
    return tool.modes[0]


def first_guess(cut: Cut, tool: ToolPoint) -> float:
    """Return a chip width [m] that is stable or nearly so, from which widths are raised."""
    if cut.milling is None:
        smallest = smallest_limit(tool, cut.stiffness).width
        if math.isfinite(smallest):
            return 0.5 * smallest
        return 0.05 / (cut.stiffness * sum(abs(factor) / mode.stiffness for mode, factor in zip(tool.modes, tool.factors, strict=True)))
    mode = tool.modes[0]
    force = math.hypot(cut.milling.tangential, cut.milling.normal)
    return 0.5 * 2.0 * mode.stiffness * max(mode.damping, 1e-4) * (1.0 + mode.damping) / (force * cut.milling.teeth)


def _widest(cut: Cut, guess: float) -> float:
    """Return the width [m] up to which a limit is looked for; a guess for milling is lower, as its force turns."""
    return (2.0 if cut.milling is None else 10.0) * _WIDEST * guess


def _by_collocation(cut: Cut, tool: ToolPoint, speed: float) -> LobePoint:
    guess = first_guess(cut, tool)
    make = equation_of(cut, tool, speed)
    width, multiplier = smallest_unstable(make, guess, largest=_widest(cut, guess))
    if not math.isfinite(width):
        return LobePoint(WidthLimit(speed, width), "")
    frequency = chatter_frequency(make(width), multiplier)
    return LobePoint(WidthLimit(speed, width, frequency, int(frequency * make(width).period + 1e-9)), kind_of(multiplier))


def _by_time(cut: Cut, tool: ToolPoint, speed: float) -> LobePoint:

    if cut.milling is not None:
        made = milling_rig(one_mode(tool), cut.milling, speed)
    else:
        values = {"process_damping": cut.process_damping, "diameter": cut.diameter, "interrupted": cut.share}
        made = rig(tool, cut.stiffness, speed, values=values)
    guess = first_guess(cut, tool)
    width, multiplier = time_limit(made, guess, _widest(cut, guess))
    if not math.isfinite(width):
        return LobePoint(WidthLimit(speed, width), "")
    frequency = vibration_frequency(made, width, multiplier)
    turn = made.samples_of_a_turn * made.period
    return LobePoint(WidthLimit(speed, width, frequency, int(frequency * turn + 1e-9)), kind_of(multiplier))
