"""What a search has tried and found."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from lathesim.diagnosis.records.comparison import Step
from lathesim.diagnosis.records.diagnosis import with_unit
from lathesim.engine.assembly import FloatArray
from lathesim.identification.records import Candidate, Model
from lathesim.identification.replay.experiment import POSSIBLE, RecordedMachine


@dataclass(frozen=True)
class Screened:
    """A candidate with the log-likelihood that its responses promise [nats], and the starting values that promise most, best first."""

    candidate: Candidate
    gain: float
    starts: tuple[FloatArray, ...]


@dataclass(frozen=True)
class ControllerValue:
    """A parameter (``part.parameter``) of a controller with the value the lesson gives and the one its command follows from [``unit``]."""

    name: str
    unit: str
    given: float
    value: float
    command: str
    share: float
    """Share of the command that does not follow from the lesson's value."""
    error: float = 0.0
    """One standard error."""

    def __str__(self) -> str:
        off = f"{self.value / self.given - 1.0:+.0%}"
        value, given = (with_unit(f"{one:.4g}", self.unit) for one in (self.value, self.given))
        follows = f"{self.command} follows from what its controller was given with {self.name} of {value} ({off})"
        return f"{follows}; with the lesson's {given} {self.share:.0%} of it does not. Taken so for the rest."

    def in_machine(self, machine: RecordedMachine) -> RecordedMachine:
        """Return the machine with the value that was found."""
        return replace(machine, assembly=machine.assembly.with_parameters({self.name: self.value}))


@dataclass(frozen=True)
class Gain:
    """By how much a recording is likelier under one explanation than under another [nats], with one standard error."""

    nats: float
    error: float
    share: float = 0.0
    """Share of the error's power that is gone, in the channel where it is largest."""


@dataclass(frozen=True)
class Tried:
    """A candidate on top of a model, or in the place of one of its effects, with what it gains on both recordings."""

    candidate: Candidate
    before: Model
    model: Model
    fitted: Gain
    predicted: Gain

    @property
    def name(self) -> str:
        """What was tried, and where."""
        return f"{self.candidate.name} at {self.candidate.place}"

    @property
    def parameters(self) -> int:
        """How many values were fitted that are not nothing by themselves."""
        return self.candidate.counted


@dataclass(frozen=True)
class Found:
    """What a search has found: the lesson with its values refitted, the explanation that predicts best, and everything that was fitted.

    ``values`` is the lesson with values further off than it holds possible, where that predicts as well as any effect. By the part of an
    effect of the model, ``worth`` is what it is worth beside the others, and ``rivals`` are what predicts as well in its place.
    ``there_before`` are parts of effects that a recording from before a change shows too; ``controller`` is a value of a controller that
    is another one. ``complete`` says that the search was not stopped.
    """

    baseline: Model
    model: Model
    values: Model | None = None
    tried: tuple[Tried, ...] = ()
    worth: dict[str, Tried] = field(default_factory=dict)
    rivals: dict[str, tuple[Tried, ...]] = field(default_factory=dict)
    there_before: frozenset[str] = frozenset()
    controller: ControllerValue | None = None
    history: tuple[Step, ...] = ()
    complete: bool = False

    def changed(self, move: str, one: Tried, why: str, went: Sequence[Candidate] = ()) -> Found:
        """Return the search with the model of a trial, and the step noted."""
        came_in = () if went and one.candidate in went else (one.name,)
        left = tuple(f"{candidate.name} at {candidate.place}" for candidate in went)
        step = Step(move, came_in, left, one.fitted.nats, one.predicted.nats, why)
        return replace(self, model=one.model, worth={}, rivals={}, history=(*self.history, step))

    def having_tried(self, trials: Sequence[Tried]) -> Found:
        """Return the search with further trials, each of which counts once."""
        known = {id(one) for one in self.tried}
        return replace(self, tried=(*self.tried, *(one for one in trials if id(one) not in known)))

    @property
    def jointly_off(self) -> tuple[str, ...]:
        """The values that are further off than the lesson holds possible, the furthest first; none where other values do not explain."""
        if self.values is None:
            return ()
        fitted = self.model.fitted
        off = {
            one.name: abs(value - one.given) / one.uncertainty
            for value, one in zip(fitted.values, fitted.free, strict=True)
            if one.given and one.is_declared
        }
        return tuple(sorted((name for name, away in off.items() if away > POSSIBLE), key=lambda name: -off[name]))

    @property
    def far_off(self) -> tuple[str, ...]:
        """The value of the lesson that is furthest off, if any is further off than it holds possible."""
        return self.jointly_off[:1]

    @property
    def values_off(self) -> tuple[str, ...]:
        """The value of the lesson that is further off than it holds possible: a controller's, which is sure, comes first."""
        return (self.controller.name,) if self.controller else self.far_off

    def holds(self, candidate: Candidate) -> bool:
        """Return whether an effect is in the model."""
        return any(one.part == candidate.part for one in self.model.candidates)


@dataclass(frozen=True)
class RankedEffect:
    """How sure an effect is: its probability among its rivals, those that predict as well, and the share of the error it takes away.

    ``size_error`` is one standard error of its size by what it gains, as a share, with all blocks of a recording taken for one; infinite
    where such a gain may be chance.
    """

    candidate: Candidate
    probability: float
    tied: tuple[Candidate, ...]
    share: float
    size_error: float = math.inf
