"""``remedy``: from a diagnosis to remedies that were tried, with a promise, and with what they cannot mend."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from lathesim.compensation.control_lines import Axis, Control, letter_of
from lathesim.compensation.diagnosed_machine import Bench, Diagnosed, DiagnosedMachine, InsertedRemedy, NamedEffect, bounds, draws_of
from lathesim.compensation.lap_response import LoopGain, loop_gains
from lathesim.compensation.planning import FIRST_CHANGES, TIMES, LoopToSize, Sized, axes_of, remedies_for, repair_of, sized_effects
from lathesim.compensation.promise import DRAWS, PromisedSize, noise_of, promised
from lathesim.component import Parameter
from lathesim.effects.effect import Effect
from lathesim.effects.remedy import Remedy
from lathesim.engine.assembly import FloatArray, Place, of_part
from lathesim.errors import LatheSimError, LessonError
from lathesim.identification.estimation.fit import Descent, Problem, fit
from lathesim.identification.position_loops import level_of
from lathesim.identification.records import Free
from lathesim.identification.replay.loading import uncertainties
from lathesim.lessons.insertion import effect_part_name
from lathesim.lessons.simulate import prepare
from lathesim.units import in_unit

Tell = Callable[[str], None]
MARGIN = 0.5
"""Where between estimate and lower end of its interval a size is set of which too much is worse than too little."""
_SMALLEST_SHARE = 0.4
_HELPS = 0.98
"""Share of the deviation that must be left at most for a remedy to be kept."""
_FORCES = ("effort",)


@dataclass(frozen=True)
class NotMended:
    """An effect that gets no remedy, why, and what to do instead."""

    effect: str
    at: str
    why: str


@dataclass(frozen=True)
class Answer:
    """What was chosen and is promised; ``nothing`` says why there is nothing to mend, ``cautions`` what may not be claimed.

    ``gains`` are those of the loops that a diagnosed effect makes late: how far each may be raised.
    """

    diagnosed: Diagnosed
    bench: Bench | None
    lines: tuple[InsertedRemedy, ...]
    axes: tuple[LoopToSize, ...]
    not_mended: tuple[NotMended, ...]
    promise: tuple[PromisedSize, ...]
    better_in: float
    cautions: tuple[str, ...]
    nothing: str = ""
    gains: tuple[LoopGain, ...] = ()
    texts: Mapping[str, str] = dataclasses.field(default_factory=dict)
    """What is to be pasted into a control: file -> text."""


def remedy(
    diagnosed: Diagnosed,
    found: DiagnosedMachine,
    *,
    margin: bool = True,
    seed: int = 1,
    tell: Tell = lambda text: None,
    control: Control | None = None,
) -> Answer:
    """Return the remedies for a diagnosis, tried on the diagnosed machine; files of the trials go to its folder.

    With a ``control`` they are those that it holds, with the numbers that its text holds.
    Raises :class:`LessonError` where the diagnosis is of another machine, where the lesson has such a remedy already, or cannot be run.
    """
    registry, uncertain = diagnosed.registry, diagnosed.lesson.settings.uncertain
    if found.nothing:
        return Answer(diagnosed, None, (), (), (), (), 0.0, found.cautions, found.nothing)
    _same_machine(diagnosed, found)
    bench = diagnosed.bench()
    diagnosed = dataclasses.replace(diagnosed, samples=bench.batch.samples)
    tell("sizing the remedies")
    axes = axes_of(diagnosed, bench, with_force=any(getattr(registry.effect(item.effect), "site", "") in _FORCES for item in found.effects))
    _not_twice(diagnosed, bench, found, axes)
    lines, not_mended = _chosen(diagnosed, bench, found, axes, tell, control)
    lines, late = _kept(diagnosed, lines, found, tell) if lines else ([], [])
    if margin:
        lines = [_with_margin(line, found) for line in lines]
    texts: dict[str, str] = {}
    if control is not None:
        named = [Axis(letter_of(item.loop.controller), n, item.loop.axis, item.loop.controller) for n, item in enumerate(axes)]
        held, texts = control.held(lines, registry, named)
        lines = [item.line for item in held if item.texts]
        late += [NotMended(name, item.line.at, _ROUNDED) for item in held if not item.texts for name in item.line.answers]
    gains = loop_gains(diagnosed)
    if not lines:
        return Answer(diagnosed, bench, (), axes, (*not_mended, *late), (), 0.0, found.cautions, gains=gains)
    tell("trying the remedies over draws of what is uncertain")
    mended = diagnosed.bench(lines, noise_of(bench, found.floors))
    intervals = _intervals(mended, found)
    prior = uncertainties(diagnosed.lesson, mended.batch.plan) if uncertain else {}
    sizes, better = promised(mended, draws_of(mended, intervals, prior, _free(mended, lines), DRAWS, seed), seed=seed)
    unmended = (*not_mended, *late, *_limits(mended, lines))
    return Answer(diagnosed, mended, tuple(lines), axes, unmended, tuple(sizes), better, found.cautions, gains=gains, texts=texts)


def _same_machine(diagnosed: Diagnosed, found: DiagnosedMachine) -> None:
    parts = {part.name for part in prepare(diagnosed.lesson, diagnosed.registry, diagnosed.variant).machinery.parts}
    for item in found.effects:
        host = Place.of(item.at).part
        if host not in parts:
            fact = f"the diagnosis names {item.effect} at {item.at}, and the machine of this lesson has no part '{host}'."
            raise LessonError(fact, place=str(diagnosed.lesson.path), remedy="The diagnosis is of another machine: give its own lesson.")
    try:
        diagnosed.bench()
    except LatheSimError as error:
        raise LessonError(
            f"what the diagnosis names cannot be put into this lesson: {error.fact}", place=str(diagnosed.lesson.path), remedy=error.remedy
        ) from None


def _chosen(
    diagnosed: Diagnosed, bench: Bench, found: DiagnosedMachine, axes: tuple[LoopToSize, ...], tell: Tell, control: Control | None
) -> tuple[list[InsertedRemedy], list[NotMended]]:
    """Return for each effect the alternative that leaves least, put together, and what has none.

    Raises :class:`LessonError` where a remedy would help, and the control holds none.
    """
    lines: list[InsertedRemedy] = []
    refused: list[str] = []
    without: list[NotMended] = []
    for item in sized_effects(bench, found.effects, axes):
        if isinstance(item, NamedEffect):
            family = str(getattr(diagnosed.registry.effect(item.effect), "family", ""))
            without.append(NotMended(item.effect, item.at, repair_of(item.effect, family)))
            continue
        choices = remedies_for(item, diagnosed.registry, control)
        if not choices and control is not None and remedies_for(item, diagnosed.registry):
            refused.append(item.named.effect)
            without.append(NotMended(item.named.effect, item.named.at, f"{control.lacks}. {_NEAREST}".rstrip(".")))
        elif not choices:
            without.append(NotMended(item.named.effect, item.named.at, _why_none(diagnosed, item)))
        if not choices:
            continue
        if len(choices) > 1:
            tell(f"choosing among remedies for {item.named.effect}")
            costs = []
            for choice in choices:
                best = with_values(choice, tuned(diagnosed.bench([choice]), [choice], {choice.name: choice.tuned}))
                costs.append((_left(diagnosed.bench([best])), best))
            choices = [min(costs, key=lambda pair: pair[0])[1]]
        lines.append(choices[0])
    if refused and not lines and control is not None:
        fact = f"{control.lacks}: it holds no remedy against {', '.join(refused)}."
        raise LessonError(fact, place=str(diagnosed.lesson.path), remedy=_NEAREST)
    together = merged(lines)
    if control is None:
        return together, without
    # a setting stands once for an axis
    first = {(line.remedy, line.at): line for line in reversed(together)}
    without += [NotMended(name, line.at, _ONCE) for line in together if line is not first[line.remedy, line.at] for name in line.answers]
    return [line for line in together if line is first[line.remedy, line.at]], without


_ROUNDED = "it is finer than the last digit that the control writes"
_ONCE = "the control has this setting once for an axis, and another effect takes it"
_NEAREST = "The nearest is '--as program', which takes it up in the part program, or '--for table', which holds all numbers."


def _why_none(diagnosed: Diagnosed, item: Sized) -> str:
    remedies = [name for name, kind in diagnosed.registry.remedies.items() if item.named.effect in kind.answers]  # type: ignore[attr-defined]
    if remedies and item.axis.per_force == 0.0:
        return "no force moves this axis in the lesson (its disturbance gain is zero), so nothing follows for the command"
    return repair_of(item.named.effect, str(getattr(diagnosed.registry.effect(item.named.effect), "family", "")))


def _left(bench: Bench) -> float:
    """Return the share of the tables' deviation that the remedies leave."""
    sound, bare, target, mended = bench.runs([bench.sound, bench.bare, bench.target, {}])
    pairs = ((bare, sound), (mended, target))
    before, after = (float(np.mean(deviation(bench, record, bench.table(held)) ** 2)) for record, held in pairs)
    if not np.isfinite(after):
        return np.inf
    return float(np.sqrt(after / before)) if before > 0.0 else 1.0


