"""A diagnosis as its JSON tells it, the machine as it was diagnosed with effects and remedies on it, and the machines left possible."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.compensation.laps import CONTOUR
from lathesim.component import Output, Parameter
from lathesim.effects.effect import Effect
from lathesim.effects.remedy import Remedy
from lathesim.engine.assembly import FloatArray, Place
from lathesim.engine.batch import Batch
from lathesim.engine.run import Hints, run
from lathesim.engine.wiring import wire
from lathesim.errors import LessonError
from lathesim.identification.position_loops import Loop, one_or_more, resolution_of
from lathesim.identification.replay.converter_rounding import counts_of
from lathesim.json_text import read_json
from lathesim.lessons.changed_lesson import changed_lesson
from lathesim.lessons.insertion import Machinery
from lathesim.lessons.lesson import Lesson, lesson_from_text
from lathesim.lessons.part_values import write_table
from lathesim.lessons.sensor_sides import with_sensor_noise
from lathesim.lessons.simulate import Prepared, prepare
from lathesim.plugins import Registry


@dataclass(frozen=True)
class InsertedRemedy:
    """A remedy as a lesson inserts it: its class, where it sits, its name, its values as a lesson writes them, and the tables it needs.

    ``answers`` names the effects of the diagnosis that it is there for; ``tuned`` are parameters that the simulation finds, and
    ``one_sided`` those of which too much is worse than too little; ``begins`` holds several values of one from which the search begins.
    ``free`` are values of the effect, ``part.parameter``, that no control knows at the start, and their ranges.
    """

    remedy: str
    at: str
    name: str
    values: Mapping[str, float] = field(default_factory=dict)
    sources: Mapping[str, str] = field(default_factory=dict)
    tables: Mapping[str, tuple[tuple[str, ...], FloatArray]] = field(default_factory=dict)
    answers: tuple[str, ...] = ()
    tuned: tuple[str, ...] = ()
    one_sided: tuple[str, ...] = ()
    begins: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    free: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    share: float = 1.0

    def entry(self, units: Mapping[str, str]) -> dict[str, str]:
        """Return the line of the lesson; ``units`` are those of the placed part's parameters."""
        written = {name: f"{value:.8g}" if units[name] == "1" else f"{value:.8g} {units[name]}" for name, value in self.values.items()}
        shared = {"share": f"{self.share:.6g}"} if self.share != 1.0 else {}
        return {"remedy": self.remedy, "at": self.at, "name": self.name, **self.sources, **written, **shared}


@dataclass(frozen=True)
class Bench:
    """A machine with effects and remedies, made ready for many runs of one length.

    ``sound`` are the values with which neither acts, ``bare`` those with which only the remedies do not. ``target`` are those of what
    the remedied machine is held against: sound, with what reshapes the path of both.
    """

    machinery: Machinery
    batch: Batch
    loops: tuple[Loop, ...]
    sound: Mapping[str, float]
    bare: Mapping[str, float]
    target: Mapping[str, float]
    period: float

    def runs(
        self, members: Sequence[Mapping[str, float]], *, exact: bool = False, seeds: Sequence[int] | None = None, finer: int = 1
    ) -> list[FloatArray]:
        """Run members with their values and return their records, shape (channels, samples); noise acts where each has its seed.

        ``finer`` runs them with that many steps for one.
        """
        common = self.exact() if exact else {}
        names = sorted({*common, *(name for member in members for name in member)})
        known = self.batch.plan.values
        rows = np.array([[{**common, **member}.get(name, known[name]) for name in names] for member in members]).reshape(len(members), -1)
        batch = dataclasses.replace(self.batch, noisy=seeds is not None, steps_per_sample=finer * self.batch.plan.assembly.steps_per_sample)
        return [np.asarray(item) for item in batch.run(names, rows, np.copy, seeds=seeds)]

    def table(self, record: FloatArray) -> FloatArray:
        """Return where the tables are, shape (loops, samples) [m]."""
        return record[[self.batch.plan.channels.index(loop.table) for loop in self.loops]]

    def channel(self, record: FloatArray, name: str) -> FloatArray | None:
        """Return a channel of a record, or none."""
        channels = self.batch.plan.channels
        return record[channels.index(name)] if name in channels else None

    def exact(self) -> dict[str, float]:
        """Return the values with which converters and encoders count as finely as they can: slopes are then smooth."""
        return {name: exact for name, (_, exact) in counts_of(self.machinery).items() if name not in self.batch.plan.feeds}

    def units(self, part: str) -> dict[str, str]:
        """Return the units of what a placed part declares."""
        placed = next(item for item in self.machinery.parts if item.name == part)
        return {name: item.unit for name, item in placed.component.declarations.items()}


