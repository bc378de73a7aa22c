"""Which candidates may come next: simple effects that are due, and finer ones for when no simple one is believable."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from lathesim.diagnosis.location import one_way
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.effects.effect import Effect
from lathesim.engine.assembly import Place
from lathesim.identification.records import Candidate, Model
from lathesim.identification.replay.experiment import Experiment


def due(model: Model, experiment: Experiment) -> list[Candidate]:
    """Return the simple effects that may be added: what they stand on is there, and no refined form of them is."""
    there = {candidate.part for candidate in model.candidates}
    refined = {(name, other.at) for other in model.candidates for name in other.effect.identification.generalises}
    left = [one for one in experiment.candidates if one.part not in there and (one.name, one.at) not in refined]
    return [one for one in left if not one.effect.identification.generalises and stands(one, model, experiment)]


def finer(model: Model, experiment: Experiment) -> list[Candidate]:
    """Return the refined forms of laws of which the model holds no form, and those that stand on others that are not there: for when no
    simple effect is believable."""
    forms = {(name, other.at) for other in model.candidates for name in (other.name, *other.effect.identification.generalises)}
    return [
        candidate
        for candidate in experiment.candidates
        if (candidate.effect.identification.generalises or not stands(candidate, model, experiment))
        and not any((name, candidate.at) in forms for name in (candidate.name, *candidate.effect.identification.generalises))
    ]


def stands(candidate: Candidate, model: Model, experiment: Experiment) -> bool:
    """Return whether what a candidate stands on is there: in the model or in the lesson's machine."""
    forms = {(name, other.at) for other in model.candidates for name in (other.name, *other.effect.identification.generalises)}
    needed = {(name, candidate.at) for name in candidate.effect.identification.prerequisites}
    return not needed or bool(needed & (forms | _in_baseline(experiment)))


def _in_baseline(experiment: Experiment) -> set[tuple[str, str]]:
    """Return what the lesson's machine has already: (effect, host), an inserted one or a parameter of the host with its name."""
    parts = {part.name: part.component for part in experiment.machine.assembly.parts}
    there = set()
    for wire in experiment.machine.assembly.wires:
        source, target = Place.of(wire.source).part, Place.of(wire.target).part
        for effect, host in ((source, target), (target, source)):
            if effect in parts and host in parts and issubclass(parts[effect], Effect):
                there.add((parts[effect].__name__, host))
    for name, component in parts.items():
        if "dry_friction" in component.ports:
            there.add(("CoulombFriction", name))
    return there


def without_one_sided(experiments: Sequence[Experiment], method: Method = STANDARD) -> list[Experiment]:
    """Return the experiments of some recordings whose candidates are told from what they refine by them: with a host that always moves
    one way, what differs between two directions is left out."""
    sided = [
        candidate
        for candidate in experiments[0].candidates
        if candidate.effect.identification.needs_both_ways
        and all(one_way(experiment, candidate.at, method=method) for experiment in experiments)
    ]
    if not sided:
        return list(experiments)
    parts = {candidate.part for candidate in sided}
    kept = tuple(candidate for candidate in experiments[0].candidates if candidate.part not in parts)
    return [replace(experiment, candidates=kept, one_sided=tuple(sided)) for experiment in experiments]


def is_told_by_direction(candidate: Candidate, other: Candidate) -> bool:
    """Return whether how both act in two directions alone tells a candidate from another, which refines it or repeats like it there."""
    alike = (candidate.effect.family, candidate.effect.site) == (other.effect.family, other.effect.site)
    return candidate.name in other.effect.identification.generalises or (alike and candidate.effect.identification.periodic is True)
