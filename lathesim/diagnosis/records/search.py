"""What a search has found, as the answer is drawn from it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from lathesim.diagnosis.records.controller_value import ControllerValue
from lathesim.diagnosis.records.history import Step
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.records.model import Model, Trial


@dataclass(frozen=True)
class SearchResult:
    """The outcome of a search, as far as it has come: the lesson with its values refitted, the model that predicts best, all trials.

    ``trials`` are, by the part of an effect of the model, what it is worth beside the others and what predicts as well in its place.
    ``there_before`` are parts of effects that a recording from before a change shows too. ``jointly_off`` are values of the lesson that are
    further off than it holds possible, the furthest first; ``controller`` is a value of a controller that is another one.
    """

    baseline: Model
    model: Model
    trials: Mapping[str, Sequence[Trial]] = field(default_factory=dict)
    tried: Sequence[Trial] = ()
    there_before: frozenset[str] = frozenset()
    jointly_off: tuple[str, ...] = ()
    controller: ControllerValue | None = None
    history: tuple[Step, ...] = ()
    complete: bool = False

    @property
    def far_off(self) -> tuple[str, ...]:
        """The value of the lesson that is furthest off, if any is further off than it holds possible."""
        return self.jointly_off[:1]

    @property
    def values_off(self) -> tuple[str, ...]:
        """The value of the lesson that is further off than it holds possible: a controller's, which is sure, comes first."""
        return (self.controller.name,) if self.controller else self.far_off

    def trial_of(self, candidate: Candidate) -> Trial | None:
        """Return what an effect of the model is worth beside the others; none where that is not known."""
        return next((trial for trial in self.trials.get(candidate.part, ()) if trial.candidate.part == candidate.part), None)

    def holds(self, candidate: Candidate) -> bool:
        """Return whether an effect is in the model."""
        return any(one.part == candidate.part for one in self.model.candidates)
