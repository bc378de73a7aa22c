"""The program that makes values known as well as possible: D-, A-, E- or V-optimality, over what is uncertain, per second.

What a design for precision is for, and what is known before it: programs that will be run, and programs that were recorded.

The variance of what a machine will read on programs that will be run, J_u their derivatives and M the information, both in noise levels, is

    v = mean diag (J_u M^-1 J_u')

A design that makes v small is V-optimal; values that no such program shows may stay unknown. A structure that is not quite right errs
where the machine has something to show: a reading which the values' own uncertainty s would move by g = |J s| counts as much as one of
variance 1 + b^2 g^2. Source: Atkinson, Donev, Tobias, Optimum Experimental Designs (2007), section 10.6.

The precision of a design: what measured settings say about values, by the criteria D, A and E.

The information of weights w over settings with regressors f_i is M = sum w_i f_i f_i' (+ prior); D makes ln det M largest, A the trace of
its inverse smallest, E its smallest eigenvalue largest. A singular M is never inverted: the combination that does not show is named.

Source: Atkinson, Donev, Tobias, Optimum Experimental Designs (2007), chapters 9 to 11.
"""

from __future__ import annotations

import math
import threading
import time as clock
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.engine.assembly import FloatArray
from lathesim.errors import LatheSimError
from lathesim.experiments.candidate_programs import Laid, lay_those_that_fit, lay_what_fits, neighbours, walking_time
from lathesim.experiments.design_experiment import DesignWish, write_design
from lathesim.experiments.families import candidates, strokes_in_turn
from lathesim.experiments.free_values import FreeValue, Telling, bounds, free_values, telling, values_of
from lathesim.experiments.replica import NOBODY, Listener, ProgramRuns, Say, Search
from lathesim.experiments.room import Room, room_of
from lathesim.json_text import parsed_json, written_json
from lathesim.lessons.lesson import Lesson, find_program
from lathesim.lessons.program_path import path_of_program, start_of
from lathesim.lessons.recording_mapping import mapping_of
from lathesim.lessons.simulate import Prepared, prepare
from lathesim.path_columns import DWELL, DWELL_PAUSE, FEED, KIND, LENGTH
from lathesim.plugins import Registry
from lathesim.whole_file import write_text

_SINGULAR = 1e-12
"""Ratio of eigenvalues below which information is singular."""
_TINY = 1e-300
_LOOKS = 10
"""Turns after which the gain is looked at."""


def criterion_value(matrix: FloatArray, criterion: str) -> float:
    """Return ln det (D), minus the trace of the inverse (A) or the smallest eigenvalue (E); minus infinity where D or A has none."""
    values = np.linalg.eigvalsh(matrix)
    if criterion == "E":
        return float(values[0])
    if values[0] <= _SINGULAR * max(float(values[-1]), _TINY):
        return -np.inf
    return float(np.log(values).sum()) if criterion == "D" else float(-(1.0 / values).sum())


_AFTER = 0.3
"""Time [s] that is read after the end of a program."""


@dataclass(frozen=True, eq=False)
class Ready:
    """A part program of a file as path table, how long it is read [s], and its largest feed [m/s]."""

    table: FloatArray
    seconds: float
    fastest: float


@dataclass(frozen=True)
class KnownBefore:
    """What an emulation leaves for the next design: programs that were recorded, and b, the share by which the structure errs."""

    programs: tuple[Path, ...] = ()
    error: float = 0.0


def before_design(file: Path, lesson: Lesson) -> KnownBefore:
    """Return what an ``emulation.json`` tells. Raises :class:`LatheSimError` where the file is none, or its programs are gone."""
    try:
        told = parsed_json(file.read_text(encoding="utf-8"))
        if not str(told["schema"]).startswith("lathesim-emulation/"):
            raise KeyError("schema")
        programs = [item["program"] for item in told["recordings"] if item["program"]]
        error = float(told["model_error_share"])
    except (OSError, ValueError, KeyError, TypeError):
        raise LatheSimError("this is no emulation.", place=str(file), remedy="Give the emulation.json of 'lathesim emulate'.") from None
    found = [find_program(name, lesson.path.parent) for name in programs]
    if None in found:
        missing = programs[found.index(None)]
        raise LatheSimError(f"the part program '{missing}' is not there any more.", place=str(file), remedy="Emulate the machine again.")
    return KnownBefore(tuple(path for path in found if path is not None), error)


