"""A correction that was learned lap by lap, played back."""

from __future__ import annotations

from typing import Any, ClassVar

from lathesim.component import DiscreteState, Input, Output, Table
from lathesim.effects.remedies.remedy import Remedy


class LearnedCorrection(Remedy):
    """Adds what was learned for each sample of a lap:  out_k = in_k + share c_k,  nothing once the lap is over.

    The table ``samples`` holds one number a sample, from the first sample of the run on. It belongs to one program at one feed: another
    lap has another table. Source: D. A. Bristow, M. Tharayil, A. G. Alleyne, A survey of iterative learning control, IEEE Control Systems
    26 (2006).
    """

    answers = ()
    limits = ("converter", "encoder", "bandwidth", "same lap each time")
    cannot = "It helps the lap that it was learned on and no other one."
    follows = {"samples": "the recorded errors of the laps before"}
    source = "Bristow, Tharayil, Alleyne, A survey of iterative learning control, IEEE Control Systems 26 (2006)"
    example_tables: ClassVar[dict[str, list[list[float]]]] = {"samples": [[0.0], [1e-3], [-1e-3]]}

    incoming = Input("{signal}", doc="what the control would send")
    outgoing = Output("{signal}", doc="what it sends instead")
    samples = Table("{signal}", ("correction",), doc="what is added, one number a sample")
    place = DiscreteState("1", -1.0, doc="sample of the lap")

    @staticmethod
    def update(place: float) -> float:
        """Count the samples."""
        return place + 1.0

    @staticmethod
    def output(incoming: float, samples: Any, place: float, share: float) -> float:
        """Add the correction of this sample."""
        row = int(place)
        if share == 0.0 or row < 0 or row >= len(samples):
            return incoming
        return float(incoming + share * samples[row][0])
