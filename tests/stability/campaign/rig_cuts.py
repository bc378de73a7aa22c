"""Recordings of cuts on rigs drawn by number, by a generator of its own: exact steps of each mode under a force held constant.

Shares no code with the program. A rig has one to three modes, a sensor (force, acceleration or sound), noise, run-out and a hum of its own.
Rigs of the tuning half serve to derive and calibrate; those of the test half have other modes and are only measured.
"""

from __future__ import annotations

import cmath
import itertools
import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

KINDS = ("stable", "hopf", "flip", "forced", "segmentation", "mains", "entry")
_STEPS = 4
"""Steps of a sample."""


@dataclass(frozen=True)
class Rig:
    """Modes as (frequency [Hz], damping, stiffness [N/m]), the sensor, its sample rate [Hz], noise over the signal of a stable
    cut, roughness of the process, run-out over the feed, amplitude of the hum over the signal."""

    modes: tuple[tuple[float, float, float], ...]
    sensor: str
    rate: float
    sensor_noise: float
    roughness: float
    run_out: float
    hum: float
    mains: float


@dataclass(frozen=True)
class Recording:
    """A signal with its sample rate [Hz] and speed [rpm], what it is, when the cut begins [s], and how it was made."""

    signal: Any
    rate: float
    speed: float
    kind: str
    begins: float
    rig: Rig
    made: dict[str, float] = field(default_factory=dict)


def rig(number: int, half: str) -> Rig:
    """Return a rig; the modes of the test half lie elsewhere, and its sensors, noises and sample rates are drawn anew."""
    chance = np.random.default_rng((2029, number, 0 if half == "tuning" else 1))
    first = chance.uniform(60.0, 240.0) if half == "tuning" else chance.uniform(250.0, 800.0)
    modes = [(first, math.exp(chance.uniform(math.log(0.012), math.log(0.06))), chance.uniform(4e6, 2e7))]
    for _ in range(int(chance.integers(0, 3))):
        modes.append(
            (
                modes[-1][0] * chance.uniform(1.25, 2.4),
                math.exp(chance.uniform(math.log(0.012), math.log(0.06))),
                chance.uniform(1.2, 4.0) * modes[0][2],
            )
        )
    return Rig(
        tuple(modes),
        str(chance.choice(["force", "force", "acceleration", "sound"])),
        float(chance.choice([8000.0, 10000.0, 12800.0])) * (1.0 if half == "tuning" else 1.5),
        float(chance.uniform(0.02, 0.3)),
        float(chance.uniform(0.003, 0.015)),
        float(chance.uniform(0.0, 0.04)),
        float(chance.uniform(0.0, 0.05)),
        float(chance.choice([50.0, 60.0])),
    )


@dataclass
class _Cut:
    """What the simulation of a cut needs: gain b Ks [N/m], speed [rpm], share of the turn in the cut, feed [m], a ``width`` over time in
    samples (1 in full), noise of the force over its mean, eccentricity [m], exponent, and a force from outside [N] (samples,)."""

    gain: float
    speed: float
    share: float = 1.0
    feed: float = 1e-4
    width: Any = None
    roughness: float = 0.0
    run_out: float = 0.0
    exponent: float = 1.0
    outside: Any = None
    linear: bool = False
    start: float = 0.0


def simulated(made: Rig, cut: _Cut, count: int, chance: np.random.Generator) -> tuple[Any, Any, Any]:
    """Return force [N], displacement [m] and acceleration [m/s^2] of the tool, (count,) each."""
    dt = 1.0 / (made.rate * _STEPS)
    turn = max(8, round(60.0 / cut.speed / dt))
    edge = round(cut.share * turn)
    update = []
    for frequency, damping, stiffness in made.modes:
        w = 2.0 * math.pi * frequency
        pole = complex(-damping * w, w * math.sqrt(1.0 - damping * damping))
        # z = q' - conj(pole) q decays and turns by the pole; a constant force shifts its rest
        update.append((cmath.exp(pole * dt), pole, w * w / stiffness))
    states = [complex(cut.start * 1e3, 0.0) for _ in update]
    surface = [0.0] * turn
    force, place_of_tool, acceleration = np.zeros(count), np.zeros(count), np.zeros(count)
    jolts = (cut.roughness * chance.standard_normal(count)).tolist()
    widths = [1.0] * count if cut.width is None else cut.width.tolist()
    outside = [0.0] * count if cut.outside is None else cut.outside.tolist()
    wave = [cut.run_out * math.cos(2.0 * math.pi * at / turn) for at in range(turn)]
    gain, feed, power, linear = cut.gain, cut.feed, cut.exponent, cut.linear
    bent = power != 1.0
    rules = [(turned, pole, (turned - 1.0) / pole * push, 1.0 / pole.imag) for turned, pole, push in update]
    at, x, total = 0, 0.0, 0.0
    for sample in range(count):
        width, jolt, extra = gain * widths[sample], 1.0 + jolts[sample], outside[sample]
        total = 0.0
        for _ in range(_STEPS):
            before = surface[at]
            f = 0.0
            if linear:
                if at < edge:
                    f = width * (before - x)
                surface[at] = x
            else:
                h = feed + before - x + wave[at]
                if width > 0.0 and at < edge and h > 0.0:
                    f = width * (feed * (h / feed) ** power if bent else h) * jolt
                left = before + feed
                surface[at] = x if x < left else left
            f += extra
            x = 0.0
            for number, (turned, _, shift, over) in enumerate(rules):
                z = turned * states[number] + shift * f
                states[number] = z
                x += z.imag * over
            total += f
            at += 1
            if at == turn:
                at = 0
        force[sample], place_of_tool[sample] = total / _STEPS, x
    acceleration[1:-1] = np.diff(place_of_tool, 2) * made.rate**2
    return force, place_of_tool, acceleration


