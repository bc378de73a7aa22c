"""What is known of the machine behind a recording."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from tests.shared_data import SHARED

DATA = SHARED / "data"


@dataclass(frozen=True)
class Size:
    """A true value of a parameter, told to a ``rounding``; ``known`` only where the machine was simulated, else a grey box was fitted."""

    parameter: str
    value: float
    unit: str
    known: bool = False
    rounding: float = 0.0

    def is_within(self, low: float, high: float) -> bool:
        """Return whether an interval holds the value, as far as its rounding tells."""
        return low - self.rounding <= self.value <= high + self.rounding


@dataclass(frozen=True)
class Hidden:
    """An effect of the machine: the names that are right for it, the parts where it may stand, its sizes, and names partly right."""

    names: tuple[str, ...]
    at: tuple[str, ...]
    sizes: tuple[Size, ...] = ()
    near: tuple[str, ...] = ()

    def is_named_by(self, effect: str, at: str) -> bool:
        """Return whether an effect of an answer is this one, at its place."""
        return effect in self.names and self.is_at(at)

    def is_at(self, at: str) -> bool:
        """Return whether a place, a part or a signal of it, is the right one."""
        return at.partition(".")[0] in self.at


@dataclass(frozen=True)
class Deciding:
    """The channel whose held-out error decides, in which list of the answer it stands, and what a grey box leaves there.

    ``within`` is "fit" (simulation of the lesson) or "missing" (what the channel lacks beside the other recorded ones).
    """

    within: str
    channel: str
    unit: str
    grey_box: float | None


@dataclass(frozen=True)
class Case:
    """A recording with its lesson; ``beside`` is what the machine shows too, so that naming it is no mistake."""

    name: str
    folder: str
    lesson: str
    fitted: str
    validation: str
    truth: str
    hidden: tuple[Hidden, ...] = ()
    beside: tuple[Hidden, ...] = ()
    deciding: Deciding | None = None
    values: tuple[Size, ...] = ()
    """Values of the lesson that are off by more than declared."""

    def file(self, name: str) -> Path:
        """Return where a file of the case lies."""
        return DATA / self.folder / name

    @property
    def words(self) -> list[str]:
        """The lesson and the recordings, as the command ``diagnose`` takes them."""
        judging = ["--validate", str(self.file(self.validation))] if self.validation else []
        return [str(self.file(self.lesson)), str(self.file(self.fitted)), *judging]
