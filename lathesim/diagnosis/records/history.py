"""The course of a search, step by step."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Step:
    """A change of the model that was accepted: the move that proposed it, which effects came in and went, and what it gained.

    ``gain`` and ``validation_gain`` are the changes of the log-likelihood of the two recordings on all frequencies [nats]; a simpler model
    may lose a little. ``why`` says it in words.
    """

    move: str
    came_in: tuple[str, ...]
    went: tuple[str, ...]
    gain: float
    validation_gain: float
    why: str = ""