def smallest_gain(made: Rig, speed: float) -> float:
    """Return b Ks [N/m] at which an uninterrupted cut begins to chatter, by a scan of the characteristic equation."""
    f = np.linspace(20.0, 3.0 * max(mode[0] for mode in made.modes), 120_000)
    g = sum(1.0 / (k * (1.0 - (f / n) ** 2 + 2j * z * f / n)) for n, z, k in made.modes)
    d = -(1.0 - np.exp(-2j * np.pi * f * 60.0 / speed)) * g
    zero = np.flatnonzero(d.imag[:-1] * d.imag[1:] <= 0.0)
    return float(1.0 / np.maximum(d.real[zero], d.real[zero + 1]).max())


def linear_growth(made: Rig, cut: _Cut) -> tuple[float, float]:
    """Return the growth of a small difference a turn, and the correlation of the last turns with each other: -1 of a flip."""
    turns = 36
    count = int(turns * 60.0 / cut.speed * made.rate)
    trial = _Cut(cut.gain, cut.speed, cut.share, linear=True, start=1e-6)
    _, x, _ = simulated(made, trial, count, np.random.default_rng(0))
    size = int(60.0 / cut.speed * made.rate)
    rows = [np.interp((np.arange(size) + turn * 60.0 / cut.speed * made.rate), np.arange(count), x) for turn in range(18, turns - 1)]
    norms = np.array([np.linalg.norm(row) for row in rows])
    growth = float((norms[-1] / norms[0]) ** (1.0 / (len(norms) - 1)))
    pairs = [float(a @ b) / (np.linalg.norm(a) * np.linalg.norm(b)) for a, b in itertools.pairwise(rows)]
    return growth, float(np.mean(pairs))


def recording(kind: str, number: int, half: str) -> Recording:
    """Return a recording of a kind on the rig of a number."""
    made = rig(number, half)
    chance = np.random.default_rng((4058, number, KINDS.index(kind), 0 if half == "tuning" else 1))
    if kind == "flip":
        return _flip(made, chance)
    speed = _speed(made, chance)
    limit = smallest_gain(made, speed)
    cut = _Cut(limit * chance.uniform(0.25, 0.75), speed, feed=chance.uniform(0.06, 0.2) * 1e-3, roughness=made.roughness)
    cut.run_out = made.run_out * cut.feed
    cut.exponent = float(chance.choice([1.0, 0.75]))
    if cut.exponent < 1.0:
        cut.gain /= 0.75  # the slope at the feed is what counts
    turns = 60.0 / speed
    lasting = float(chance.uniform(max(1.5, 25.0 * turns), max(2.0, 45.0 * turns)))
    air = float(chance.choice([0.0, 0.0, 0.4]))
    if kind in ("hopf", "entry"):
        return _begun(kind, made, cut, lasting, air, chance)
    settling = max(0.8, max(8.0 / (2.0 * math.pi * mode[0] * mode[1]) for mode in made.modes))  # the entry has died out
    count = int((settling + lasting) * made.rate)
    skip = count - int(lasting * made.rate)
    plain = _read(made, [row[skip:] for row in simulated(made, cut, count, chance)])
    if kind in ("stable", "mains"):
        while made.sensor != "force" and _order_share(plain, made.rate, speed) > 0.15:  # else it would be a forced vibration
            cut.run_out *= 0.5
            plain = _read(made, [row[skip:] for row in simulated(made, cut, count, chance)])
    outside = _orders(cut, count, made.rate, chance) if kind == "forced" else _segments(made, cut.gain * cut.feed, count, chance)
    if kind == "forced":
        cut.run_out = cut.feed * chance.uniform(0.15, 0.7)
    signals = [row[skip:] for row in simulated(made, cut, count, chance)]
    if kind in ("forced", "segmentation"):
        cut.outside = outside
        while True:  # what gives a recording its name dominates it
            signals = [row[skip:] for row in simulated(made, cut, count, chance)]
            read = _read(made, signals)
            share = _order_share(read, made.rate, speed) if kind == "forced" else 1.0 - np.var(plain) / np.var(read)
            if share > (0.5 if kind == "forced" else 0.75):
                break
            cut.outside = 2.0 * cut.outside
    return _sensed(kind, made, cut, signals, 0.0, chance)


