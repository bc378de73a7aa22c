"""What every step of a diagnosis takes first: the recordings in their machine, the limits, and who is told of progress."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

from lathesim.diagnosis.candidates.plausible_sizes import possible_sizes
from lathesim.diagnosis.method import Method
from lathesim.identification.execution import Deadline, Progress
from lathesim.identification.replay.experiment import Experiment


@dataclass(frozen=True)
class Study:
    """A machine with its recordings: ``estimation`` is fitted, ``validation`` judges, ``earlier`` is from before a change, if any.

    Before ``ends`` the search is over, and the answer holds what is known by then.
    """

    estimation: Experiment
    validation: Experiment
    method: Method
    progress: Progress
    earlier: Experiment | None = None
    ends: Deadline = field(default_factory=Deadline)

    @cached_property
    def possible(self) -> Mapping[str, float]:
        """How large parameters (free name -> size) could be on this machine, whatever is usual on others."""
        return possible_sizes(self.estimation)

    @property
    def least_share(self) -> float:
        """The share of the error that an effect must explain: any where an earlier recording shows the errors of the lesson."""
        return self.method.material if self.earlier is None else 0.0

    @property
    def share_of_rest(self) -> float:
        """The share of what is left that a second effect and a finer form must explain: any beside an earlier recording."""
        return self.method.share_of_rest if self.earlier is None else 0.0

    @property
    def judges_itself(self) -> bool:
        """Whether one stroke alone was recorded, which judges what is fitted to it."""
        return self.validation is self.estimation or (self.validation.record is self.estimation.record and self.validation.weights is None)
