"""How explanations of a recording compare: each by what it predicts of data that no fit has used."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Kind = Literal["lesson", "values", "effects", "effect", "fault", "signal", "flexible"]
KINDS: tuple[Kind, ...] = ("lesson", "values", "effects", "effect", "fault", "signal", "flexible")
"""The kinds of explanations, in the order of a table."""
NEVER_REACHED = "is never reached in the recording that judges, which cannot validate it"
HARDLY_REACHED = "changes hardly anything in the recording that judges, which cannot validate it"
"""Why an effect is not kept that fits the first recording clearly better, as a limit that the second one stays below."""


@dataclass(frozen=True)
class Explanation:
    """An explanation that was tried: the lesson, other values, effects, a fault of the recording, a signal, or a flexible function.

    ``gain`` is by how much the log predictive density of the recording that judges is larger with it than without it [nats],
    ``standard_error`` the error of that, and ``chance`` the level that a gain has to exceed. ``reason`` says why it is ``kept`` or not.
    """

    name: str
    place: str
    kind: Kind
    gain: float
    standard_error: float
    chance: float
    kept: bool
    reason: str

    @property
    def text(self) -> str:
        """The name with its place."""
        return f"{self.name} at {self.place}" if self.place else self.name

    @property
    def is_clear(self) -> bool:
        """Whether the gain is above the level that chance may reach."""
        return self.gain > self.chance

    @property
    def is_untested(self) -> bool:
        """Whether it fits the first recording clearly better, and the one that judges does not show it at all."""
        return self.reason in (NEVER_REACHED, HARDLY_REACHED)


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
