"""Why an effect that was believed is refused after all, once it is fitted to the end."""

from __future__ import annotations

from collections.abc import Collection, Iterable

from lathesim.diagnosis.candidates.periodic_starts import WAVES
from lathesim.diagnosis.location.missing_force import missing_signal
from lathesim.diagnosis.location.missing_share import FORCES, NEXT_TO_NOTHING, missing_share, missing_signals, next_to_nothing
from lathesim.diagnosis.method import Settings
from lathesim.diagnosis.records.search import Found
from lathesim.diagnosis.selection.acceptance import of_usual_size
from lathesim.diagnosis.selection.laboratory import Bench
from lathesim.identification.records.candidate import Term
from lathesim.identification.records.model import Model, Trial
from lathesim.identification.replay.experiment import Rig

_MUCH = 0.3
"""Share of all that was there from which on a wave is much of it."""
_SMALL = 0.01
"""Share of all that was there below which an effect beside others is asked how much of what acts it is."""


def refusal(bench: Bench, before: Model, trial: Trial, settled: Model, settings: Settings) -> str:
    """Say why the effect of a trial is refused; empty where it is not."""
    if not of_usual_size(trial.term, settled.fitted.by_name, settings):
        return "fitted to the end it is no such effect"
    if is_trifling(bench, before, settled, trial):
        return "what it takes away is next to nothing of what acts there"
    return ""


def is_trifling(bench: Bench, before: Model, after: Model, trial: Trial) -> bool:
    """Say whether an effect beside others takes away next to nothing of what acts: what tiny steps of a simulation leave of large forces,
    any resonance explains."""
    small = bool(before.terms) and trial.share_of_all < _SMALL and all_push(bench.rig, [trial.term])
    return small and next_to_nothing(missing_signals(bench.held_out, before, after))


def is_much_of_it(term: Term, found: Found) -> bool:
    """Say whether a wave is much of what was left: how finely a simulation steps, or when samples were taken, repeats along no way."""
    return term.family == WAVES and found.removed_by(term) > _MUCH


def quiet_parts(bench: Bench, model: Model) -> set[str]:
    """Give the parts at which a model with effects leaves so little of what acts that whatever pushed there would be refused."""
    quiet: dict[str, bool] = {}
    if not model.terms:
        return set()
    for row in range(len(bench.held_out.machine.compare)):
        missing = missing_signal(bench.held_out, model.held_out_fit, row)
        if missing.unit in FORCES:
            share, _ = missing_share(bench.held_out, model.held_out_fit, row)
            part = missing.at.partition(".")[0]
            quiet[part] = quiet.get(part, True) and share < NEXT_TO_NOTHING
    return {part for part, is_quiet in quiet.items() if is_quiet}


def pushes_at(term: Term, parts: Collection[str]) -> bool:
    """Say whether a term is a force at one of some parts and shows nowhere else; what repeats along the way is quicker than the motion, in
    whose band a missing force is told, and shows beyond it."""
    return term.effect.site == "effort" and not term.effect.beyond and term.family != WAVES and term.at.partition(".")[0] in parts


def all_push(rig: Rig, terms: Iterable[Term]) -> bool:
    """Say whether terms act at parts that a force moves: what is small as a force may be a large error of a sensor."""
    pushed = {part.name for part in rig.machine.assembly.parts if "effort" in part.component.ports}
    return all(term.at.partition(".")[0] in pushed for term in terms)
