"""The state of a search: what it has found, as far as it has come. Each move of a search returns a further one."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from lathesim.diagnosis.records.controller_value import ControllerValue
from lathesim.diagnosis.records.history import Step, step_between
from lathesim.diagnosis.records.screened import Screened
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.records.model import Model, Trial

Trials = Mapping[str, Sequence[Trial]]
"""Trials by the part of the effect that they were made for."""


@dataclass(frozen=True)
class SearchResult:
    """The outcome of a search, as far as it has come: the refitted baseline, the model, and what was tried beside each effect."""

    baseline: Model
    model: Model
    trials: Trials = field(default_factory=dict)
    tried: Sequence[Trial] = ()
    """Every candidate that was fitted, in order."""
    screened: tuple[Screened, ...] = ()
    null_maximum: float = 0.0
    """What the null maximum is in the last round of screening [nats]."""
    forms: Mapping[str, Sequence[Candidate]] = field(default_factory=dict)
    """By the part of an effect: refined forms that explain as much as it does with another effect of the model."""
    unseen: Mapping[str, Sequence[Candidate]] = field(default_factory=dict)
    """By the part of an effect: refined forms of usual size that would show too little here to be told from it."""
    restarted_from: Sequence[Trial] = ()
    """What was believable as the first effect, the one that was taken left out; the best first."""
    implausible_effects: frozenset[str] = frozenset()
    """Parts of effects that came in together with a value further off than the lesson holds possible."""
    before: Mapping[str, Model] = field(default_factory=dict)
    """By the part of an effect: the model before it came in."""
    refused: frozenset[str] = frozenset()
    """Parts of effects that were taken out again as they need a machine that is not there."""
    there_before: frozenset[str] = frozenset()
    """Parts of effects that explain as much of the recording from before a change."""
    jointly_off: tuple[str, ...] = ()
    """Values of the lesson that are all there is to it once they may be further off than it holds possible, the furthest first."""
    far_off: tuple[str, ...] = ()
    """A value of the lesson that is further off than it holds possible and explains more than effects do, and others that would."""
    factor_instead: str = ""
    """The factor of a reading that would explain as much as that value."""
    values_instead: tuple[str, ...] = ()
    """Values of the lesson that would explain as much as what was found, were they so far off."""
    controller: ControllerValue | None = None
    """A value of a controller that is another one than the lesson's."""
    to_ease: bool = False
    """Whether the search began with an effect beside which values were implausible, to see whether another one eases them."""
    unmoved: Trials = field(default_factory=dict)
    """By the part of an effect: what was as good when it came in, but moved next to nothing beside what was not found yet."""
    history: tuple[Step, ...] = ()
    """The changes of the model that were accepted, in order."""
    complete: bool = False
    ended_after: int = 0
    """Runs after which no further effect was looked for; 0 where the search came to its own end."""

    @property
    def excluded(self) -> frozenset[str]:
        """The parts of effects that are not tried again."""
        return self.refused | self.there_before

    @property
    def values_off(self) -> tuple[str, ...]:
        """The value of the lesson that is further off than it holds possible, and others that would do as well: a controller's, which is
        sure, comes first."""
        return (self.controller.name,) if self.controller else self.far_off

    def removed_by(self, candidate: Candidate) -> float:
        """Return the share of the whole error that an effect of the model explained when it came in."""
        own = self.trial_of(candidate)
        return own.share_of_all if own else 0.0

    def trial_of(self, candidate: Candidate) -> Trial | None:
        """Return the trial with which an effect of the model came in; none where it has no trial of its own."""
        return next((trial for trial in self.trials.get(candidate.part, ()) if trial.candidate.part == candidate.part), None)

    def accepted(self, model: Model, move: str, why: str, **changes: Any) -> SearchResult:
        """Return the search with a model in the place of the one that was found, the step noted, and other changes of its fields."""
        return replace(self, model=model, history=(*self.history, step_between(self.model, model, move, why)), **changes)

    def having_tried(self, trials: Iterable[Trial]) -> SearchResult:
        """Return the search with further trials."""
        return replace(self, tried=(*self.tried, *trials))

    def with_unseen(self, candidate: Candidate, forms: Iterable[Candidate]) -> SearchResult:
        """Return the search with refined forms that an effect cannot be told from here."""
        return replace(self, unseen={**self.unseen, candidate.part: (*self.unseen.get(candidate.part, ()), *forms)})

    def trials_with(self, others: Trials, *gone: Candidate) -> Trials:
        """Return the trials with others in their place, and without those of effects that are gone."""
        return {part: trials for part, trials in {**self.trials, **others}.items() if part in others or part not in _parts(gone)}

    def taking_over(self, candidate: Candidate, *others: Candidate) -> SearchResult:
        """Return the search in which an effect, and what was tried in its place, has the shares that others explained: it has made them
        needless."""
        share = sum(self.removed_by(other) for other in others)
        trials = self.trials.get(candidate.part, ())
        return replace(self, trials={**self.trials, candidate.part: credited(trials, share)})

    def holds(self, candidate: Candidate) -> bool:
        """Return whether an effect is in the model, perhaps with fewer of its values."""
        return candidate.part in _parts(self.model.candidates)

    def was_held_against(self, trial: Trial) -> bool:
        """Return whether a trial was made on top of the model, or with a finer form in the place of one of its effects: the rest of
        which it takes a share away is then what the model leaves."""
        # by their names: an effect that does with fewer values is the same effect
        there = _parts(self.model.candidates)
        rest = _parts(candidate for candidate in trial.model.candidates if candidate is not trial.candidate)
        replaced = [candidate for candidate in self.model.candidates if candidate.part not in rest]
        if trial.candidate.part in there or not rest <= there:
            return False
        return not replaced or (len(replaced) == 1 and replaced[0].name in trial.candidate.effect.identification.generalises)


def credited(trials: Iterable[Trial], share: float) -> list[Trial]:
    """Return trials with a further share of the whole error."""
    return [replace(trial, share_of_all=min(trial.share_of_all + share, 1.0)) for trial in trials]


def _parts(candidates: Iterable[Candidate]) -> set[str]:
    return {candidate.part for candidate in candidates}