@dataclass(frozen=True)
class Diagnosed:
    """A lesson with what was found of its machine: entries of effects and refitted values; benches with other remedies are made of it."""

    lesson: Lesson
    registry: Registry
    effects: tuple[Mapping[str, str], ...]
    values: Mapping[str, str]
    folder: Path
    variant: str | None = None
    samples: int = 0

    @classmethod
    def of(cls, lesson: Lesson, registry: Registry, found: DiagnosedMachine, folder: Path, variant: str | None = None) -> Diagnosed:
        """Return a lesson with its diagnosis: the values as they were refitted with the effects, as far as the machine has them."""
        machinery = prepare(lesson, registry, variant).machinery
        declared = {f"{part.name}.{name}" for part in machinery.parts for name in part.component.declared(Parameter)}
        fed = {wire.target for wire in machinery.wires}
        values = {
            name: f"{value:.8g}" if unit == "1" else f"{value:.8g} {unit}"
            for name, (value, _, _, unit) in found.baseline.items()
            if name in declared and name not in fed
        }
        return cls(lesson, registry, tuple(dict(item.entry) for item in found.effects), values, folder, variant)

    def text(
        self, lines: Sequence[InsertedRemedy], units: Mapping[str, Mapping[str, str]], folder: Path, *, with_effects: bool = True
    ) -> str:
        """Return the lesson with remedies, and with the effects where they shall act, for a file in ``folder``."""
        entries = [dict(entry) for entry in self.effects] if with_effects else []
        entries += [line.entry(units.get(line.name, {})) for line in lines]
        before = dict(self.lesson.source.data.get("tables", {}))
        tables = {f"{line.name}.{name}": f"{line.name}_{name}.csv" for line in lines for name in line.tables}
        further: dict[str, Any] = {"tables": {**before, **tables}} if tables or before else {}
        text = changed_lesson(self.lesson, entries, dict(self.values), folder, variant=self.variant, further=further)
        for line in lines:
            for name, (columns, rows) in line.tables.items():
                write_table(folder / f"{line.name}_{name}.csv", columns, rows, units.get(line.name, {}).get(name, ""))
        return text

    def bench(self, lines: Sequence[InsertedRemedy] = (), noise: Mapping[str, float] | None = None) -> Bench:
        """Return the machine with remedies, ``noise`` [m] before its sensors where it is given.

        The values of the lines are set by override, so a lesson of defaults is made.
        """
        text = self.text([dataclasses.replace(line, values={}, share=1.0) for line in lines], {}, self.folder)
        prepared = prepare(lesson_from_text(text, self.folder / "lesson.yaml"), self.registry)
        machinery = prepared.machinery
        loops = one_or_more(machinery, str(self.lesson.path))
        samples = self.samples or self._length(prepared)
        wanted = self._channels(machinery, loops)
        sound: dict[str, float] = {}
        shares: dict[str, float] = {}
        quiet: dict[str, float] = {}
        given: dict[str, float] = {}
        names = {line.name: line for line in lines}
        already = {part.name for part in prepare(self.lesson, self.registry, self.variant).machinery.parts}
        for part in machinery.parts:
            if not issubclass(part.component, Effect) or part.name in already:
                continue
            if issubclass(part.component, Remedy):
                shares[f"{part.name}.share"] = 0.0
                if not part.component.reshapes:
                    quiet[f"{part.name}.share"] = 0.0
                line = names.get(part.name)
                given |= {f"{part.name}.{name}": value for name, value in line.values.items()} if line else {}
                given[f"{part.name}.share"] = line.share if line else 1.0
            else:
                sound |= {f"{part.name}.{name}": value for name, value in part.component.neutral.items()}
        machinery = with_sensor_noise(machinery.with_parameters(given), noise or {})
        batch = Batch(wire(dataclasses.replace(machinery, finish="", record=wanted)), samples, seed=prepared.case.seed)
        return Bench(machinery, batch, loops, {**sound, **shares}, shares, {**sound, **quiet}, machinery.sample_period)

    def _length(self, prepared: Prepared) -> int:
        if prepared.duration is not None:
            return round(prepared.duration / prepared.machinery.sample_period) + 1
        if not prepared.plan.assembly.finish:
            driven = prepared.case.lesson.settings.recordings
            told = "a recording drives it and it has no duration" if driven is not None else "it has no duration"
            remedy = "Write 'duration:', and a part that drives the inputs, as a circle or a program."
            raise LessonError(f"the lesson cannot be run by itself: {told}.", place=str(self.lesson.path), remedy=remedy)
        return len(run(prepared.plan, seed=prepared.case.seed, hints=Hints(prepared.expected_time)))

    def _channels(self, machinery: Machinery, loops: Sequence[Loop]) -> tuple[str, ...]:
        outputs = {f"{part.name}.{name}" for part in machinery.parts for name in part.component.declared(Output)}
        wanted = [name for loop in loops for name in (loop.table, loop.reading, loop.reference)]
        for port in ("{0.axis}.position", "{0.axis}.velocity", "{0.controller}.voltage", "{0.converter}.voltage"):
            wanted += [port.format(loop) for loop in loops]
        wanted += [str(CONTOUR), *(f"interpolator.{name}" for name in ("centre_x", "centre_z", "circle_radius", "radius"))]
        return tuple(dict.fromkeys(name for name in wanted if name in outputs))


