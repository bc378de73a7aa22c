"""The questions that a recording can answer: a line for each effect of the catalogue at its place, and a matrix of what it is told from.

A row of the matrix is the effect that a machine has, at ten times the smallest size that shows it; a column is another explanation. An
entry is by how much that stays behind, as a share of what a diagnosis needs to tell the two: below 1 they are tied. Structural analysis has
the same matrix in noughts and ones (M. Krysander, E. Frisk, Sensor placement for fault diagnosis, IEEE Trans. Syst. Man Cybern. A 38
(2008)): there it is read off the equations, here off what noise, doubt and this motion leave of them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lathesim.diagnosis.candidates.eligibility import is_told_by_direction
from lathesim.diagnosis.explaining.chance import least_apart
from lathesim.diagnosis.explaining.search import ties
from lathesim.diagnosis.explaining.study import Study
from lathesim.diagnosis.explaining.trial import neutral, settled_trial, tried
from lathesim.diagnosis.isolation.apart import FittedRival, alike, rivals_of
from lathesim.diagnosis.isolation.visible import ChannelChange, Looking, Visible, shapes, smallest_visible, unseen
from lathesim.diagnosis.location import one_way
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.records.diagnosis import Unanswerable
from lathesim.diagnosis.records.found import Found, Screened, Tried
from lathesim.diagnosis.records.shown import Shown
from lathesim.engine.assembly import FloatArray, Place
from lathesim.identification.execution import together
from lathesim.identification.records import Candidate
from lathesim.identification.replay.experiment import Experiment
from lathesim.identification.roles import acting
from lathesim.identification.signal import root_mean_square


@dataclass(frozen=True)
class Answerable:
    """An effect at its place: by which of its parameters it is measured [``unit``], from which size on it is seen (infinite: never), at
    which size it is held against others, and ``why`` it is never seen, or is tied."""

    effect: str
    at: str
    family: str
    parameter: str
    unit: str
    smallest: float
    size: float
    why: str = ""

    @property
    def name(self) -> str:
        """The effect with its place."""
        return f"{self.effect} at {self.at}"

    @property
    def is_visible(self) -> bool:
        """Whether it is seen at any size that is believed."""
        return math.isfinite(self.smallest)


@dataclass(frozen=True, eq=False)
class Isolation:
    """What a recording can tell: the effects of the catalogue, and for each two of them by how much the second stays behind where a machine
    has the first, as a share of what tells them (rows, columns); infinite where it is no explanation, NaN where the first is not seen.

    ``told_from`` are the sizes of the first from which on they are told [SI], infinite where they are at none.
    """

    effects: tuple[Answerable, ...]
    behind: FloatArray
    told_from: FloatArray
    changes: tuple[ChannelChange | None, ...] = ()
    rivals: tuple[tuple[FittedRival, ...], ...] = ()

    def tied_with(self, row: int) -> list[int]:
        """Return the effects that the recording cannot tell from one that is there, the nearest first."""
        columns = np.flatnonzero(np.nan_to_num(self.behind[row], nan=np.inf) < 1.0)
        return sorted(columns.tolist(), key=lambda column: float(self.behind[row, column]))

    @property
    def pairs(self) -> list[tuple[int, int]]:
        """The pairs of effects of which one at least cannot be told from the other, each once."""
        found = [(row, column) for row in range(len(self.effects)) for column in self.tied_with(row)]
        return list(dict.fromkeys((min(pair), max(pair)) for pair in found))


def isolated(looking: Looking) -> Isolation:
    """Return what the recording tells of the candidates of its experiment, each for itself on top of the model."""
    searched = smallest_visible(looking, shapes(looking.study, looking.study.estimation.candidates))
    usual = _usual(searched)
    seen = [one for one in usual if math.isfinite(one.factor)]
    larger = [one.shape.grown(min(10.0 * one.factor, one.largest)) for one in seen]
    made = looking.changes([(one.shape.candidate, values) for one, values in zip(seen, larger, strict=True)])
    truths = [one.nearest if change is None or change.above < 1.0 else change for one, change in zip(seen, made, strict=True)]
    known = [change for change in truths if change is not None]
    rivals = rivals_of(looking, known, [one.nearest for one in searched if one.nearest is not None])
    return _table(looking, usual, {change.candidate.part: (change, found) for change, found in zip(known, rivals, strict=True)})


def _table(looking: Looking, usual: Sequence[Visible], compared: Mapping[str, tuple[ChannelChange, list[FittedRival]]]) -> Isolation:
    """Return the effects with the matrix, those last that one direction of motion shows only as what they refine."""
    experiment, method = looking.study.estimation, looking.study.method
    candidates = [*(one.shape.candidate for one in usual), *experiment.one_sided]
    places = {one.part: place for place, one in enumerate(candidates)}
    behind, told_from = np.full((len(candidates), len(candidates)), np.nan), np.full((len(candidates), len(candidates)), np.inf)
    effects, changes, found = [], [], []
    for row, one in enumerate(usual):
        change, rivals = compared.get(one.shape.candidate.part, (None, []))
        if change is not None:
            behind[row], told_from[row] = np.inf, 0.0
        for rival in rivals:
            column = places[rival.candidate.part]
            behind[row, column] = max(rival.behind, 0.0) / rival.limit
            told_from[row, column] = _told_from(rival, method) * _size(one, change)
        beside = [other for other in experiment.one_sided if other.at == one.shape.candidate.at and change is not None]
        for other in (other for other in beside if is_told_by_direction(one.shape.candidate, other)):
            behind[row, places[other.part]], told_from[row, places[other.part]] = 0.0, np.inf
        tied = bool(np.any(behind[row] < 1.0))
        why = "; ".join(reasons(looking, one, seen=change is not None)) if tied or change is None else ""
        effects.append(_answerable(one, change, experiment, why))
        changes.append(change)
        found.append(tuple(rivals))
    for other in experiment.one_sided:
        why = "; ".join(motion_lacks(experiment, other, method))
        size = other.parameters[0]
        unit = experiment.sensed.plan.unit(size)
        effects.append(Answerable(other.name, other.place, other.family, Place.of(size).port, unit, math.inf, math.nan, why))
    return Isolation(tuple(effects), behind, told_from, tuple(changes), tuple(found))


def _usual(searched: Sequence[Visible]) -> list[Visible]:
    """Return of the shapes of each candidate the one whose smallest visible size is the middle one."""
    shapes_of: dict[str, list[Visible]] = {}
    for one in searched:
        shapes_of.setdefault(one.shape.candidate.part, []).append(one)
    ranked = (sorted(some, key=lambda one: one.factor) for some in shapes_of.values())
    return [some[(len(some) - 1) // 2] for some in ranked]


def _size(one: Visible, change: ChannelChange | None) -> float:
    """Return the size that a change has, by the parameter by which its effect is measured [SI]."""
    if change is None:
        return math.nan
    place = change.candidate.parameters.index(one.shape.size)
    return abs(float(change.values[place] - _zero(one, place)))


def _zero(one: Visible, place: int) -> float:
    """Return from where a size counts: a limit counts from nothing, any other size from where the effect is none."""
    return float(one.shape.candidate.neutral[place]) if one.shape.is_size_from_neutral else 0.0


def _answerable(one: Visible, change: ChannelChange | None, experiment: Experiment, why: str) -> Answerable:
    candidate = one.shape.candidate
    place = candidate.parameters.index(one.shape.size)
    smallest = abs(float(one.shape.grown(one.factor)[place] - _zero(one, place))) if math.isfinite(one.factor) and change else math.inf
    unit = experiment.sensed.plan.unit(one.shape.size)
    return Answerable(
        candidate.name, candidate.place, candidate.family, Place.of(one.shape.size).port, unit, smallest, _size(one, change), why
    )


def _told_from(rival: FittedRival, method: Method) -> float:
    """Return the share of an effect's size from which on a rival is told: both what it leaves and what the effect explains grow with the
    square of the size, and the error of the gain in proportion to it."""
    if rival.behind <= method.material * rival.explained:
        return math.inf
    return math.sqrt(least_apart(method) / rival.behind)


def reasons(looking: Looking, one: Visible, *, seen: bool = False) -> list[str]:
    """Return why an effect is not seen, or not told from others, by what the motion lacks and which values take it up."""
    facts = motion_lacks(looking.study.estimation, one.shape.candidate, looking.study.method)
    return facts if seen else [*facts, *_taken_up(looking, one)]


def motion_lacks(experiment: Experiment, candidate: Candidate, method: Method = STANDARD) -> list[str]:
    """Return what the recorded motion lacks at the host of an effect: two directions, several speeds, several loads."""
    host = candidate.seat.of_motion or Place.of(candidate.at).part
    flow = f"{host}.{experiment.machine.assembly.ports(host).get('flow', '')}"
    velocity = {**experiment.doing, **experiment.motion}.get(flow)
    facts = []
    if velocity is not None:
        speed = np.abs(velocity)
        moving = speed > method.sizes.standstill * float(speed.max(initial=0.0))
        if not moving.any():
            return [f"{host} does not move"]
        if one_way(experiment, host, method=method):
            facts.append(f"{host} moves in one direction only")
        if float(np.std(speed[moving])) < method.little * float(np.mean(speed[moving])):
            facts.append(f"{host} moves at one speed")
    source = next((output for target, output in acting(experiment.machine.assembly) if Place.of(target).part == host), "")
    if source in experiment.sensed.plan.channels:
        load = experiment.sensed.channel([], [], experiment.sensed.plan.channels.index(source))
        if float(np.std(load)) < method.little * root_mean_square(load):
            facts.append(f"{host} works under one load")
    return facts


def _taken_up(looking: Looking, one: Visible) -> list[str]:
    """Return what takes up the larger part of an effect that is not seen: values of the model; or that it does next to nothing."""
    change = one.nearest
    floors = looking.study.estimation.sensed.seen_floors
    if change is None:
        return ["the machine would not run"]
    moved, left = (np.array([root_mean_square(row) for row in rows]) for rows in (change.run, change.left))
    if not np.any(moved > floors):
        return ["no recorded channel changes by more than its noise"]
    row = int(np.argmax(moved / floors))
    if left[row] > looking.study.method.larger_part * moved[row]:
        return ["at any plausible size the change stays below model error and noise"]
    amounts = looking.taken.amounts(change.run, looking.fitted.noise)
    parts = np.array([root_mean_square(amount * slope[row]) for amount, slope in zip(amounts, looking.taken.slopes, strict=True)])
    least = looking.study.method.larger_part * parts.max(initial=0.0)
    named = [looking.taken.names[place] for place in np.argsort(-parts)[: Shown.most_named] if parts[place] > least]
    by_part = {candidate.part: f"{candidate.name} at {candidate.place}" for candidate in looking.study.estimation.candidates}
    named = list(dict.fromkeys(by_part.get(Place.of(name).part, name) for name in named))
    return [f"a change of {' and '.join(named)} looks the same"]


def locked(study: Study, found: Found) -> tuple[Found, tuple[Unanswerable, ...]]:
    """Return a search with the rivals that it passed by, and the effects that its recordings do not show.

    A search fits the rivals that a linear estimate ranks first, from usual values. One that does the same with the period or the instant of
    the effect itself is fitted here; where it predicts as well, it is a tie.
    """
    if not found.complete or study.earlier is not None or study.ends.is_over:
        return found, ()
    looking = Looking.at(replace(study, validation=study.estimation), found.model.fitted)
    there = {one.part for one in found.model.candidates}
    shaped = shapes(study, [one for one in study.estimation.candidates if one.part not in there], few=1)
    others = looking.changes([(shape.candidate, shape.point) for shape in shaped], judged=False)
    known = [change for change in others if change is not None]
    for part, worth in found.worth.items():
        rivals = _passed_by(study, looking, found, worth, known)
        found = replace(found, rivals={**found.rivals, part: (*found.rivals.get(part, ()), *rivals)})
    hidden = [(one.shape.candidate, "; ".join(reasons(looking, one))) for one in unseen(looking, shaped)]
    return found, tuple(Unanswerable(candidate.name, candidate.place, why) for candidate, why in hidden)


def _passed_by(study: Study, looking: Looking, found: Found, worth: Tried, others: Sequence[ChannelChange]) -> tuple[Tried, ...]:
    """Return the rivals of an effect that predict as well in its place, fitted from the values that the model has beside the effect.

    The search fits a rival beside the values that were reached without the effect, which may be far from those with it.
    """
    left = neutral(found.model, worth.candidate)
    (gone,) = looking.changes([(worth.candidate, worth.candidate.neutral)], judged=False)
    if gone is None:
        return ()
    beside = Looking.at(looking.study, replace(left.fitted, residual=left.fitted.residual - gone.run))

    def seen(one: ChannelChange) -> ChannelChange:
        return replace(one, left=beside.taken.left(one.run, beside.fitted.noise))

    own = np.array([looking.fitted.by_name[name] for name in worth.candidate.parameters])
    truth = seen(replace(gone, values=own, run=-gone.run))
    (begun,) = alike(beside, [truth], [seen(one) for one in others], study.method.larger_part)
    # a delay of another size, or beside the effect, shows an edge elsewhere
    in_place = [one for one in beside.changes(begun, judged=False) if one is not None]
    (begun,) = alike(beside, [truth], in_place, study.method.nearly_all)
    tied = {one.candidate.part for one in found.rivals.get(worth.candidate.part, ())}

    def made(one: tuple[Candidate, FloatArray]) -> Tried:
        return settled_trial(study, worth.before, tried(study, left, Screened(one[0], 0.0, (one[1],)), None))

    return ties(study, worth, list(together(made, [one for one in begun if one[0].part not in tied])))
