"""A signal that nobody recorded, as it was worked out: where it is added, when, how large, of what shape."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lathesim.analysis.display_unit import shown_with_unit
from lathesim.engine.assembly import FloatArray


@dataclass(frozen=True)
class SignalShape:
    """The shape of a signal: its ``kind`` in words with sizes, the stretches in which it is there [s], and the ``share`` of its power that
    the kind explains (0 for one of no simple shape)."""

    words: str
    windows: tuple[tuple[float, float], ...]
    share: float
    repeats: bool = False
    """Whether it is a sine, as a motion may be."""


@dataclass(frozen=True)
class UnrecordedInput:
    """A signal ``values`` (samples,) [``unit``] over ``time`` [s] in one ``recording``, added to ``command`` on its way to ``targets``
    (``part.input``); ``total`` is the recorded command. ``unexplained`` is its share of the command."""

    command: str
    targets: tuple[str, ...]
    recording: str
    unit: str
    time: FloatArray
    values: FloatArray
    total: FloatArray
    unexplained: float
    shape: SignalShape

    @property
    def wire(self) -> str:
        """The place at which it acts: the first input that the command feeds."""
        return self.targets[0] if self.targets else self.command

    @property
    def words(self) -> str:
        """What it is, when and how large."""
        size = shown_with_unit(float(np.sqrt(np.mean(self.values**2))), self.unit, 3)
        when = f", between {self.shape.windows[0][0]:.4g} and {self.shape.windows[-1][1]:.4g} s" if self.shape.windows else ""
        return f"{self.shape.words or 'a signal of no simple shape'}{when} ({size} rms in {self.recording})"

    def __str__(self) -> str:
        """The signal in a sentence, without its end."""
        return f"A signal that nobody recorded is added to {self.command} on its way to {self.wire}: {self.words}"