_TO_ONE = 3.919928
"""Width of a 95 % interval over its standard deviation."""
_FINEST = 1e-9
"""Share of the largest value of a channel that counts as its floor where nothing rounds it."""
_LEAST = 1e-9
"""Precision of a direction in which neither recording nor lesson say anything, over that of the diagnosis."""

Intervals = Mapping[str, tuple[float, float, float]]
"""``part.parameter`` -> value, and the ends of its 95 % interval [SI]."""


def draws_of(
    bench: Bench, intervals: Intervals, prior: Mapping[str, float], free: Mapping[str, tuple[float, float]], count: int, seed: int
) -> list[dict[str, float]]:
    """Return ``count`` sets of values around their estimates, within what may be set.

    They are normal, with the standard deviations s of the diagnosis and the correlation R of what it was made from:

        R_ij = C_ij/sqrt(C_ii C_jj),   C = (J'J + diag(s^2/p^2))^-1,   J = d(channels/floors)/d(value/s)

    p is what the lesson calls uncertain. The diagnosis tells each interval by itself, and a motion fixes few of the values alone: with the
    force of a drive, mass and friction it tells their ratios only. Drawn apart they would move the table where the recording shows that it
    does not move. What is ``free``, as the side of a play at the start, is even over its
    range. Linear around the estimates. Source: G. A. F. Seber, C. J. Wild, Nonlinear Regression, Wiley 1989, section 2.1.2.
    """
    names = [name for name, (_, low, high) in intervals.items() if high > low]
    middle = {name: value for name, (value, _, _) in intervals.items()}
    rng = np.random.default_rng([seed, 5])
    loose = [{name: float(rng.uniform(*ends)) for name, ends in free.items()} for _ in range(count)]
    if not names:
        return [middle | item for item in loose]
    deviations = np.array([(intervals[name][2] - intervals[name][1]) / _TO_ONE for name in names])
    root = _root(correlation(bench, names, middle, deviations, prior))
    drawn = np.array([middle[name] for name in names]) + deviations * (rng.standard_normal((count, len(names))) @ root.T)
    low, high = bounds(bench, names)
    rows = np.clip(drawn, low, high)
    return [{**middle, **dict(zip(names, map(float, row), strict=True)), **item} for row, item in zip(rows, loose, strict=True)]


