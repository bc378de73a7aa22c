"""What a search has found, as far as it has come."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from lathesim.diagnosis.records.controller_value import ControllerValue
from lathesim.diagnosis.records.history import Step
from lathesim.diagnosis.records.screened import Screened
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.records.model import Model, Trial


@dataclass
class SearchResult:
    """The outcome of a search, as far as it has come: the refitted baseline, the model, and what was tried beside each effect."""

    baseline: Model
    model: Model
    trials: dict[str, list[Trial]] = field(default_factory=dict)
    tried: list[Trial] = field(default_factory=list)
    """Every candidate that was fitted, in order."""
    screened: tuple[Screened, ...] = ()
    null_maximum: float = 0.0
    """What the null maximum is in the last round of screening [nats]."""
    forms: dict[str, list[Candidate]] = field(default_factory=dict)
    """By the part of an effect: refined forms that explain as much as it does with another effect of the model."""
    unseen: dict[str, list[Candidate]] = field(default_factory=dict)
    """By the part of an effect: refined forms of usual size that would show too little here to be told from it."""
    restarted_from: list[Trial] = field(default_factory=list)
    """What was believable as the first effect, the one that was taken left out; the best first."""
    implausible_effects: set[str] = field(default_factory=set)
    """Parts of effects that came in together with a value further off than the lesson holds possible."""
    before: dict[str, Model] = field(default_factory=dict)
    """By the part of an effect: the model before it came in."""
    refused: set[str] = field(default_factory=set)
    """Parts of effects that were taken out again as they need a machine that is not there."""
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
    unmoved: dict[str, list[Trial]] = field(default_factory=dict)
    """By the part of an effect: what was as good when it came in, but moved next to nothing beside what was not found yet."""
    history: tuple[Step, ...] = ()
    """The changes of the model that were accepted, in order."""
    complete: bool = False
    ended_after: int = 0
    """Runs after which no further effect was looked for; 0 where the search came to its own end."""

    @property
    def values_off(self) -> tuple[str, ...]:
        """The value of the lesson that is further off than it holds possible, and others that would do as well: a controller's, which is
        sure, comes first."""
        return (self.controller.name,) if self.controller else self.far_off

    def removed_by(self, candidate: Candidate) -> float:
        """Return the share of the whole error that an effect of the model explained when it came in."""
        return next((trial.share_of_all for trial in self.trials.get(candidate.part, ()) if trial.candidate.part == candidate.part), 0.0)

    def accept(self, model: Model, move: str, why: str = "") -> None:
        """Take a model in the place of the one that was found, and note the step."""
        before, after = ([f"{one.name} at {one.at}" for one in other.candidates] for other in (self.model, model))
        gains = model.score.above(self.model.score, full_band=True), model.validation.above(self.model.validation, full_band=True)
        came_in, went = (tuple(name for name in names if name not in others) for names, others in ((after, before), (before, after)))
        self.history = (*self.history, Step(move, came_in, went, *gains, why))
        self.model = model

    def take_over(self, candidate: Candidate, other: Candidate) -> None:
        """Credit an effect, and what was tried in its place, with the share that another one explained which it has made needless."""
        share = self.removed_by(other)
        trials = self.trials.get(candidate.part, [])
        self.trials[candidate.part] = [replace(trial, share_of_all=min(trial.share_of_all + share, 1.0)) for trial in trials]

    def was_held_against(self, trial: Trial) -> bool:
        """Return whether a trial was made on top of the model, or with a finer form in the place of one of its effects: the rest of
        which it takes a share away is then what the model leaves."""
        # by their names: an effect that does with fewer values is the same effect
        there, rest = (
            {candidate.part for candidate in self.model.candidates},
            {candidate.part for candidate in trial.model.candidates if candidate is not trial.candidate},
        )
        replaced = [candidate for candidate in self.model.candidates if candidate.part not in rest]
        if trial.candidate.part in there or not rest <= there:
            return False
        return not replaced or (len(replaced) == 1 and replaced[0].name in trial.candidate.effect.identification.generalises)