def _kept(
    diagnosed: Diagnosed, lines: Sequence[InsertedRemedy], found: DiagnosedMachine, tell: Tell
) -> tuple[list[InsertedRemedy], list[NotMended]]:
    """Return the lines with their tuned values, without those that the simulation does not see help."""
    tell("tuning the remedies by simulation")
    bench = diagnosed.bench(lines)
    values = tuned(bench, lines, {line.name: line.tuned for line in lines})
    better = [with_values(line, values) for line in lines]
    kept, without = list(better), []
    whole = _left(diagnosed.bench(kept))
    for line in better:
        rest = [other for other in kept if other.name != line.name]
        alone = _left(diagnosed.bench(rest)) if rest else 1.0
        if whole > _HELPS * alone:
            level = max((level_of(bench.machinery, loop.converter) for loop in bench.loops if loop.controller == line.at), default=0.0)
            without += [NotMended(name, line.at, _no_help(line, level)) for name in line.answers]
            kept, whole = rest, alone
    return kept, without


def _no_help(line: InsertedRemedy, level: float) -> str:
    size = _voltage(line)
    if 0.0 < size < level:
        return f"{_under(size, level)}: take a converter of more bits first"
    return f"{line.remedy} was tried in the simulation and does not make it better"


def _under(size: float, level: float) -> str:
    return f"{in_unit(size, 'mV', '.3g')} under a level of {in_unit(level, 'mV', '.3g')}"


