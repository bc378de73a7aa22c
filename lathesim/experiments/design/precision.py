"""The program that makes values known as well as possible: D-, A- or E-optimality, over what is uncertain, per second."""

from __future__ import annotations

import dataclasses
import json
import math
import threading
import time as clock
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.engine.assembly import FloatArray
from lathesim.experiments.design.experiment import Wish
from lathesim.experiments.design.families import Candidate, candidates, strokes_in_turn
from lathesim.experiments.design.laying import Laid, lay_candidate, lay_those_that_fit
from lathesim.experiments.design.optimality import criterion_value
from lathesim.experiments.design.room import Room, room_of
from lathesim.experiments.emulation.free_values import FreeValue, free_values, values_of
from lathesim.experiments.hidden_directions import Telling, telling
from lathesim.experiments.replica import Replica, Setting
from lathesim.lessons.changed_lesson import changed_lesson
from lathesim.lessons.lesson import Lesson
from lathesim.lessons.recording_mapping import mapping_of
from lathesim.lessons.simulate import Prepared, prepare
from lathesim.plugins import Registry

SCHEMA = "lathesim-experiment/1"
_STEP = 1e-3
_NOISE = 10e-6
"""Noise [m] of a channel of which the lesson tells no resolution; assumed."""
_EXCHANGES = 3
_AVERAGED = 5
"""So many of the best programs are held against each other over all draws."""


@dataclass(frozen=True, eq=False)
class Precise:
    """The best program for precision, what it tells, and the criterion of every program that was tried."""

    lesson: Lesson
    program: Laid
    room: Room
    criterion: str
    value: float
    told: Telling
    free: tuple[FreeValue, ...]
    tried: tuple[tuple[str, float, float], ...]
    noise: dict[str, float]
    rate: float
    runs: int
    wall_time: float
    stopped: bool