def correlation(
    bench: Bench, names: Sequence[str], middle: Mapping[str, float], deviations: FloatArray, prior: Mapping[str, float]
) -> FloatArray:
    """Return the correlation of the errors of values, from how the unremedied machine answers to each."""
    _, high = bounds(bench, names)
    values = np.array([middle[name] for name in names])
    steps = np.where(values + deviations <= high, deviations, -deviations)
    rows = [
        {**middle, **bench.bare},
        *[{**middle, **bench.bare, name: value + step} for name, value, step in zip(names, values, steps, strict=True)],
    ]
    records = [_seen(bench, record) for record in bench.runs(rows, exact=True)]
    slopes = np.stack([(record - records[0]) * np.sign(step) for record, step in zip(records[1:], steps, strict=True)], axis=1)
    slopes[~np.isfinite(slopes)] = 0.0
    known = np.array([(deviation / prior[name]) ** 2 if name in prior else 0.0 for name, deviation in zip(names, deviations, strict=True)])
    covariance = np.linalg.inv(slopes.T @ slopes + np.diag(known + _LEAST))
    scale = np.sqrt(np.diag(covariance))
    return np.asarray(covariance / np.outer(scale, scale))


def _seen(bench: Bench, record: FloatArray) -> FloatArray:
    """Return tables, readings and commands over what they resolve, all in one row."""
    rows = []
    for loop in bench.loops:
        for name, sensor in ((loop.table, Place.of(loop.beyond).part), (loop.reading, loop.sensor), (f"{loop.controller}.voltage", "")):
            values = bench.channel(record, name)
            if values is not None:
                floor = resolution_of(bench.machinery, sensor) if sensor else 0.0
                rows.append(values / max(floor, _FINEST * float(np.nanmax(np.abs(values))), 1e-300))
    return np.concatenate(rows)


def _root(matrix: FloatArray) -> FloatArray:
    """Return a root A of a correlation matrix,  A A' = R,  rounding below zero taken as zero."""
    sizes, directions = np.linalg.eigh(matrix)
    return np.asarray(directions * np.sqrt(np.maximum(sizes, 0.0)))


def bounds(bench: Bench, names: Sequence[str]) -> tuple[FloatArray, FloatArray]:
    """Return the lowest and the highest value that each name may have, without bound where it is no parameter."""
    declared = {f"{part.name}.{name}": item for part in bench.machinery.parts for name, item in part.component.declared(Parameter).items()}
    items = [declared.get(name) for name in names]
    return (
        np.array([item.low if item is not None else -np.inf for item in items]),
        np.array([item.high if item is not None else np.inf for item in items]),
    )


SCHEMA = "lathesim-diagnosis/1"
_NOTHING_TO_MEND = {
    "no_mismatch": "The simulation explains the recording as it is: there is nothing to mend.",
    "parameters_only": "No physics is missing, only values are off: correct them in the lesson, there is nothing to mend.",
    "unknown": "The diagnosis names no effect, so no remedy follows from it. Run the experiment that it asks for.",
    "recording_fault": "The recording is at fault, not the machine: mend the recording first.",
}
"""Verdict -> why no remedy follows."""


@dataclass(frozen=True)
class NamedEffect:
    """An effect of a diagnosis: where it is, its values with their 95 % intervals [unit of the file], and what it is tied with."""

    effect: str
    at: str
    parameters: Mapping[str, tuple[float, float, float]]
    entry: Mapping[str, str]
    tied_with: tuple[str, ...]


@dataclass(frozen=True)
class DiagnosedMachine:
    """A diagnosis: its verdict, the named effects, the refitted values of the lesson with their intervals, and what it may not claim."""

    verdict: str
    effects: tuple[NamedEffect, ...]
    baseline: Mapping[str, tuple[float, float, float, str]]
    cautions: tuple[str, ...]
    nothing: str
    floors: Mapping[str, float] = field(default_factory=dict)
    """What each compared channel cannot resolve: noise and rounding together, one standard deviation [SI]."""


