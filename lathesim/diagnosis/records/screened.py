"""What screening expects of a candidate before it is fitted."""

from __future__ import annotations

from dataclasses import dataclass

from lathesim.engine.assembly import FloatArray
from lathesim.identification.records.candidate import Candidate


@dataclass(frozen=True)
class Screened:
    """A candidate with the log-likelihood its responses screening score [nats], and the starting values that screening score most, best
    first.

    ``shares`` are the shares of the whitened residual that they screening score to explain, for each channel in the band of the motion and
    on all frequencies.
    """

    candidate: Candidate
    gain: float
    starts: tuple[FloatArray, ...]
    shares: FloatArray

    @property
    def share(self) -> float:
        """The largest of the shares."""
        return float(self.shares.max(initial=0.0))
