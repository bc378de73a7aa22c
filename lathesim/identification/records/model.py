"""A model of a recording: the baseline with the effects accepted so far, and what is said of candidates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from lathesim.identification.records.candidate import Candidate
from lathesim.identification.records.fit import Fitted, Free, with_start


@dataclass(frozen=True)
class Model:
    """The baseline with some effects, fitted; ``validation_fit`` is the model on the validation recording, with only what belongs to a
    recording fitted anew."""

    candidates: tuple[Candidate, ...]
    fitted: Fitted
    validation_fit: Fitted

    @property
    def free(self) -> list[Free]:
        """The free parameters, starting where they ended."""
        return with_start(self.fitted)


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