def read_diagnosis(file: Path) -> DiagnosedMachine:
    """Read a diagnosis; :class:`LessonError` where the file is none."""
    data = read_json(file, SCHEMA, "diagnosis", remedy="Write it with 'diagnose --json FILE'.", fault=LessonError)
    verdict = str(data.get("verdict", ""))
    kinds: tuple[tuple[str, type, str], ...] = (("insert", list, "list"), ("effects", list, "list"), ("baseline", dict, "table"))
    for name, kind, told in kinds:
        if data.get(name) and not isinstance(data[name], kind):
            raise LessonError(f"'{name}' of the diagnosis is no {told}.", place=str(file), remedy="Give the file as diagnose wrote it.")
    entries = [dict(entry) for entry in data.get("insert") or [] if isinstance(entry, dict)]
    nothing = _NOTHING_TO_MEND.get(verdict, "")
    # what an unknown verdict only suspects has no line to insert
    named = [_named(item, entries, file) for item in data.get("effects") or []] if not nothing else []
    baseline = {str(name): _value(value) for name, value in dict(data.get("baseline") or {}).items() if _value(value) is not None}
    if not nothing and not named:
        nothing = "The diagnosis names no effect, so no remedy follows from it."
    return DiagnosedMachine(verdict, tuple(named), baseline, _cautions(verdict, data, named), nothing, _floors(data))  # type: ignore[arg-type]


def _named(item: Any, entries: Sequence[Mapping[str, Any]], file: Path) -> NamedEffect:
    """Return an effect that a diagnosis names, with the line that inserts it."""
    if not isinstance(item, dict) or not isinstance(item.get("effect"), str) or not isinstance(item.get("at"), str):
        raise LessonError("an effect of the diagnosis has no name or place.", place=str(file), remedy="Give the file as diagnose wrote it.")
    entry = next((line for line in entries if line.get("effect") == item["effect"] and line.get("at") == item["at"]), None)
    if entry is None:
        raise LessonError(f"the diagnosis has no line to insert for {item['effect']}.", place=str(file))
    known = item.get("parameters")
    values = {name: _interval(value, file) for name, value in (known if isinstance(known, dict) else {}).items()}
    written = {key: str(value) for key, value in entry.items()}
    return NamedEffect(item["effect"], item["at"], values, written, tuple(item.get("tied_with") or ()))


def _floors(data: Mapping[str, Any]) -> dict[str, float]:
    fit = data.get("fit")
    items = fit.items() if isinstance(fit, dict) else ()
    return {
        str(name): float(item["floor"]) for name, item in items if isinstance(item, dict) and isinstance(item.get("floor"), (int, float))
    }


def _interval(value: Any, file: Path) -> tuple[float, float, float]:
    if not isinstance(value, dict) or not isinstance(value.get("value"), (int, float)) or not math.isfinite(value["value"]):
        raise LessonError("a value of the diagnosis is no number.", place=str(file), remedy="Give the file as diagnose wrote it.")
    number = float(value["value"])
    low, high = (value.get(name) for name in ("low", "high"))
    ends = [float(end) if isinstance(end, (int, float)) and math.isfinite(end) else number for end in (low, high)]
    return number, min(*ends, number), max(*ends, number)


def _value(value: Any) -> tuple[float, float, float, str] | None:
    if not isinstance(value, dict) or not isinstance(value.get("refit_with"), (int, float)):
        return None
    number = float(value["refit_with"])
    if not math.isfinite(number):
        return None
    low, high = (value.get(name) for name in ("low", "high"))
    known = isinstance(low, (int, float)) and isinstance(high, (int, float)) and math.isfinite(low) and math.isfinite(high)
    return number, float(low) if known else number, float(high) if known else number, str(value.get("unit", "1"))  # type: ignore[arg-type]


def _cautions(verdict: str, data: Mapping[str, Any], named: list[NamedEffect]) -> tuple[str, ...]:
    found = []
    if verdict == "tied" or any(item.tied_with for item in named):
        others = ", ".join(sorted({name for item in named for name in item.tied_with}))
        told = f" (it may be {others} instead)" if others else ""
        found.append(f"The diagnosis is tied{told}: the remedy may claim the better fit on this recording, and no cause.")
    if data.get("adequate") is False:
        found.append("The diagnosis does not explain all of the recording: the remedy may claim what was named, and nothing of the rest.")
    return tuple(found)
