"""Which candidates may come next: simple effects that are due, and finer ones for when no simple one is believable."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from lathesim.component import Parameter
from lathesim.diagnosis.location.operating_conditions import one_way
from lathesim.effects.effect import Effect
from lathesim.identification.records.candidate import Term
from lathesim.identification.records.model import Model
from lathesim.identification.replay.experiment import Rig


def due(model: Model, rig: Rig) -> list[Term]:
    """Give the simple effects that may be added: no refinement of another one, and what they stand on is there."""
    there = {term.part for term in model.terms}
    return [term for term in rig.candidates if term.part not in there and _is_due(term, model, rig)]


def finer(model: Model, rig: Rig) -> list[Term]:
    """Give the refined forms of which the simpler ones are not in the model, and those that stand on others that are not there: for when no
    simple effect is believable."""
    there = {(term.name, term.at) for term in model.terms}
    refined = {(name, term.at) for term in model.terms for name in term.effect.refines}
    return [
        term
        for term in rig.candidates
        if (term.effect.refines or not stands(term, model, rig))
        and not any((name, term.at) in there for name in (term.name, *term.effect.refines))
        and (term.name, term.at) not in refined
    ]


def _is_due(term: Term, model: Model, rig: Rig) -> bool:
    """Say whether a term may be added: it is no refinement, what it stands on is there, and no refined form of it is."""
    refined = {(name, other.at) for other in model.terms for name in other.effect.refines}
    return not term.effect.refines and stands(term, model, rig) and (term.name, term.at) not in refined


def stands(term: Term, model: Model, rig: Rig) -> bool:
    """Say whether what a term stands on is there: in the model or in the lesson's machine."""
    there = {(name, other.at) for other in model.terms for name in (other.name, *other.effect.refines)} | _in_baseline(rig)
    return not term.effect.needs or any((name, term.at) in there for name in term.effect.needs)


def _in_baseline(rig: Rig) -> set[tuple[str, str]]:
    """Give what the lesson's machine has already: (effect, host), an inserted one or a parameter of the host with its name."""
    parts = {part.name: part.component for part in rig.machine.assembly.parts}
    there = set()
    for wire in rig.machine.assembly.wires:
        source, target = wire.source.partition(".")[0], wire.target.partition(".")[0]
        for effect, host in ((source, target), (target, source)):
            if effect in parts and host in parts and issubclass(parts[effect], Effect):
                there.add((parts[effect].__name__, host))
    for name, component in parts.items():
        if any("coulomb" in item for item in component.declared(Parameter)):
            there.add(("CoulombFriction", name))
    return there


def without_one_sided(rigs: Sequence[Rig]) -> list[Rig]:
    """Give the rigs of some recordings whose candidates are told from what they refine by them: with a host that always moves one way, what
    differs between two directions is left out."""
    sided = [term for term in rigs[0].candidates if term.effect.needs_both_ways and all(one_way(rig, term.at) for rig in rigs)]
    if not sided:
        return list(rigs)
    parts = {term.part for term in sided}
    kept = tuple(term for term in rigs[0].candidates if term.part not in parts)
    return [replace(rig, candidates=kept, one_sided=tuple(sided)) for rig in rigs]