def programs_to_run(lesson: Lesson) -> list[Path]:
    """Return the part programs that a machine will run: that of the lesson and those of its variants."""
    settings = lesson.settings
    named = [settings.program, *(item.program for item in settings.variants.values())]
    found = [find_program(name, lesson.path.parent) for name in named if name]
    return list(dict.fromkeys(path for path in found if path is not None))


def ready(file: Path, lesson: Lesson, room: Room) -> Ready:
    """Return a part program as path table, with about how long it takes."""
    table = path_of_program(file, lesson.settings.dialect, start=start_of(lesson.machine)).table
    seconds = sum(
        float(row[DWELL]) if row[KIND] == DWELL_PAUSE else room.time(float(row[LENGTH]), float(row[FEED]) or room.feed) for row in table
    )
    return Ready(table, seconds + _AFTER, float(table[table[:, KIND] != DWELL_PAUSE, FEED].max(initial=0.0)) or room.feed)


def discounted(slopes: FloatArray, spread: FloatArray, error: float) -> FloatArray:
    """Return derivatives (readings, values) in the noise levels that the structure's share of error leaves."""
    return np.asarray(slopes / np.sqrt(1.0 + error**2 * np.square(slopes * spread).sum(axis=1))[:, None])


def mean_variance(aims: FloatArray, matrix: FloatArray) -> float:
    """Return v, the mean variance of readings with derivatives ``aims`` (readings, values) under information (values, values)."""
    return float(np.einsum("ij,ji->i", aims, np.linalg.solve(matrix, aims.T)).mean())


SCHEMA = "lathesim-experiment/1"
_STEP = 1e-3
_NOISE = 10e-6
"""Noise [m] of a channel of which the lesson tells no resolution; assumed."""
_BATCH = 20
"""Programs of one batch, so that progress is told and Ctrl-C heard."""
_NEIGHBOURS = 8
"""Programs that are tried in such a round."""
_AVERAGED = 5
"""So many of the best programs are held against each other over all draws."""


@dataclass(frozen=True)
class Readout:
    """What is read of a machine: the ``noise`` [SI] of each channel, and how often a second."""

    noise: Mapping[str, float]
    rate: float


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
    readout: Readout
    search: Search