def _voltage(line: InsertedRemedy) -> float:
    return max((abs(line.values.get(name, 0.0)) for name in ("level", "bias", "amplitude", "excess")), default=0.0)


def _limits(bench: Bench, lines: Sequence[InsertedRemedy]) -> list[NotMended]:
    """Return what of the lines a converter lets through only in part."""
    told = []
    for line in lines:
        level = max((level_of(bench.machinery, loop.converter) for loop in bench.loops if loop.controller == line.at), default=0.0)
        size = _voltage(line)
        if 0.0 < size < level:
            why = f"{_under(size, level)}: take more bits first; the promise is with these"
            told += [NotMended(name, line.at, why) for name in line.answers]
    return told


def _with_margin(line: InsertedRemedy, found: DiagnosedMachine) -> InsertedRemedy:
    """Return a line with its one-sided sizes moved towards the lower end of what the diagnosis is sure of."""
    share = 1.0
    for item in found.effects:
        if item.effect not in line.answers:
            continue
        for name in ("level", "width", "half_width", "excess"):
            if name in item.parameters and line.one_sided:
                value, low, _ = item.parameters[name]
                if value > 0.0:
                    share = min(share, 1.0 - MARGIN * (value - max(low, 0.0)) / value)
    share = max(share, _SMALLEST_SHARE)
    return line if share >= 1.0 else dataclasses.replace(line, share=line.share * share)


def _not_twice(diagnosed: Diagnosed, bench: Bench, found: DiagnosedMachine, axes: tuple[LoopToSize, ...]) -> None:
    """Refuse a lesson that has a remedy already which would be put in."""
    known = {part.name for part in bench.machinery.parts if issubclass(part.component, Remedy)}
    for item in sized_effects(bench, found.effects, axes):
        for line in remedies_for(item, diagnosed.registry) if isinstance(item, Sized) else ():
            if line.name in known:
                fact = f"the lesson has {line.remedy} at {line.at} already."
                remedy_told = "Diagnose the remedied machine anew, or take the remedy out first."
                raise LessonError(fact, place=str(diagnosed.lesson.path), remedy=remedy_told)


def _intervals(bench: Bench, found: DiagnosedMachine) -> dict[str, tuple[float, float, float]]:
    """Return the intervals of what is uncertain, by ``part.parameter`` of the bench: of the effects, and of the refitted values."""
    placed = bench.machinery.by_name
    intervals: dict[str, tuple[float, float, float]] = {}
    for item in found.effects:
        name = item.entry.get("name") or effect_part_name(item.at, item.effect)
        part = placed.get(name)
        if part is None or not issubclass(part.component, Effect):
            continue
        for short, interval in item.parameters.items():
            if short in part.component.declared(Parameter) and short in part.parameters:
                intervals[f"{name}.{short}"] = interval
    for full, (value, low, high, _) in found.baseline.items():
        part_name, short = Place.of(full)
        if part_name in placed and short in placed[part_name].parameters and full not in bench.batch.plan.feeds:
            intervals[full] = (value, low, high)
    return intervals


def _free(bench: Bench, lines: Sequence[InsertedRemedy]) -> dict[str, tuple[float, float]]:
    """Return the ranges of what differs from one start to the next, whatever the diagnosis tells of its recording."""
    parts = {part.name for part in bench.machinery.parts}
    return {name: ends for line in lines for name, ends in line.free.items() if Place.of(name).part in parts}


_SUMMED = ("bias",)
"""Values that add up, whatever else is set."""


