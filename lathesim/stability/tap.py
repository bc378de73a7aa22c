"""A tap test: the hits of a hammer in the engine, and the frequency response that hits give.

Hits to a frequency response: H1, H2 and coherence; double hits and overloads are found and left out.

    H1 = sum X F* / sum |F|^2,   H2 = sum |X|^2 / sum F X*,   coherence = |sum X F*|^2 / (sum |F|^2 sum |X|^2)

The force is set to 0 outside its pulse. Where a response has not died out at the end of its record, force and response are weighted by an
exponential window exp(-r t); the response is then that at j w + r, exactly, and its rate r is kept so that it can be taken from the
damping. Source: D. J. Ewins, Modal Testing (2000), chapter 3. Left out: noise that force and response share.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from lathesim.components.chatter import ImpactHammer, ToolMode
from lathesim.components.sensors import Accelerometer, SampledSensor
from lathesim.engine.assembly import Assembly, Part, Wire
from lathesim.engine.wiring import Plan, wire
from lathesim.errors import LessonError, RecordingError
from lathesim.record import FloatArray
from lathesim.stability.stability_thresholds import ROUNDING, TAP
from lathesim.stability.tool_point import Complex, FrequencyResponse, Quantity, ToolPoint, to_receptance
from lathesim.units import in_unit

_FEWEST_STEPS, _MOST_STEPS = 8, 32
_ANGLE_OF_A_STEP = 0.04
"""Angle [rad] that the fastest mode turns in an RK4 step a: its frequency is then right within a^4/120 = 2e-8, less than noise hides."""
_BAND = 0.2
"""Corner of the filters over the sample rate."""
START = 0.01
"""Silence before a hit [s], from which the noise is known."""


@dataclass(frozen=True)
class TapSettings:
    """How it is tapped: number of hits, mean peak [N] and its scatter, contact [s], sample rate [Hz], length of a record [s], noise of
    force [N] and of the response [SI], chance of a double hit, range of the force [N], and what the response is."""

    hits: int = 5
    peak: float = 800.0
    scatter: float = 0.1
    contact: float = 4e-4
    rate: float = 12800.0
    length: float = 2.0
    force_noise: float = 0.5
    response_noise: float = 2e-9
    double_hits: float = 0.0
    force_range: float = 5000.0
    sensor: Quantity = "receptance"


@dataclass(frozen=True, eq=False)
class TapRecord:
    """Records of hits: force [N] and response [m or m/s^2], both (hits, samples), and the sample rate [Hz].

    ``truth`` says of each hit whether it was a double one, where it was simulated.
    """

    force: FloatArray
    response: FloatArray
    rate: float
    quantity: Quantity
    force_range: float = math.inf
    truth: tuple[bool, ...] = ()


def tap(tool: ToolPoint, settings: TapSettings, seed: int) -> TapRecord:
    """Return the records of a tap test of a tool point along the normal. Each hit is a run; its peak and bounce are drawn by ``seed``."""
    highest = max(mode.frequency for mode in tool.modes)
    if highest > TAP.bandwidth * settings.rate:
        fact = f"a mode at {highest:.0f} Hz cannot be seen at {settings.rate:.0f} samples a second."
        raise LessonError(fact, remedy=f"Use a rate of at least {math.ceil(highest / 0.3):d} Hz.")
    from lathesim.engine.run import run

    plan = _plan(tool, settings)
    chance = np.random.Generator(np.random.Philox(seed))
    samples = round(settings.length * settings.rate)
    forces, responses, doubled = np.zeros((settings.hits, samples)), np.zeros((settings.hits, samples)), []
    for hit in range(settings.hits):
        double = bool(chance.random() < settings.double_hits)
        values = {
            "hammer.peak": settings.peak * math.exp(settings.scatter * chance.standard_normal()),
            "hammer.start": START + chance.random() / settings.rate,
            "hammer.bounce": chance.uniform(0.1, 0.7) if double else 0.0,
            "hammer.bounce_delay": chance.uniform(4.0, 40.0) * settings.contact,
        }
        doubled.append(double)
        record = run(plan, duration=settings.length, seed=seed * 1009 + hit, overrides=values, engine="compiled")
        forces[hit] = record["load_cell.reading"][:samples]
        responses[hit] = record["sensor.reading"][:samples]
    return TapRecord(forces, responses, settings.rate, settings.sensor, settings.force_range, tuple(doubled))


def _plan(tool: ToolPoint, settings: TapSettings) -> Plan:
    last = f"mode_{len(tool.modes)}"
    parts = [Part("hammer", ImpactHammer, {"contact": settings.contact})]
    wires = []
    for number, (mode, factor) in enumerate(zip(tool.modes, tool.factors, strict=True), 1):
        # the tap goes along the normal: a mode of factor mu answers with mu/k
        values = {"frequency": mode.frequency, "damping": mode.damping, "stiffness": mode.stiffness, "force_angle": math.acos(factor)}
        parts.append(Part(f"mode_{number}", ToolMode, values))
        wires.append(Wire(f"mode_{number}.force", "hammer.force"))
        if number > 1:
            for name, output in (("before", "displacement"), ("before_rate", "velocity"), ("before_acceleration", "acceleration")):
                wires.append(Wire(f"mode_{number}.{name}", f"mode_{number - 1}.{output}"))
    band = {"bandwidth": _BAND * settings.rate}
    force = {**band, "noise": settings.force_noise, "range": settings.force_range}
    parts.append(Part("load_cell", SampledSensor.with_units({"signal": "N"}), force))
    wires.append(Wire("load_cell.measured", "hammer.force"))
    if settings.sensor == "accelerance":
        parts.append(Part("sensor", Accelerometer, {**band, "noise": settings.response_noise}))
        wires.append(Wire("sensor.measured", f"{last}.acceleration"))
    else:
        unit, output = ("m", "displacement") if settings.sensor == "receptance" else ("m/s", "velocity")
        parts.append(Part("sensor", SampledSensor.with_units({"signal": unit}), {**band, "noise": settings.response_noise}))
        wires.append(Wire("sensor.measured", f"{last}.{output}"))
    period = 1.0 / settings.rate
    recorded = ("load_cell.reading", "sensor.reading")
    return wire(Assembly(tuple(parts), tuple(wires), period, period / _steps(tool, settings), record=recorded))


def _steps(tool: ToolPoint, settings: TapSettings) -> int:
    """Return the RK4 steps of a sample."""
    fastest = 2.0 * math.pi * max(mode.frequency for mode in tool.modes) / settings.rate
    return min(max(math.ceil(fastest / _ANGLE_OF_A_STEP), _FEWEST_STEPS), _MOST_STEPS)


SECOND_PULSE = 0.04
"""Share of the first pulse from which a later one counts as a double hit."""
NOISE_LEVELS = 8.0
"""Standard deviations of the noise that a second pulse has to stand out by."""
_FLAT_TOP = 3
"""Equal samples at the top of a pulse that tell an overload."""
_FORCE_FLOOR = 0.01
"""The response is kept where the spectrum of the force is above this share of its largest."""
_USABLE_BAND = 0.25
"""Frequencies up to this share of the sample rate are kept: filters fall off above."""
_MARGIN = 12
"""Samples kept before and behind a pulse."""
_DIED_OUT = 3.0
"""A response has died out when its end is within so many times its noise."""
_LEFT_AT_END = 1e-3


@dataclass(frozen=True)
class Hit:
    """What was found of a hit: its number from 1, its peak [N], and why it is left out; nothing where it is kept."""

    number: int
    peak: float
    reason: str = ""


@dataclass(frozen=True, eq=False)
class TapEstimate:
    """The response by H1 with coherence and single hits, that by H2 (lines,), and what was found of each hit."""

    response: FrequencyResponse
    by_h2: Complex
    hits: tuple[Hit, ...]


def estimate_response(record: TapRecord) -> TapEstimate:
    """Return the response of the hits that can be used; :class:`RecordingError` where none can."""
    hits = judged_hits(record)
    good = [hit.number - 1 for hit in hits if not hit.reason]
    if not good:
        told = "; ".join(f"hit {hit.number}: {hit.reason}" for hit in hits)
        raise RecordingError(f"no hit can be used: {told}.", remedy="Tap again, once at a time and not too hard.")
    count = record.force.shape[1]
    rate = _window_rate(record, good)
    window = np.exp(-rate * np.arange(count) / record.rate)
    pulses = [_pulse(record.force[at]) for at in good]
    forces = np.zeros((len(good), count))
    for row, (at, (begin, end)) in enumerate(zip(good, pulses, strict=True)):
        forces[row, begin:end] = record.force[at, begin:end] * window[begin:end]
    noise = math.sqrt(sum(_noise(record.force[at]) ** 2 for at in good) / len(good))
    responses = (record.response[good] - _zero(record, good)[:, None]) * window
    frequency = np.asarray(np.fft.rfftfreq(count, 1.0 / record.rate), dtype=np.float64)
    f, x = np.fft.rfft(forces) / record.rate, np.fft.rfft(responses) / record.rate
    power = (np.abs(f) ** 2).sum(axis=0)
    keep = (frequency > 0.0) & (frequency <= _USABLE_BAND * record.rate)
    first_low = np.flatnonzero(keep & (power < _FORCE_FLOOR**2 * power.max()))
    if len(first_low):
        keep &= frequency < frequency[first_low[0]]
    frequency, f, x, power = frequency[keep], f[:, keep], x[:, keep], power[keep]
    cross, answer = (x * f.conj()).sum(axis=0), (np.abs(x) ** 2).sum(axis=0)
    coherence = np.abs(cross) ** 2 / np.maximum(power * answer, 1e-300) if len(good) > 1 else None

    def receptance(values: Any) -> Complex:
        return to_receptance(frequency, values, record.quantity)[1]

    response = FrequencyResponse(
        frequency,
        receptance(cross / power),
        coherence,
        np.stack([receptance(row) for row in x / f]),
        np.sqrt(power / len(good)),
        record.quantity,
        rate,
        max(end - begin for begin, end in pulses) / record.rate,
        _lead(forces, pulses) / record.rate,
        noise / math.sqrt(record.rate),
        "tap test",
        tuple(f"hit {hit.number} is left out: {hit.reason}" for hit in hits if hit.reason),
    )
    return TapEstimate(response, receptance(answer / np.where(cross == 0.0, 1.0, cross.conj())), hits)


def judged_hits(record: TapRecord) -> tuple[Hit, ...]:
    """Return the hits with what is wrong with each."""
    return tuple(_judged(record, number) for number in range(len(record.force)))


def _judged(record: TapRecord, number: int) -> Hit:
    """Return a hit with what is wrong with it."""
    force = record.force[number]
    top = int(np.argmax(force))
    peak = float(force[top])
    noise = _noise(force)
    if not peak > NOISE_LEVELS * noise or peak <= 0.0:
        return Hit(number + 1, peak, "no pulse stands out of the noise")
    if peak >= record.force_range * (1.0 - ROUNDING) or int(np.count_nonzero(force >= peak * (1.0 - ROUNDING))) >= _FLAT_TOP:
        return Hit(number + 1, peak, f"the force is overloaded at {peak:.0f} N")
    answer = record.response[number]
    highest = np.abs(answer).max()
    if int(np.count_nonzero(np.abs(answer) >= highest * (1.0 - ROUNDING))) >= _FLAT_TOP and highest > 0.0:
        return Hit(number + 1, peak, "the response is overloaded")
    again = _second_pulse(force, top, max(SECOND_PULSE * peak, NOISE_LEVELS * noise))
    if again is not None:
        fact = f"a second pulse of {force[again]:.0f} N follows {in_unit((again - top) / record.rate, 'ms', '.1f')} later"
        return Hit(number + 1, peak, fact)
    return Hit(number + 1, peak)


def _noise(signal: FloatArray) -> float:
    """Return the standard deviation of a signal's noise, by the median of what is mostly quiet."""
    return float(1.4826 * np.median(np.abs(signal - np.median(signal))))


