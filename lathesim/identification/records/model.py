"""A model of a recording: the baseline with the effects accepted so far, its scores, and a candidate fitted on top of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from lathesim.engine.assembly import FloatArray
from lathesim.identification.records.candidate import Term
from lathesim.identification.records.fit import Fitted, Free, with_start

FAST_FAMILIES = frozenset({"lag", "structure", "once per turn", "encoder", "drive range", "recording"})
"""Families that show above the frequencies of the motion; a model with one of them is fitted on all frequencies."""


@dataclass(frozen=True)
class Score:
    """Likelihood of a recording under a model [nats]: on the frequencies of the motion, and on all."""

    motion: float
    wide: float

    def above(self, other: Score, *, wide: bool) -> float:
        """Give by how much this one is better."""
        return self.wide - other.wide if wide else self.motion - other.motion


@dataclass(frozen=True)
class Model:
    """The baseline with the effects believed so far.

    ``error`` is what each channel is off above its floor, weighed as the baseline's residual is; ``held_out_fit`` the model on the
    held-out recording, with only what belongs to a recording fitted anew.
    """

    terms: tuple[Term, ...]
    fitted: Fitted
    score: Score
    held_out_fit: Fitted
    held_out: Score
    error: FloatArray

    @property
    def free(self) -> list[Free]:
        """The free parameters, starting where they ended."""
        return with_start(self.fitted)


@dataclass(frozen=True)
class Trial:
    """A candidate fitted on top of a model: its gains in likelihood on both recordings [nats] and the share of the error it removes."""

    term: Term
    model: Model
    gain: float
    held_out_gain: float
    moves: float
    share_of_all: float
    share_of_rest: float
    relieves: bool = False
    """Whether the baseline, strained beyond what the lesson holds possible, no longer is: the error had been absorbed by its values."""
    strained: bool = False
    """Whether the baseline still is."""
    strains_anew: bool = False
    """Whether a value of the lesson is strained with the effect and none was without it."""
    wide_gain: float = 0.0
    """The gains on all frequencies, on which trials of slow and of fast effects are held against each other: fitted and held out."""
    wide_held_out_gain: float = 0.0
    spoils: float = 0.0
    """By what factor the lesson's own simulation gets worse in the channel where it does most; below one it gets better everywhere."""


def is_wide(terms: Sequence[Term]) -> bool:
    """Say whether a model is to be fitted on all frequencies."""
    return any(term.family in FAST_FAMILIES for term in terms)
