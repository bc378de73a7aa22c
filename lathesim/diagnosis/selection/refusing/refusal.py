"""Why an effect that was believed is refused after all, once it is fitted to the end."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from enum import Enum

from lathesim.diagnosis.location.missing_force import missing_signal
from lathesim.diagnosis.location.missing_share import FORCES, missing_share, missing_signals, next_to_nothing
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection.acceptance import of_usual_size
from lathesim.diagnosis.selection.laboratory import Laboratory
from lathesim.diagnosis.selection.refusing.earlier import is_old_and_small
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.records.model import Model, Trial
from lathesim.identification.replay.experiment import Experiment


class Refusal(Enum):
    """Why an effect is refused, in words."""

    NO_SUCH_EFFECT = "fitted to the end it is no such effect"
    OLD_AND_SMALL = "it explains as much of the recording from before the change"
    TRIFLING = "what it takes away is next to nothing of what acts there"


def refusal(laboratory: Laboratory, found: SearchResult, trial: Trial, settled: Model, method: Method) -> Refusal | None:
    """Return why the effect of a trial is refused, or None where it is not."""
    if not of_usual_size(trial.candidate, settled.fitted.by_name, method):
        return Refusal.NO_SUCH_EFFECT
    if is_old_and_small(laboratory, trial, settled, found.null_maximum, method):
        return Refusal.OLD_AND_SMALL
    return Refusal.TRIFLING if is_trifling(laboratory, found.model, settled, trial, method=method) else None


def is_trifling(laboratory: Laboratory, before: Model, after: Model, trial: Trial, method: Method = STANDARD) -> bool:
    """Return whether an effect beside others explains next to nothing of what acts: what tiny steps of a simulation leave of large forces,
    any resonance explains."""
    small = (
        not method.beside_earlier
        and bool(before.candidates)
        and trial.share_of_all < method.selection.small_effect
        and all_push(laboratory.experiment, [trial.candidate])
    )
    return small and next_to_nothing(missing_signals(laboratory.validation, before, after, method=method), method=method)


def is_much_of_it(candidate: Candidate, found: SearchResult, method: Method = STANDARD) -> bool:
    """Return whether a wave is much of what was left: how finely a simulation steps, or when samples were taken, repeats along no way."""
    return bool(candidate.effect.identification.periodic) and found.removed_by(candidate) > method.selection.much_of_all


def quiet_parts(laboratory: Laboratory, model: Model, method: Method = STANDARD) -> set[str]:
    """Return the parts at which a model with effects leaves so little of what acts that whatever pushed there would be refused."""
    quiet: dict[str, bool] = {}
    if not model.candidates or method.beside_earlier:
        return set()
    for row in range(len(laboratory.validation.machine.compare)):
        missing = missing_signal(laboratory.validation, model.validation_fit, row)
        if missing.unit in FORCES:
            share, _ = missing_share(laboratory.validation, model.validation_fit, row)
            part = missing.at.partition(".")[0]
            quiet[part] = quiet.get(part, True) and share < method.location.integration_error
    return {part for part, is_quiet in quiet.items() if is_quiet}


def pushes_at(candidate: Candidate, parts: Collection[str]) -> bool:
    """Return whether a candidate is a force at one of some parts and shows nowhere else; what repeats along the way is quicker than the
    motion, in whose band a missing force is told, and shows beyond it."""
    return (
        candidate.effect.site == "effort"
        and not candidate.effect.beyond
        and not candidate.effect.identification.periodic
        and candidate.at.partition(".")[0] in parts
    )


def all_push(experiment: Experiment, candidates: Iterable[Candidate]) -> bool:
    """Return whether candidates act at parts that a force moves: what is small as a force may be a large error of a sensor."""
    pushed = {part.name for part in experiment.machine.assembly.parts if "effort" in part.component.ports}
    return all(candidate.at.partition(".")[0] in pushed for candidate in candidates)
