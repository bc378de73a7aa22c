"""The growth of a small difference from turn to turn, in the engine: a cut in the loop with the tool modes, run for some turns.

The cut is that of the part RegenerativeCut, in contact always, so that the run from a small displacement is the difference of two runs. The
displacement over one turn is a snapshot. Snapshots follow each other as y(j+1) = M y(j); the largest eigenvalue of M, found by dynamic mode
decomposition, is the multiplier.

Source: P. J. Schmid, J. Fluid Mech. 656 (2010), dynamic mode decomposition. Left out: growth so fast that one turn spans many decades.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from lathesim.components.chatter import MillingCut, RegenerativeCut, ToolMode
from lathesim.components.spindles import SteadySpindle
from lathesim.engine.assembly import Assembly, Part, Wire
from lathesim.engine.wiring import Plan, wire
from lathesim.errors import LessonError
from lathesim.record import FloatArray
from lathesim.stability.lesson_cut import Milling
from lathesim.stability.tool_point import Mode, ToolPoint

STEPS_OF_A_VIBRATION = 100
"""Steps of the quickest natural period, at least. With RK4 and cubic interpolation they leave less than 1e-4 of the growth."""
FEWEST_STEPS = 240
"""Steps of a turn, at least."""
TURNS = 48
"""Turns of a run: the first third lets the quicker modes die out."""
_RANK = 12
"""Modes of the decomposition at most, assumed: more only fit rounding."""
_LARGEST = 1e250
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
    process_damping: float = 0.0,
    diameter: float = 0.036,
    share: float = 1.0,
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
    quickest = max(mode.frequency for mode in tool.modes)
    count = max(fewest_steps, math.ceil(steps_of_a_vibration * quickest * turn))
    period = turn / count
    parts, wires = _modes(tool)
    cut = {
        "cutting_stiffness": stiffness,
        "process_damping": process_damping,
        "diameter": diameter,
        "interrupted": share,
        "always_in_contact": 1.0,
        **{name: value for name, value in (values or {}).items() if name != "feed"},
    }
    parts.append(Part("spindle", SteadySpindle, {"target": 2.0 * math.pi * speed / 60.0}))
    parts.append(Part("cut", RegenerativeCut, cut, memory_lengths={"surface": 2 * count}))
    last = f"mode_{len(tool.modes)}"
    wires += [
        Wire("cut.angle", "spindle.angle"),
        Wire("cut.spindle_speed", "spindle.speed"),
        Wire("cut.displacement", f"{last}.displacement"),
        Wire("cut.velocity", f"{last}.velocity"),
        Wire("cut.feed", constant=(values or {}).get("feed", 0.0)),
        Wire("cut.width", constant=1e-3),
    ]
    assembly = Assembly(tuple(parts), tuple(wires), period, period, record=(f"{last}.displacement", *record))
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


def milling_rig(mode: Mode, cut: Milling, speed: float, *, steps_of_a_vibration: int = STEPS_OF_A_VIBRATION) -> Rig:
    """Return a rig that mills with one mode along the feed at a speed [rpm]; its turn is the time of a tooth."""
    if not speed > 0.0:
        raise LessonError(f"the speed is {speed:g} rpm.", remedy="Give one above 0.")
    tooth = 60.0 / (speed * cut.teeth)
    count = max(FEWEST_STEPS, math.ceil(steps_of_a_vibration * mode.frequency * tooth))
    period = tooth / count
    values = {"frequency": mode.frequency, "damping": mode.damping, "stiffness": mode.stiffness}
    given = {"teeth": float(cut.teeth), "tangential": cut.tangential, "normal": cut.normal, "entry": cut.entry, "leave": cut.leave}
    parts = (
        Part("spindle", SteadySpindle, {"target": 2.0 * math.pi * speed / 60.0}),
        Part("mode_1", ToolMode, values, start={"swing": _SEED}),
        Part("cut", MillingCut, {**given, "always_in_contact": 1.0}, memory_lengths={"kept": 2 * count * cut.teeth}),
    )
    wires = (
        Wire("mode_1.hammer", "cut.force"),
        Wire("cut.angle", "spindle.angle"),
        Wire("cut.spindle_speed", "spindle.speed"),
        Wire("cut.displacement", "mode_1.displacement"),
        Wire("cut.velocity", "mode_1.velocity"),
        Wire("cut.feed", constant=0.0),
        Wire("cut.width", constant=1e-3),
    )
    return Rig(wire(Assembly(parts, wires, period, period, record=("mode_1.displacement",))), count, period)


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
    good = np.isfinite(largest) & (largest < _LARGEST) & (largest > 1e-290)
    usable = int(np.argmin(good)) if not good.all() else turns
    if usable < 6:
        return complex(math.inf)
    # each pair of turns counts alike, however much the vibration grew before it
    kept = snapshots[:, usable // 3 : usable]
    scale = np.abs(kept).max(axis=0)
    scale = np.maximum(scale[:-1], scale[1:])
    before, after = kept[:, :-1] / scale, kept[:, 1:] / scale
    left, sizes, right = np.linalg.svd(before, full_matrices=False)
    rank = min(_RANK, int(np.count_nonzero(sizes > 1e-9 * sizes[0])), before.shape[1] // 2)
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
    last = displacement[-count:] * np.hanning(count)
    spectrum = np.abs(np.fft.rfft(last, 4 * count))
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
            if width < 1e-9 * guess:
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
        values = growth(made, probe)
        for at, value in zip(probe.tolist(), values, strict=True):
            rate = _rate(value)
            if rate > 0.0 and at < high:
                high, high_rate, at_high = at, rate, value
            elif rate <= 0.0 and at > low:
                low, low_rate = at, rate
    part = -low_rate / (high_rate - low_rate) if high_rate > low_rate else 0.5
    return low + part * (high - low), at_high