def _orders(cut: _Cut, count: int, rate: float, chance: np.random.Generator) -> Any:
    """Return a force at orders 2 and above of the spindle."""
    time = np.arange(count) / rate
    mean = cut.gain * cut.feed
    orders = range(2, int(chance.integers(3, 6)))
    return sum(mean * chance.uniform(0.03, 0.2) * np.cos(2.0 * np.pi * n * time * cut.speed / 60.0 + chance.uniform(0, 6)) for n in orders)


def _order_share(signal: Any, rate: float, speed: float) -> float:
    """Return the share of the power that repeats from turn to turn, by averaging over turns."""
    turn = rate * 60.0 / speed
    turns = int(len(signal) / turn)
    places = (np.arange(turns)[:, None] + np.arange(int(turn))[None, :] / int(turn)) * turn
    rows = np.interp(places, np.arange(len(signal)), signal - signal.mean())
    return float((rows.mean(axis=0).var() - rows.var(axis=0).mean() / turns) / rows.var())


def _read(made: Rig, signals: list[Any]) -> Any:
    """Return what the sensor of a rig would read without noise."""
    signal = signals[0 if made.sensor == "force" else 2].copy()
    signal[[0, -1]] = signal[[1, -2]]
    return np.convolve(signal, np.ones(3) / 3.0, "same") if made.sensor == "sound" else signal


def _speed(made: Rig, chance: np.random.Generator) -> float:
    """Return a speed [rpm] at which neither 50 nor 60 Hz nor their first multiples are whole orders."""
    while True:
        speed = float(chance.uniform(500.0, 3600.0))
        orders = [made.mains * multiple * 60.0 / speed for multiple in (1, 2, 3)]
        if all(abs(order - round(2.0 * order) / 2.0) > 0.06 for order in orders):
            return _whole_steps(made, speed)


def _whole_steps(made: Rig, speed: float) -> float:
    """Return the speed [rpm] near one at which a turn is a whole number of steps, so that what is told is what is simulated."""
    steps = made.rate * _STEPS * 60.0
    return steps / round(steps / speed)


def _begun(kind: str, made: Rig, cut: _Cut, lasting: float, air: float, chance: np.random.Generator) -> Recording:
    """Return a cut that chatters, or whose entry rings: recorded from the beginning of the cut, or once chatter has set in."""
    speed = cut.speed
    lead = int(air * made.rate)
    count = lead + int(lasting * made.rate)
    cut.width = np.ones(count)
    cut.width[:lead] = 0.0
    if kind == "entry":
        begun = max(lead, int(0.02 * made.rate))
        cut.width[:begun] = 0.0
        interrupted = chance.random() < 0.5 and made.sensor != "force"
        slowest = min(mode[0] * mode[1] for mode in made.modes)
        if interrupted and 2.0 * math.pi * slowest * 0.4 * 60.0 / speed > 3.0:
            cut.share = float(chance.uniform(0.4, 0.6))
            cut.gain *= 0.5
        else:
            cut.roughness *= 0.3
            cut.run_out *= 0.2
        return _sensed(kind, made, cut, list(simulated(made, cut, count, chance)), begun / made.rate, chance)
    cut.gain *= chance.uniform(1.12, 1.9) / (cut.gain / smallest_gain(made, speed) * (0.75 if cut.exponent < 1.0 else 1.0))
    late = chance.random()
    if late < 0.2:  # the cut widens: it is stable first
        cut.width[lead:] = np.where(np.arange(count - lead) < 0.4 * (count - lead), 0.3, 1.0)
    for _ in range(4):
        signals = simulated(made, cut, count, chance)
        end = signals[1][-int(0.2 * made.rate) :]
        if np.ptp(end) > cut.feed:
            break
        cut.gain *= 1.15
    if late > 0.8:  # recorded once it has set in
        begun = count // 2
        return _sensed(kind, made, cut, [row[begun:] for row in signals], 0.0, chance)
    return _sensed(kind, made, cut, list(signals), lead / made.rate, chance)


