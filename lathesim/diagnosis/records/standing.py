"""How the candidates of a search stand while it goes on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


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
