"""A model of a recording: the baseline with the effects accepted so far, its scores, and a candidate fitted on top of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from lathesim.engine.assembly import FloatArray
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.records.fit import Fitted, Free, with_start


@dataclass(frozen=True)
class Score:
    """Likelihood of a recording under a model [nats]: on the frequencies of the motion, and on all."""

    motion: float
    full_band: float

    def above(self, other: Score, *, full_band: bool) -> float:
        """Return by how much this one is better."""
        return self.full_band - other.full_band if full_band else self.motion - other.motion


@dataclass(frozen=True)
class Model:
    """The baseline with the effects believed so far.

    ``error`` is what each channel is off above its floor, weighed as the baseline's residual is; ``validation_fit`` the model on the
    validation recording, with only what belongs to a recording fitted anew.
    """

    candidates: tuple[Candidate, ...]
    fitted: Fitted
    score: Score
    validation_fit: Fitted
    validation: Score
    error: FloatArray

    @property
    def free(self) -> list[Free]:
        """The free parameters, starting where they ended."""
        return with_start(self.fitted)


@dataclass(frozen=True)
class Trial:
    """A candidate fitted on top of a model: its gains in likelihood on both recordings [nats] and the share of the error it removes."""

    candidate: Candidate
    model: Model
    gain: float
    validation_gain: float
    moves: float
    share_of_all: float
    share_of_rest: float
    restores_plausibility: bool = False
    """Whether the baseline, implausible beyond what the lesson holds possible, no longer is: the error had been absorbed by its values."""
    implausible: bool = False
    """Whether the baseline still is."""
    becomes_implausible: bool = False
    """Whether a value of the lesson is implausible with the effect and none was without it."""
    full_band_gain: float = 0.0
    """The gains on all frequencies, on which trials of slow and of fast effects are held against each other: fitted and validation."""
    full_band_validation_gain: float = 0.0
    closed_loop_degradation: float = 0.0
    """By what factor the lesson's own simulation gets worse in the channel where it does most; below one it gets better everywhere."""


def is_full_band(candidates: Sequence[Candidate]) -> bool:
    """Return whether a model is to be fitted on all frequencies."""
    return any(candidate.effect.identification.full_band for candidate in candidates)


@dataclass(frozen=True)
class CandidateStanding:
    """A candidate with its gain in log-likelihood on the fitted and the held-out recording [nats] and the share of the error it removes.

    ``held_out`` is NaN before the candidate is judged on the held-out recording: it was only screened.
    """

    name: str
    gain: float
    held_out: float
    share: float


class Standing(str):
    """A line of progress that also carries what it says of candidates, for an onlooker that draws it."""

    candidates: tuple[CandidateStanding, ...]

    @classmethod
    def told(cls, text: str, candidates: Sequence[CandidateStanding]) -> Standing:
        """Return the line with its candidates."""
        standing = cls(text)
        standing.candidates = tuple(candidates)
        return standing
