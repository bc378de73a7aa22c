"""How the search goes about it: its limits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class Settings:
    """How the search goes about it."""

    most_effects: int = 4
    longest: float = np.inf
    """Time after which the search ends and keeps what is known [s]."""
    most_runs: int = 5_000
    runs_a_candidate: int = 60
    """Runs of a recording, in all or for each candidate if that is more, after which no further effect is looked for: one of 30 s at 1 kHz
    takes some 8 ms, on one core."""
    screened: int = 5
    """Candidates fitted in one round."""
    worth_a_fit: float = 0.25
    """Share of the best candidate's screening score below which a candidate is not fitted."""
    margin: float = 10.0
    """Nats by which a fit must get better beyond its parameters' due and beyond the null maximum among the candidates."""
    per_parameter: float = 3.0
    against_null_maximum: bool = True
    """Whether the null maximum among the candidates counts against an effect."""
    validation_margin: float = 3.0
    validation_share: float = 0.01
    """The validation recording must gain that many nats, and this share of what the fitted one does."""
    smallest_move: float = 1.0
    """An effect must move a channel by more than this many times what is left unexplained there ..."""
    small_move: float = 0.3
    almost_all: float = 0.9
    """... or this many times, where it removes almost all of the error: effects not found yet may leave more there than it moves; ..."""
    most_of_rest: float = 0.75
    as_much: float = 0.8
    """... or most of what others left, and gains as much on the validation recording: what answers to a load does not."""
    most_degradation: float = 1.5
    """Factor by which an effect may make a channel of the lesson's own simulation worse."""
    largest_size: float = 30.0
    """Largest usual sizes of an effect beyond which it is not believed ..."""
    largest_shape: float = 10.0
    """... and the same of its other values, where these are usually positive: a peak at low speed that lasts to 5 m/s is none."""
    possible: Mapping[str, float] = field(default_factory=dict)
    """How large parameters (free name -> size) could be on this machine, whatever is usual on others."""
    smallest_shape: float = 100.0
    """Factor below their usual range: a warm-up of a millisecond is a constant in disguise. A range that begins at nothing has no below."""
    share_of_all: float = 0.03
    share_of_rest: float = 0.15
    """An effect must remove both of these shares of the error: of all that was there, and of what the others left ..."""
    nearly_all_of_rest: float = 0.6
    """... or this share of what the others left, however little of all that is."""
    left_by_refined: float = 0.25
    """Share of what a simple form leaves that a refined one may leave to take its place with one value more; with two more, half of it."""
    despite_implausible_values: bool = False
    """Whether values of the lesson that are wrong beyond belief are no reason to doubt an effect, as another one may yet ease them."""
    nearly_worth: float = 0.5
    """Share of ``nearly_all_of_rest`` that a candidate must screening score to be fitted, where it cannot come to the other two."""

    def affords(self, runs: int, candidates: int) -> bool:
        """Return whether a search among so many candidates may go on after so many runs."""
        return runs <= max(self.most_runs, candidates * self.runs_a_candidate)