def _flip(made: Rig, chance: np.random.Generator) -> Recording:
    """Return an interrupted cut of one mode that loses its stability by a flip."""
    one = Rig(made.modes[:1], made.sensor, made.rate, made.sensor_noise, made.roughness, made.run_out, made.hum, made.mains)
    natural = one.modes[0][0]
    while True:
        found = _flipped(one, natural, chance)
        if found is not None:
            return found


def _flipped(one: Rig, natural: float, chance: np.random.Generator) -> Recording | None:
    """Return a recording of a flip, none where the vibration did not stay one as it became large."""
    while True:
        speed = _whole_steps(one, 60.0 * natural / float(chance.uniform(1.05, 2.6)))
        cut = _Cut(0.0, speed, float(chance.uniform(0.15, 0.5)), chance.uniform(0.06, 0.2) * 1e-3, roughness=one.roughness)
        for factor in (2.0, 4.0, 8.0, 14.0):
            cut.gain = factor * smallest_gain(one, speed)
            growth, alike = linear_growth(one, cut)
            if growth > 1.03:
                break
        if 1.03 < growth < 1.5 and alike < -0.98:
            break
    cut.run_out = one.run_out * cut.feed
    count = int(max(1.5, 30.0 * 60.0 / speed) * one.rate)
    for _ in range(3):
        signals = simulated(one, cut, count, chance)
        if growth ** (count / one.rate * speed / 60.0) > 1e4:
            break
        count *= 2
    count, size = len(signals[1]), 60.0 / speed * one.rate
    rows = [np.interp(count - 1 - (turn + np.arange(int(size)) / int(size)) * size, np.arange(count), signals[1]) for turn in range(9)]
    changes = np.diff(np.array(rows), axis=0)
    alike = (changes[1:] * changes[:-1]).sum(axis=1) / np.sqrt((changes[1:] ** 2).sum(axis=1) * (changes[:-1] ** 2).sum(axis=1))
    if np.mean(alike) > -0.9:
        return None
    return _sensed("flip", one, cut, list(signals), 0.0, chance)


def _segments(made: Rig, mean: float, count: int, chance: np.random.Generator) -> Any:
    """Return the force of chips that break in segments: a saw tooth for each, of lengths that differ by some per cent."""
    frequency = float(chance.uniform(120.0, 0.1 * made.rate))
    scatter = float(chance.uniform(0.05, 0.15))
    lengths = np.maximum(0.4, 1.0 + scatter * chance.standard_normal(int(1.5 * count / made.rate * frequency) + 20)) / frequency
    ends = np.cumsum(lengths)
    time = np.arange(count) / made.rate
    which = np.searchsorted(ends, time)
    inside = 1.0 - (ends[which] - time) / lengths[which]
    sizes = 1.0 + 0.15 * chance.standard_normal(len(lengths))
    return mean * chance.uniform(0.15, 0.4) * sizes[which] * (inside - 0.5)


def _sensed(kind: str, made: Rig, cut: _Cut, signals: list[Any], begins: float, chance: np.random.Generator) -> Recording:
    """Return what the sensor of the rig reads, with its noise and hum."""
    signal = _read(made, signals)
    count = len(signal)
    time = np.arange(count) / made.rate
    inside = time >= begins
    usual = (
        float(np.median(np.abs(signal[inside] - np.median(signal[inside]))))
        if kind in ("hopf", "flip", "entry")
        else float(signal[inside].std())
    )
    if made.sensor == "force":
        usual = min(usual, 0.02 * cut.gain * cut.feed) if kind != "segmentation" else 0.02 * cut.gain * cut.feed
    noise = made.sensor_noise * usual * chance.standard_normal(count)
    if made.sensor == "sound":
        rumble = np.cumsum(chance.standard_normal(count))
        rumble -= np.convolve(np.pad(rumble, 400, mode="edge"), np.ones(801) / 801.0, "valid")
        noise += made.sensor_noise * usual * rumble / rumble.std()
    level = usual * (float(chance.uniform(1.2, 4.0)) if kind == "mains" else made.hum)
    frequency = made.mains * (1.0 + 0.001 * chance.uniform(-1.0, 1.0))
    hum = np.cos(2.0 * np.pi * frequency * time + chance.uniform(0, 6))
    hum += chance.uniform(0.1, 0.8) * np.cos(2.0 * np.pi * frequency * int(chance.integers(2, 4)) * time + chance.uniform(0, 6))
    told = {"gain": cut.gain, "share": cut.share, "feed": cut.feed, "exponent": cut.exponent}
    return Recording(signal + noise + level * math.sqrt(2.0) * hum, made.rate, cut.speed, kind, begins, made, told)
