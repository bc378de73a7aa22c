"""What the tests of what is left are asked about, on the validation recording."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from lathesim.diagnosis.location.command_coherence import CommandCoherence
from lathesim.diagnosis.location.missing_share import FORCES
from lathesim.diagnosis.location.narrow_band import NarrowBand
from lathesim.diagnosis.recording_checks.controller_law import AnotherLaw
from lathesim.diagnosis.records.diagnosis import BaselineValue, ChannelFit, Evidence, MissingSignal, VariableBar
from lathesim.engine.assembly import FloatArray


@dataclass(frozen=True)
class ValueOff:
    """A value of the lesson that is no answer by itself: how far it had to move [declared standard deviations], with its error."""

    name: str
    value: BaselineValue
    deviations: float
    error: float


@dataclass(frozen=True)
class SensorsApart:
    """Two redundant sensors, the later one first, and how far they differ: in words and in resolutions of the first."""

    channels: tuple[str, str]
    size: str
    resolutions: float


@dataclass(frozen=True)
class Unsized:
    """An effect of the model, and how far the surest of its sizes is from nothing [half intervals]."""

    name: str
    at: str
    half_intervals: float


@dataclass(frozen=True)
class Judged:
    """A model and what it leaves: what is missing behind each of the ``channels``, and how far the closed-loop simulation is off (``fit``).

    ``removed`` is the share of the error that effects remove on the validation recording, ``removed_here`` on the estimation recording.
    ``by_chance`` are channels that converters move as far. ``waves`` says that each effect is a wave that was much of what was missing,
    ``drawn`` in words which waves may draw anything. ``probabilities`` are those of narrow bands and coherences under the fitted model
    (kind, channel), where it was simulated, of ``replicates``.
    """

    channels: tuple[str, ...] = ()
    evidence: Evidence = field(default_factory=Evidence)
    fit: Mapping[str, ChannelFit] = field(default_factory=dict)
    effects: bool = False
    value_is_answer: bool = False
    """Whether a value that the lesson holds impossible is the answer, in the place of effects."""
    feeds_back: bool = False
    waves: bool = False
    removed: float = 0.0
    removed_here: float = 0.0
    by_chance: frozenset[str] = frozenset()
    values: tuple[ValueOff, ...] = ()
    bands: tuple[NarrowBand, ...] = ()
    coherent: tuple[CommandCoherence, ...] = ()
    probabilities: Mapping[tuple[str, str], float] = field(default_factory=dict)
    replicates: int = 0
    laws: tuple[AnotherLaw, ...] = ()
    sensors: tuple[SensorsApart, ...] = ()
    sizes: tuple[Unsized, ...] = ()
    drawn: str = ""

    @property
    def removed_error(self) -> float:
        """Standard error of the share that is removed, from the two recordings: their difference over the root of two."""
        return abs(self.removed - self.removed_here) / math.sqrt(2.0)

    def missing(self) -> Iterator[tuple[str, MissingSignal, VariableBar | None]]:
        """Return each channel with what is missing behind it and the variable that explains most of that."""
        for channel, missing in zip(self.channels, self.evidence.missing, strict=True):
            of_channel = (bar for bar in self.evidence.bars if bar.channel == channel)
            yield channel, missing, max(of_channel, key=lambda bar: bar.after, default=None)

    def off(self) -> Iterator[tuple[str, MissingSignal, VariableBar | None]]:
        """Return the same of the channels that are off by more than converters make by chance."""
        return (item for item in self.missing() if item[0] not in self.by_chance)


def relative_error(values: FloatArray, blocks: int = 10) -> float:
    """Return the standard error of the root mean square of values (samples,) as a share of it, from the spread of the mean square over
    ``blocks`` of the recording: s / (2 m sqrt(blocks)). Zero for what is too short to tell.

    Source: P. D. Welch, IEEE Trans. Audio Electroacoust. 15 (1967), 70-73 (the spread over segments).
    """
    finite = np.nan_to_num(values)
    if len(finite) < 2 * blocks or not np.any(finite):
        return 0.0
    power = np.array([float(np.mean(np.square(block))) for block in np.array_split(finite, blocks)])
    return float(np.std(power, ddof=1) / (2.0 * np.mean(power) * math.sqrt(blocks)))


def of_forces(missing: MissingSignal) -> bool:
    """Return whether what is missing is a force."""
    return missing.unit in FORCES


def counted(missing: MissingSignal) -> float:
    """Return the share that is missing, less what dry friction may hold at rest."""
    return missing.share_after if np.isnan(missing.counted) else missing.counted


def ratio(value: float, other: float) -> float:
    """Return a value over another; infinite where there is nothing to hold it against."""
    return value / other if other > 0.0 and not math.isnan(value) else math.inf


def structured_share(explained: float, share: float) -> float:
    """Return the size of what is missing and depends on the motion, as a ``share`` of what acts, where a variable has ``explained`` a part
    of it."""
    return share * math.sqrt(explained) if explained > 0.0 and math.isfinite(share) else 0.0