def merged(lines: Sequence[InsertedRemedy]) -> list[InsertedRemedy]:
    """Return the lines with those of one name put together, in the order of the first of each.

    Two that ask for different values of one parameter, as ripples of two periods do, stay two, the later ones numbered.
    """
    found: dict[str, InsertedRemedy] = {}
    for line in lines:
        names = (line.name, *(f"{line.name}_{number}" for number in range(2, len(lines) + 1)))
        name = next(name for name in names if name not in found or _agree(found[name], line))
        named = dataclasses.replace(line, name=name)
        found[name] = _both(found[name], named) if name in found else named
    return list(found.values())


def _agree(first: InsertedRemedy, second: InsertedRemedy) -> bool:
    shared = [name for name in first.values if name in second.values and name not in _SUMMED]
    return all(first.values[name] == second.values[name] for name in shared)


def _both(first: InsertedRemedy, second: InsertedRemedy) -> InsertedRemedy:
    values = {**first.values, **second.values}
    for name in _SUMMED:
        if name in first.values and name in second.values:
            values[name] = first.values[name] + second.values[name]
    tables = dict(first.tables)
    for name, (columns, rows) in second.tables.items():
        if name not in tables:
            tables[name] = (columns, rows)
            continue
        mine = tables[name][1]
        places = np.unique(np.concatenate([mine[:, 0], rows[:, 0]]))
        together = [np.interp(places, mine[:, 0], mine[:, k]) + np.interp(places, rows[:, 0], rows[:, k]) for k in range(1, len(columns))]
        tables[name] = (columns, np.stack([places, *together], axis=1))
    return dataclasses.replace(
        first,
        values=values,
        tables=tables,
        answers=tuple(dict.fromkeys((*first.answers, *second.answers))),
        tuned=tuple(dict.fromkeys((*first.tuned, *second.tuned))),
        one_sided=tuple(dict.fromkeys((*first.one_sided, *second.one_sided))),
        free={**first.free, **second.free},
        share=min(first.share, second.share),
    )


_ROUNDS = 8
_WORTH = 1e-4
"""Steps of a search at most, and the share of the mean square that one must gain to be followed by another."""
_STEP = 0.03
_LEAD_STEP = 2e-4
"""Changes by which slopes are taken: a share of a value, and seconds of a time."""


def deviation(bench: Bench, record: FloatArray, sound: FloatArray) -> FloatArray:
    """Return how far the tables are from where those of the sound machine are, all loops in one row [m]."""
    return (bench.table(record) - sound).ravel()


def tuned(bench: Bench, lines: Sequence[InsertedRemedy], free: Mapping[str, tuple[str, ...]]) -> dict[str, float]:
    """Return ``part.parameter`` -> value for the free parameters of the lines: a short fit from the given values."""
    names = [f"{line.name}.{name}" for line in lines for name in free.get(line.name, ())]
    if not names:
        return {}
    values = np.array([{f"{line.name}.{n}": v for line in lines for n, v in line.values.items()}.get(name, 0.0) for name in names])
    low, high = bounds(bench, names)
    sound = bench.table(bench.runs([bench.target], exact=True)[0])
    for line in lines:
        for short, begins in line.begins.items():
            place = names.index(f"{line.name}.{short}")
            tried = [np.where(np.arange(len(names)) == place, begin, values) for begin in begins]
            values = tried[int(np.argmin(_cost(bench, names, tried, sound)))]
    steps = np.array([_step(name, value) for name, value in zip(names, values, strict=True)])
    left = functools.partial(_left_with, bench, names, sound, np.sqrt(_cost(bench, names, [values], sound)[0]))
    fitted = [Free(name, value, step, *ends) for name, value, step, *ends in zip(names, values, steps, low, high, strict=True)]
    problem = Problem(left, fitted, steps=lambda values, before: steps)
    return dict(zip(names, map(float, fit(Descent(problem, tolerance=_WORTH, least=0.0), values, _ROUNDS).values), strict=True))


def _left_with(bench: Bench, names: Sequence[str], sound: FloatArray, unit: float, rows: FloatArray) -> list[FloatArray]:
    """Return how far the tables are from the sound machine's for each row of values, in a unit [m]."""
    records = bench.runs([dict(zip(names, row, strict=True)) for row in rows], exact=True)
    return [deviation(bench, record, sound) / max(unit, 1e-30) for record in records]


def _cost(bench: Bench, names: Sequence[str], rows: Sequence[FloatArray], sound: FloatArray) -> list[float]:
    costs = [float(np.mean(left**2)) for left in _left_with(bench, names, sound, 1.0, np.array(rows))]
    return [cost if np.isfinite(cost) else np.inf for cost in costs]


def _step(name: str, value: float) -> float:
    port = Place.of(name).port
    if port in TIMES:
        return _LEAD_STEP
    return _STEP * abs(value) if value != 0.0 else FIRST_CHANGES[port]


def with_values(line: InsertedRemedy, found: Mapping[str, float]) -> InsertedRemedy:
    """Return a line with the values that were found for it."""
    return dataclasses.replace(line, values={**line.values, **of_part(line.name, found)})
