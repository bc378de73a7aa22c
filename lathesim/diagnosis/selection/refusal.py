"""Why an effect that was believed is refused after all, once it is fitted to the end."""

from __future__ import annotations

from collections.abc import Collection, Iterable

from lathesim.diagnosis.candidates.periodic_starts import WAVES
from lathesim.diagnosis.location.missing_force import missing_signal
from lathesim.diagnosis.location.missing_share import FORCES, NEXT_TO_NOTHING, missing_share, missing_signals, next_to_nothing
from lathesim.diagnosis.method import Settings
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection.acceptance import of_usual_size
from lathesim.diagnosis.selection.laboratory import Laboratory
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.records.model import Model, Trial
from lathesim.identification.replay.experiment import Experiment

_MUCH = 0.3
"""Share of all that was there above which a wave is much of it."""
_SMALL = 0.01
"""Share of all that was there below which an effect beside others is asked how much of what acts it is."""


def refusal(laboratory: Laboratory, before: Model, trial: Trial, settled: Model, settings: Settings) -> str:
    """Return why the effect of a trial is refused; empty where it is not."""
    if not of_usual_size(trial.candidate, settled.fitted.by_name, settings):
        return "fitted to the end it is no such effect"
    if is_trifling(laboratory, before, settled, trial):
        return "what it takes away is next to nothing of what acts there"
    return ""


def is_trifling(laboratory: Laboratory, before: Model, after: Model, trial: Trial) -> bool:
    """Return whether an effect beside others explains next to nothing of what acts: what tiny steps of a simulation leave of large forces,
    any resonance explains."""
    small = bool(before.candidates) and trial.share_of_all < _SMALL and all_push(laboratory.experiment, [trial.candidate])
    return small and next_to_nothing(missing_signals(laboratory.validation, before, after))


def is_much_of_it(candidate: Candidate, found: SearchResult) -> bool:
    """Return whether a wave is much of what was left: how finely a simulation steps, or when samples were taken, repeats along no way."""
    return candidate.family == WAVES and found.removed_by(candidate) > _MUCH


def quiet_parts(laboratory: Laboratory, model: Model) -> set[str]:
    """Return the parts at which a model with effects leaves so little of what acts that whatever pushed there would be refused."""
    quiet: dict[str, bool] = {}
    if not model.candidates:
        return set()
    for row in range(len(laboratory.validation.machine.compare)):
        missing = missing_signal(laboratory.validation, model.validation_fit, row)
        if missing.unit in FORCES:
            share, _ = missing_share(laboratory.validation, model.validation_fit, row)
            part = missing.at.partition(".")[0]
            quiet[part] = quiet.get(part, True) and share < NEXT_TO_NOTHING
    return {part for part, is_quiet in quiet.items() if is_quiet}


def pushes_at(candidate: Candidate, parts: Collection[str]) -> bool:
    """Return whether a candidate is a force at one of some parts and shows nowhere else; what repeats along the way is quicker than the
    motion, in whose band a missing force is told, and shows beyond it."""
    return (
        candidate.effect.site == "effort"
        and not candidate.effect.beyond
        and candidate.family != WAVES
        and candidate.at.partition(".")[0] in parts
    )


def all_push(experiment: Experiment, candidates: Iterable[Candidate]) -> bool:
    """Return whether candidates act at parts that a force moves: what is small as a force may be a large error of a sensor."""
    pushed = {part.name for part in experiment.machine.assembly.parts if "effort" in part.component.ports}
    return all(candidate.at.partition(".")[0] in pushed for candidate in candidates)
