"""The cases of the campaign: which machine, what changes, when, and by how much."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import Prepared, prepare
from lathesim.live.opening import lesson_signals
from lathesim.live.samples import Signal
from lathesim.live.watching.residual_stream import ResidualStream
from lathesim.plugins import load_registry
from lathesim.record import FloatArray
from tests.live.campaign.machines import MACHINES, PERIOD

SEED = 20261124
SECONDS = 1200.0
_HERE = Path(__file__).parent
LESSONS = {"axis": "22_what_is_wrong_with_this_machine", "lathe": str(_HERE / "lathe.yaml"), "cut": str(_HERE / "cut.yaml")}
REFERENCE = {"friction": 5.0, "play": 3e-6, "gain": 0.05, "delay": 5e-4, "wear": 0.05, "load": 10.0}
"""A size of each change, from which that of so many floors follows."""
KINDS = {
    "axis": {
        "friction step": 3, "friction drift": 2, "play step": 2, "play drift": 2, "gain step": 2, "gain drift": 1, "delay step": 2,
        "load step": 2,
    },
    "lathe": {
        "friction step": 2, "friction drift": 2, "play step": 2, "play drift": 2, "gain step": 2, "gain drift": 1, "delay step": 2,
    },
    "cut": {"wear drift": 4, "wear step": 1, "chatter step": 3, "gain step": 2, "load step": 1},
}  # fmt: skip
"""How many of what changes; ``load`` is a force that jumps to and fro at random, which is not in the catalogue."""
SOUND = {"axis": 8, "lathe": 6, "cut": 6}
NAMES = {
    "friction": ("CoulombFriction",), "play": ("Backlash",), "gain": ("DriveGainError", "ScaleFactorError"),
    "delay": ("TransportDelay",), "wear": ("WearForceGrowth",), "chatter": ("RegenerativeChatter",), "load": (),
}  # fmt: skip
"""Names that are right."""


@dataclass(frozen=True)
class Case:
    """One stream: ``change`` is what changes (empty: sound), as a ``drift`` or a step, at ``begin`` [s], to so many ``floors``."""

    number: int
    machine: str
    change: str
    drift: bool
    begin: float
    floors: float
    seed: int


def all_cases(seed: int = SEED) -> list[Case]:
    """Return the sixty cases of a seed in an order drawn at random, so that the first of them are a fair share."""
    rng = np.random.default_rng(seed)
    plain = [(machine, "", False) for machine, count in SOUND.items() for _ in range(count)]
    for machine, kinds in KINDS.items():
        for kind, count in kinds.items():
            plain += [(machine, kind.split()[0], kind.endswith("drift"))] * count
    cases = []
    for place, at in enumerate(rng.permutation(len(plain))):
        machine, change, drift = plain[int(at)]
        begin = float(rng.uniform(300.0, 500.0) if drift else rng.uniform(300.0, 900.0))
        floors = float(rng.uniform(6.0, 12.0) if drift else rng.uniform(3.0, 6.0))
        cases.append(Case(place, machine, change, drift, begin, floors, (seed % 1_000_000) * 1000 + place))
    return cases


@cache
def prepared(machine: str) -> Prepared:
    """Return the lesson's machine that watches a machine."""
    return prepare(load_lesson(LESSONS[machine]), load_registry([]))


@cache
def channels(machine: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return what is driven and what is compared, in the order of the streams."""
    recordings = prepared(machine).case.lesson.settings.recordings
    assert recordings is not None
    return tuple(recordings.drive), tuple(recordings.compare)


@cache
def signals(machine: str) -> tuple[Signal, ...]:
    """Return the signals of a machine's stream."""
    known = {signal.name: signal for signal in lesson_signals(prepared(machine))}
    return tuple(known[name] for names in channels(machine) for name in names)


@cache
def floor(machine: str) -> FloatArray:
    """Return the floor of each compared channel [SI]: root mean square of the residual of a sound machine over 30 s, (channels,)."""
    drive, compare = channels(machine)
    values = MACHINES[machine](32.0, 7, {})
    residual = ResidualStream(prepared(machine), drive, compare, PERIOD).take(values)
    return np.asarray(np.sqrt(np.mean(residual.values[:, 2000:] ** 2, axis=1)))


@cache
def effect(machine: str, change: str, size: float) -> FloatArray:
    """Return what a change of a size does to each compared channel, root mean square [SI] without the noise, (channels,)."""
    drive, _ = channels(machine)
    run: Callable[..., FloatArray] = MACHINES[machine]
    count = round(42.0 / PERIOD)
    sound, other = run(42.0, 7, {}), run(42.0, 8, {})
    changed = run(42.0, 7, {change: shaped(change, np.full(count, size), 7)})
    part = (slice(len(drive), None), slice(2000, None))
    noise = 0.5 * np.mean((sound[part] - other[part]) ** 2, axis=1)
    square = np.mean((changed[part] - sound[part]) ** 2, axis=1)
    return np.asarray(np.sqrt(np.maximum(0.0, square - noise)))


def shaped(change: str, size: FloatArray, seed: int) -> FloatArray:
    """Return the course of what changes for the course of its size: factors about 1, or the size itself; a load jumps to and fro."""
    if change == "gain":
        return 1.0 + size
    if change != "load":
        return size
    rng = np.random.default_rng(seed)
    jumps = rng.random(len(size)) < 1.5 * PERIOD
    return np.asarray(size * np.where(np.cumsum(jumps) % 2, 1.0, -1.0))


def size_of(machine: str, change: str, floors: float) -> float:
    """Return the size of a change that moves the channel it moves most by so many floors.

    A limit cycle is as large as the chip, whatever the floor. Of chatter, the size is the depth of the deep passes over the border of
    stability: 1.3 at three floors, 1.6 at six.
    """
    if change == "chatter":
        return 1.0 + 0.1 * floors
    size = REFERENCE[change]
    for _ in range(4):
        most = float(np.max(effect(machine, change, size) / floor(machine)))
        size *= floors / max(most, 1e-3)
    return size


@dataclass(frozen=True, eq=False)
class Stream:
    """A stream and what is true of it: the tolerance of a channel and when it is reached, for a drift."""

    values: FloatArray
    channel: str
    tolerance: float
    reached: float


def stream_of(case: Case) -> Stream:
    """Return the stream of a case: warm-up in each, load changes in sound ones."""
    rng = np.random.default_rng(case.seed)
    count = round(SECONDS / PERIOD)
    time = np.arange(count) * PERIOD
    changes = {"viscous": 1.0 + rng.uniform(0.03, 0.10) * np.exp(-time / rng.uniform(100.0, 300.0))}
    load = np.ones(count)
    if not case.change:
        for at in np.sort(rng.uniform(150.0, 1100.0, 3)):
            load[time >= at] = 1.0 + rng.uniform(-0.04, 0.04)
    changes["mass"] = changes["hardness"] = load
    channel, tolerance, reached = "", 0.0, np.inf
    if case.change:
        size = size_of(case.machine, case.change, case.floors)
        course = np.where(time >= case.begin, size, 0.0)
        if case.drift:
            course = size * np.clip((time - case.begin) / (SECONDS - case.begin), 0.0, 1.0)
            done = effect(case.machine, case.change, 0.7 * size)
            most = int(np.argmax(done / floor(case.machine)))
            channel, tolerance = channels(case.machine)[1][most], float(done[most])
            reached = case.begin + 0.7 * (SECONDS - case.begin)
        changes[case.change] = shaped(case.change, course, case.seed)
    return Stream(MACHINES[case.machine](SECONDS, case.seed, changes), channel, tolerance, reached)
