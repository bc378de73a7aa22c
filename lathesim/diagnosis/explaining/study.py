"""What every step of a diagnosis takes first: the recordings in their machine, the limits, and who is told of progress."""

from __future__ import annotations

from dataclasses import dataclass

from lathesim.diagnosis.method import Method
from lathesim.identification.execution import Progress
from lathesim.identification.replay.experiment import Experiment


@dataclass(frozen=True)
class Study:
    """A machine with its recordings: ``estimation`` is fitted, ``validation`` judges, ``earlier`` is from before a change, if any."""

    estimation: Experiment
    validation: Experiment
    method: Method
    progress: Progress
    earlier: Experiment | None = None

    @property
    def judges_itself(self) -> bool:
        """Whether one stroke alone was recorded, which judges what is fitted to it."""
        return self.validation is self.estimation or (self.validation.record is self.estimation.record and self.validation.weights is None)

    @property
    def runs(self) -> int:
        """How many simulations were held against the recordings until now."""
        return self.estimation.sensed.runs.total + self.validation.sensed.runs.total