def design_for_precision(
    lesson: Lesson, names: Sequence[str], registry: Registry, wish: Wish, criterion: str, variant: str | None,
    say: Callable[[str], None], stop: threading.Event | None = None,
) -> Precise:  # fmt: skip
    """Return the program that makes the named values known best, within the limits of the lesson.

    ``all`` names everything that the lesson calls uncertain. The information is that of the mapped channels at the rate of the recording,
    with the resolution as noise, added to what the lesson knows; averaged over values drawn within a standard deviation.
    """
    began = clock.perf_counter()
    prepared = prepare(lesson, registry, variant)
    mapping = mapping_of(lesson, prepared.machinery)
    free = free_values(lesson, prepared.plan, () if list(names) == ["all"] else names, 4.0, "--for")
    room = room_of(prepared)
    channels = mapping.targets("compare")
    noise = {signal.target: signal.resolution or _NOISE for signal in mapping.signals if signal.role == "compare"}
    rate = wish.rate or mapping.rate or 1.0 / prepared.machinery.sample_period
    bench = PrecisionBench(prepared, room, free, channels, noise, rate, wish, criterion, stop)
    strokes = strokes_in_turn(room, wish.at_most, wish.candidates // 2, wish.seed)
    mixtures = candidates(room, wish.at_most, wish.candidates, wish.seed, arcs=wish.arcs)
    found = lay_those_that_fit([*strokes, *mixtures], room, wish.at_most)[: wish.candidates]
    say(f"{len(free)} values. Trying {len(found)} programs ...")
    judged: list[tuple[Laid, float]] = []
    all_judged: list[tuple[Laid, float]] = []
    stopped = False
    try:
        for program in found:
            judged.append((program, bench.value(program)))
            if len(judged) % 20 == 0:
                say(f"  {len(judged)} of {len(found)}; the best has {criterion} = {max(value for _, value in judged):.4g}")
        judged = bench.improved(judged, say)
        if wish.conditions.average:
            all_judged = list(judged)
            best = sorted(judged, key=lambda pair: -pair[1])[:_AVERAGED]
            judged = [(item, bench.value(item, wish.draws)) for item, _ in best]
    except KeyboardInterrupt:
        if not judged:
            raise
        stopped = True
        if stop is not None:
            stop.clear()
    program, value = max(judged, key=lambda pair: pair[1])
    told = bench.told(program)
    tried = tuple((item.candidate.title, item.seconds, size) for item, size in all_judged or judged)
    return Precise(
        lesson, program, room, criterion, value, told, tuple(free), tried, noise, rate, bench.runs, clock.perf_counter() - began, stopped
    )


class PrecisionBench:
    """Information of programs about the free values of one machine."""

    def __init__(
        self, prepared: Prepared, room: Room, free: Sequence[FreeValue], channels: Sequence[str], noise: dict[str, float], rate: float,
        wish: Wish, criterion: str, stop: threading.Event | None,
    ) -> None:  # fmt: skip
        self.prepared, self.room, self.free, self.channels, self.stop = prepared, room, list(free), tuple(channels), stop
        self.noise = np.array([noise[name] for name in channels])
        self.rate, self.criterion, self.wish = rate, criterion, wish
        self.runs = 0
        self.prior = np.diag([1.0 / item.spread**2 for item in free])
        random = np.random.default_rng(wish.seed)
        draws = max(1, wish.draws)
        spread = np.array([item.spread for item in free])
        self.points = [np.zeros(len(free)), *[0.5 * spread * random.standard_normal(len(free)) for _ in range(draws - 1)]]

    def lay(self, candidate: Candidate) -> Laid:
        """Return a candidate as path."""
        return lay_candidate(candidate, self.room)

    def slopes(self, program: Laid, point: FloatArray) -> tuple[FloatArray, Callable[[FloatArray], FloatArray]]:
        """Return the derivatives of all readings in noise levels (readings, values), and what reads the machine elsewhere."""
        assembly = self.prepared.machinery
        parts = tuple(
            dataclasses.replace(part, tables={**part.tables, "path": program.table}) if part.name == self.room.interpolator.name else part
            for part in assembly.parts
        )
        machine = dataclasses.replace(assembly, parts=parts)
        times = np.arange(0.0, program.seconds, 1.0 / self.rate)
        replica = Replica([Setting("design", machine, self.channels, times)], [item.name for item in self.free], self.stop)

        def read(points: FloatArray) -> FloatArray:
            found = replica.readings(values_of(self.free, points))[0] / self.noise[None, :, None]
            self.runs += len(points)
            return np.asarray(np.nan_to_num(found.reshape(len(found), -1)))

        steps = _STEP * np.eye(len(self.free))
        moved = read(np.vstack([point + steps, point - steps]))
        count = len(self.free)
        return np.asarray((moved[:count] - moved[count:]).T / (2.0 * _STEP)), read

    def value(self, program: Laid, draws: int = 1) -> float:
        """Return the criterion of a program, the mean over the first draws."""
        if self.stop is not None and self.stop.is_set():
            raise KeyboardInterrupt
        found = []
        for point in self.points[:draws]:
            slopes, _ = self.slopes(program, point)
            found.append(criterion_value(slopes.T @ slopes + self.prior, self.criterion))
        return float(np.mean(found))

    def improved(self, judged: list[tuple[Laid, float]], say: Callable[[str], None]) -> list[tuple[Laid, float]]:
        """Join the best programs piece by piece where both fit into the time, and keep what is better."""
        for turn in range(_EXCHANGES):
            order = sorted(judged, key=lambda pair: -pair[1])[:4]
            best = order[0]
            for other, _ in order[1:]:
                for share in (0.35, 0.65):
                    joined = _joined(best[0].candidate, other.candidate, self.room, self.wish.at_most, share)
                    if joined is None:
                        continue
                    program = self.lay(joined)
                    judged.append((program, self.value(program)))
            now = max(judged, key=lambda pair: pair[1])
            say(f"  joined, round {turn + 1}: {self.criterion} = {now[1]:.4g}")
            if now is best:
                break
        return judged

    def told(self, program: Laid) -> Telling:
        """Return what the program tells of the values, at the given ones."""
        slopes, read = self.slopes(program, self.points[0])
        here = read(np.zeros((1, len(self.free))))[0]
        return telling([item.name for item in self.free], slopes, lambda points: np.abs(read(points) - here).max(axis=1))


def _joined(first: Candidate, second: Candidate, room: Room, at_most: float, share: float) -> Candidate | None:
    """Return the beginning of one program with another behind it, within the time; none where little of both would be left."""
    moves, seconds = [], 0.0
    place = {axis.letter: axis.start for axis in room.axes}
    for part, budget in ((first, share * at_most), (second, at_most)):
        for move in part.moves:
            way = math.hypot(*(move.to[letter] - place[letter] for letter in move.to if letter in place)) if move.to else 0.0
            takes = move.rest or room.time(way, move.speed or 1.0)
            if seconds + takes > budget:
                break
            moves.append(dataclasses.replace(move, radius=0.0))
            place |= {letter: value for letter, value in move.to.items() if letter in place}
            seconds += takes
    if seconds < 0.5 * at_most:
        return None
    return Candidate(f"{first.title}; {second.title}", tuple(moves), seconds)


def as_json(found: Precise) -> dict[str, Any]:
    """Return the design for programs."""
    loose = dict(found.told.loose)
    return {
        "schema": SCHEMA,
        "lesson": found.lesson.name,
        "program": "program.nc",
        "seconds": found.program.seconds,
        "criterion": found.criterion,
        "value": found.value,
        "known_to_10_percent": found.told.known,
        "information": found.told.information,
        "singular_values": [float(size) for size in found.told.singular],
        "hidden": [item.sentence for item in found.told.hidden],
        "values": {
            item.name: {"relative_error": loose.get(item.name), "known_to_10_percent": item.name not in loose} for item in found.free
        },
        "record": [{"channel": name, "at_least_hz": found.rate, "noise": size} for name, size in found.noise.items()],
        "tried": len(found.tried),
        "best_of_tried": max(value for _, _, value in found.tried),
        "runs": found.runs,
        "wall_time_s": found.wall_time,
        "stopped": found.stopped,
    }


def write_precision(found: Precise, folder: Path) -> dict[str, Any]:
    """Write program.nc, lesson.yaml and prediction.json into a folder, and return the last."""
    told = as_json(found)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "program.nc").write_text(found.program.text, encoding="utf-8")
    further: dict[str, Any] = {"variants": {}, "try": [], "goals": []}
    if found.room.needs_duration:
        further["duration"] = f"{np.ceil(10.0 * found.program.seconds) / 10.0:.1f} s"
    text = changed_lesson(found.lesson, [], {}, folder, program=folder / "program.nc", further=further)
    (folder / "lesson.yaml").write_text(text, encoding="utf-8")
    (folder / "prediction.json").write_text(json.dumps(told, indent=2), encoding="utf-8")
    return told


def precision_lines(found: Precise, folder: Path) -> Iterator[str]:
    """Yield the design as a person reads it at a terminal."""
    if found.stopped:
        yield "Stopped: this is the best program so far."
    yield f"Program: {found.program.candidate.title}, {found.program.seconds:.1f} s; {found.criterion} = {found.value:.4g}."
    yield f"{found.told.known} of {len(found.free)} combinations of values would be known to 10 % or better."
    yield from (item.sentence for item in found.told.hidden)
    yield f"{len(found.tried)} programs, {found.runs} runs, {found.wall_time:.1f} s."
    yield f"Run {folder / 'program.nc'}."
