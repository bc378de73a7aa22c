"""One channel of a recording with what its checks need: how it moves, how noisy it is, where it stands still."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from lathesim.record import FloatArray, Record
from lathesim.recordings.mapping import RecordingMapping

_SECOND_DIFFERENCE = np.sqrt(6.0)
"""Standard deviation of the second difference of white noise of standard deviation one."""


@dataclass(frozen=True, eq=False)
class RecordedChannel:
    """A channel (samples,) in its SI ``unit``; ``driven`` says whether it is an input of the machine; ``group`` is what it belongs to.

    The group is the part's name up to the first underscore: ``x`` for ``x_controller.reference``, ``x_encoder.position`` and so on.
    """

    name: str
    unit: str
    values: FloatArray
    driven: bool
    resolution: float

    @property
    def part(self) -> str:
        """The part of the machine whose input or output it is."""
        return self.name.partition(".")[0]

    @property
    def group(self) -> str:
        """The axis or unit a channel belongs to."""
        return self.part.partition("_")[0]

    @cached_property
    def steps(self) -> FloatArray:
        """Differences from sample to sample (samples - 1,)."""
        return np.diff(self.values)

    @cached_property
    def span(self) -> float:
        """Largest less smallest value."""
        return float(self.values.max() - self.values.min())

    @cached_property
    def constant(self) -> bool:
        """Whether it never moves; the last bits of a computed constant do not count."""
        return self.span <= 1e-12 * float(np.abs(self.values).max())

    @cached_property
    def roughness(self) -> float:
        """Standard deviation of what is new in every sample (noise and rounding), from second differences, robust."""
        second = np.diff(self.values, 2)
        return max(1.4826 * float(np.median(np.abs(second))), float(np.quantile(np.abs(second), 0.9)) / 1.645) / float(_SECOND_DIFFERENCE)

    @cached_property
    def usual_step(self) -> float:
        """The largest step that is usual: exceeded by one in a thousand."""
        return float(np.quantile(np.abs(self.steps), 0.999))


def channels_of(record: Record, mapping: RecordingMapping) -> list[RecordedChannel]:
    """Return the mapped channels that hold numbers throughout."""
    found = []
    for signal in mapping.signals:
        values = record[signal.target]
        if len(values) > 2 and np.isfinite(values).all():
            channel = RecordedChannel(signal.target, signal.si_unit, values, signal.role == "drive", signal.resolution or 0.0)
            found.append(channel)
    return found


def runs_of(flags: npt.NDArray[np.bool_]) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Return the begins and ends (behind the last one) of the stretches in which a condition holds."""
    edges = np.diff(np.concatenate([[0], flags.astype(np.int8), [0]]))
    return np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