def _second_pulse(force: FloatArray, top: int, level: float) -> int | None:
    """Return where a second pulse has its top, none where there is none; the first one has to have ended in between.

    The filter of a data logger rings after a short contact: each swing is smaller than the one to the other side before it. A further hit
    pushes the force up by more than it swung down before.
    """
    after = np.flatnonzero(force[top:] < level)
    before = np.flatnonzero(force[: top + 1] < level)
    if not len(after) or not len(before):
        return None
    end, begin = top + int(after[0]), int(before[-1])
    rest = force[end:].copy()
    early = force[:begin]
    swings = [0, *(np.flatnonzero(np.diff(np.signbit(rest))) + 1).tolist(), len(rest)]
    highest = [(int(np.argmax(np.abs(rest[a:b]))) + a) for a, b in itertools.pairwise(swings) if b > a]
    for before_it, at in itertools.pairwise([0, *highest]):
        if rest[at] > max(level, -rest[before_it]):
            return end + at
    return int(np.argmax(early)) if len(early) and early.max() > level else None


def _pulse(force: FloatArray) -> tuple[int, int]:
    """Return where the pulse and the ringing of its filter begin and end."""
    noise = _noise(force)
    top = int(np.argmax(force))
    loud = np.flatnonzero(np.abs(force) > max(TAP.noise * noise, TAP.ring * force[top]))
    around = loud[np.abs(loud - top) < max(TAP.least_near, int(TAP.near * len(force)))]
    return max(0, int(around[0]) - _MARGIN), min(len(force), int(around[-1]) + 1 + _MARGIN)


