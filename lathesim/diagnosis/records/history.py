"""The course of a search, step by step."""

from __future__ import annotations

from dataclasses import dataclass

from lathesim.identification.records.model import Model


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


def step_between(before: Model, after: Model, move: str, why: str) -> Step:
    """Return the step of a move from one model to another."""
    names = [tuple(f"{one.name} at {one.at}" for one in model.candidates) for model in (before, after)]
    came_in, went = (tuple(name for name in names[one] if name not in names[1 - one]) for one in (1, 0))
    gains = after.score.above(before.score, full_band=True), after.validation.above(before.validation, full_band=True)
    return Step(move, came_in, went, *gains, why)