def design_for_precision(
    lesson: Lesson, names: Sequence[str], registry: Registry, wish: DesignWish, variant: str | None = None,
    listener: Listener = NOBODY, before: KnownBefore | None = None,
) -> Precise:  # fmt: skip
    """Return the program that makes the named values known best, within the limits of the lesson.

    ``all`` names everything that the lesson calls uncertain. The information is that of the mapped channels at the rate of the recording,
    with the resolution as noise, added to what the lesson and the programs recorded ``before`` know; averaged over values drawn within a
    standard deviation. V makes known what the programs of the lesson will read, and goes no faster than
    they do.
    """
    began = clock.perf_counter()
    prepared = prepare(lesson, registry, variant)
    mapping = mapping_of(lesson, prepared.machinery)
    free = free_values(lesson, prepared.plan, () if list(names) == ["all"] else names, 4.0, "--for")
    room = room_of(prepared)
    noise = {signal.target: signal.resolution or _NOISE for signal in mapping.signals if signal.role == "compare"}
    readout = Readout(noise, wish.rate or mapping.rate or 1.0 / prepared.machinery.sample_period)
    aims = [ready(path, lesson, room) for path in programs_to_run(lesson)] if wish.criterion == "V" else []
    if wish.criterion == "V" and not aims:
        raise LatheSimError("the lesson has no part program to predict.", place="--criterion", remedy="Take D, A or E.")
    if aims:  # a structure that is not quite right errs most at speeds that none of these programs uses
        room = replace(room, feed=min(room.feed, max(item.fastest for item in aims)))
    bench = PrecisionBench(prepared, room, free, readout, wish, listener.stop, aims, before)
    walking = walking_time(wish.at_most)
    strokes = strokes_in_turn(room, walking, wish.candidates // 2, wish.seed)
    mixtures = candidates(room, walking, wish.candidates, wish.seed, arcs=wish.arcs)
    found = lay_those_that_fit([*strokes, *mixtures], room, wish.at_most)[: wish.candidates]
    listener.say(f"{len(free)} values. Trying {len(found)} programs ...")
    judged, averaged, stopped = _searched(bench, found, listener)
    all_judged, judged = [*judged, *averaged], averaged or judged
    program, value = max(judged, key=lambda pair: pair[1])
    told = bench.told(program)
    tried = tuple((item.candidate.title, item.seconds, size) for item, size in all_judged)
    search = Search(bench.machine.runs, clock.perf_counter() - began, stopped, tried)
    return Precise(lesson, program, room, wish.criterion, value, told, tuple(free), readout, search)


def _searched(
    bench: PrecisionBench, found: list[Laid], listener: Listener
) -> tuple[list[tuple[Laid, float]], list[tuple[Laid, float]], bool]:
    """Return the programs with their sizes: all at the given values, the best over all draws; and whether Ctrl-C ended the search."""
    judged: list[tuple[Laid, float]] = []
    averaged: list[tuple[Laid, float]] = []
    stopped = False
    try:
        for first in range(0, len(found), _BATCH):
            some = found[first : first + _BATCH]
            judged += zip(some, bench.values(some, central=False), strict=True)
            listener.say(f"  {len(judged)} of {len(found)}; the best has {bench.wish.criterion} = {max(value for _, value in judged):.4g}")
        draws = bench.wish.draws if bench.wish.conditions.average else 1
        best = [program for program, _ in sorted(judged, key=lambda pair: -pair[1])[:_AVERAGED]]
        averaged = list(zip(best, bench.values(best, draws), strict=True))
        for step in exchanges(bench, max(averaged, key=lambda pair: pair[1]), draws, listener.say):
            averaged.append(step)
    except KeyboardInterrupt:
        if not judged:
            raise
        stopped = True
        if listener.stop is not None:
            listener.stop.clear()
    return judged, averaged, stopped


def exchanges(
    bench: PrecisionBench, best: tuple[Laid, float], draws: int, say: Say
) -> Iterator[tuple[Laid, float]]:  # fmt: skip
    """Yield ever better programs: strokes of the best one are exchanged, round by round.

    All neighbours are judged at the given values; the best of them takes the place only if it is better over all draws too.
    """
    at_most, random = bench.wish.at_most, np.random.default_rng([bench.wish.seed, 3])
    here = bench.values([best[0]], central=False)[0]
    for turn in range(bench.wish.exchanges):
        near = neighbours(best[0].candidate, bench.room, walking_time(at_most), random, _NEIGHBOURS)
        tried = lay_what_fits(near, bench.room, at_most)
        sizes = bench.values(tried, central=False)
        place = int(np.argmax(sizes)) if sizes else 0
        if sizes and sizes[place] > here:
            value = bench.values([tried[place]], draws)[0]
            if value > best[1]:
                here, best = sizes[place], (tried[place], value)
                yield best
        if turn % _LOOKS == _LOOKS - 1:
            say(f"  {turn + 1} of {bench.wish.exchanges} exchanges; {bench.wish.criterion} = {best[1]:.4g}")


class PrecisionBench:
    """Information of programs about the free values of one machine."""

    def __init__(
        self, prepared: Prepared, room: Room, free: Sequence[FreeValue], readout: Readout, wish: DesignWish,
        stop: threading.Event | None = None, aims: Sequence[Ready] = (), before: KnownBefore | None = None,
    ) -> None:  # fmt: skip
        self.prepared, self.room, self.free, self.wish, self.stop = prepared, room, list(free), wish, stop
        self.noise = np.array(list(readout.noise.values()))
        names = [item.name for item in free]
        lesson = prepared.case.lesson
        before = before or KnownBefore()
        self.aims, self.recorded, self.error = tuple(aims), [ready(path, lesson, room) for path in before.programs], before.error
        longest = max([wish.at_most, *(item.seconds for item in (*self.aims, *self.recorded))])
        self.machine = ProgramRuns(prepared.machinery, room.interpolator.name, tuple(readout.noise), names, readout.rate, longest)
        self.spread = np.array([item.spread for item in free])
        self.prior = np.diag(1.0 / self.spread**2)
        self.beside: dict[int, tuple[FloatArray, FloatArray | None]] = {}
        random = np.random.default_rng(wish.seed)
        drawn = [0.5 * self.spread * random.standard_normal(len(free)) for _ in range(max(1, wish.draws) - 1)]
        self.points = [np.clip(point, *bounds(free)) for point in (np.zeros(len(free)), *drawn)]

    def readings(self, programs: Sequence[Laid | Ready], points: FloatArray) -> list[FloatArray]:
        """Return for each program what is read at points of the search (points, values), in noise levels (points, readings)."""
        if self.stop is not None and self.stop.is_set():
            raise KeyboardInterrupt
        values = values_of(self.free, points)
        paths, seconds = [program.table for program in programs], [program.seconds for program in programs]
        found = self.machine.readings(paths, seconds, [values] * len(programs))
        return [np.nan_to_num(rows / self.noise[None, :, None]).reshape(len(rows), -1) for rows in found]

    def slopes(self, programs: Sequence[Laid | Ready], point: FloatArray, *, central: bool = True) -> list[FloatArray]:
        """Return for each program the derivatives of all readings in noise levels (readings, values), by central differences or by
        forward ones, which take half the runs."""
        steps, count = _STEP * np.eye(len(self.free)), len(self.free)
        moved = self.readings(programs, np.vstack([point + steps, point - steps if central else point[None, :]]))
        length = 2.0 * _STEP if central else _STEP
        return [np.asarray((rows[:count] - rows[count:]).T / length) for rows in moved]

    def values(self, programs: Sequence[Laid], draws: int = 1, *, central: bool = True) -> list[float]:
        """Return the criterion of each program, the mean over the first draws."""
        found: list[float] = []
        for first in range(0, len(programs), _BATCH):
            some = programs[first : first + _BATCH]
            drawn = [
                [self._criterion(slopes, draw) for slopes in self.slopes(some, self.points[draw], central=central)] for draw in range(draws)
            ]
            found += [float(size) for size in np.mean(drawn, axis=0)]
        return found

    def value_at(self, program: Laid, point: FloatArray) -> float:
        """Return the criterion of a program at a point of the search."""
        return self._criterion(self.slopes([program], point)[0])

    def _criterion(self, slopes: FloatArray, draw: int = 0) -> float:
        if draw not in self.beside:
            self.beside[draw] = self._known_beside(self.points[draw])
        known, aims = self.beside[draw]
        counted = discounted(slopes, self.spread, self.error)
        matrix = counted.T @ counted + known
        return criterion_value(matrix, self.wish.criterion) if aims is None else -0.5 * math.log(mean_variance(aims, matrix))

    def _known_beside(self, point: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        """Return at a point what lesson and recorded programs know, and the derivatives of what is to be foretold."""
        known = self.prior.copy()
        for slopes in self.slopes(self.recorded, point) if self.recorded else ():
            counted = discounted(slopes, self.spread, self.error)
            known += counted.T @ counted
        return known, np.vstack(self.slopes(self.aims, point)) if self.aims else None

    def told(self, program: Laid) -> Telling:
        """Return what the program tells of the values, at the given ones."""
        here = self.readings([program], np.zeros((1, len(self.free))))[0]

        def moves(points: FloatArray) -> FloatArray:
            return np.asarray(np.abs(self.readings([program], points)[0] - here).max(axis=1))

        return telling([item.name for item in self.free], self.slopes([program], self.points[0])[0], moves)


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
        "singular_values": found.told.singular,
        "hidden": [item.sentence for item in found.told.hidden],
        "values": {
            item.name: {"relative_error": loose.get(item.name), "known_to_10_percent": item.name not in loose} for item in found.free
        },
        "record": [{"channel": name, "at_least_hz": found.readout.rate, "noise": size} for name, size in found.readout.noise.items()],
        "tried": len(found.search.tried),
        "best_of_tried": max(value for _, _, value in found.search.tried),
        "runs": found.search.runs,
        "wall_time_s": found.search.wall_time,
        "stopped": found.search.stopped,
    }


def write_precision(found: Precise, folder: Path) -> dict[str, Any]:
    """Write program.nc, lesson.yaml and prediction.json into a folder, and return the last."""
    told = as_json(found)
    write_design(found.lesson, found.room, found.program.seconds, found.program.text, folder)
    write_text(folder / "prediction.json", written_json(told))
    return told


def precision_lines(found: Precise, folder: Path) -> Iterator[str]:
    """Yield the design as a person reads it at a terminal."""
    if found.search.stopped:
        yield "Stopped: this is the best program so far."
    yield f"Program: {found.program.candidate.title}, {found.program.seconds:.1f} s; {found.criterion} = {found.value:.4g}."
    yield f"{found.told.known} of {len(found.free)} combinations of values would be known to 10 % or better."
    yield from (item.sentence for item in found.told.hidden)
    yield f"{len(found.search.tried)} programs, {found.search.runs} runs, {found.search.wall_time:.1f} s."
    yield f"Run {folder / 'program.nc'}."