def _lead(forces: FloatArray, pulses: list[tuple[int, int]]) -> float:
    """Return how many samples before the middle of its pulse each hit is kept from, in the mean."""
    places = np.arange(forces.shape[1])
    middles = [float(places @ row) / float(row.sum()) for row in forces]
    return float(np.mean([middle - begin for middle, (begin, _) in zip(middles, pulses, strict=True)]))


def _zero(record: TapRecord, good: list[int]) -> FloatArray:
    """Return the mean of each response before its hit."""
    found = []
    for at in good:
        quiet = record.response[at, : max(0, int(np.argmax(record.force[at])) - 16)]
        found.append(float(quiet.mean()) if len(quiet) >= TAP.quiet else 0.0)
    return np.array(found)


def _window_rate(record: TapRecord, good: list[int]) -> float:
    """Return the rate of the exponential window [1/s]; 0 where all responses have died out at the end of their records."""
    count = record.force.shape[1]
    tail = max(16, count // 20)
    duration = count / record.rate
    needed = 0.0
    for at in good:
        top = int(np.argmax(record.force[at]))
        answer = record.response[at]
        quiet = answer[: max(0, top - 16)]
        noise = float(quiet.std()) if len(quiet) >= TAP.quiet else 1e-6 * float(np.abs(answer).max())
        end = float(answer[-tail:].std())
        largest = float(np.abs(answer).max())
        if end > _DIED_OUT * noise and end > _LEFT_AT_END * largest:
            needed = max(needed, math.log(end / max(noise, _LEFT_AT_END * largest)) / duration)
    return needed
