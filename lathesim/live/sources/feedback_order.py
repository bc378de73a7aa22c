"""Feedback put in order again: what comes over UDP may be lost, doubled, late or in another order, and each is counted."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from lathesim.live.servo.wire_format import Numbers
from lathesim.record import FloatArray

WAIT = 512
"""Samples that may come before an earlier one that is still missing; then that one is lost."""


@dataclass
class FeedbackOrder:
    """Takes numbered samples as they come and returns them in order; memory is at most ``WAIT`` samples and one datagram.

    ``lost`` counts samples that did not come in time, ``doubled`` those that came again, ``late`` those that came after they were given up,
    ``reordered`` those that came after a later one and were still in time.
    """

    expected: int = 0
    received: int = 0
    lost: int = 0
    doubled: int = 0
    late: int = 0
    reordered: int = 0
    _waiting: dict[int, FloatArray] = field(default_factory=dict)
    _given_up: list[tuple[int, int]] = field(default_factory=list)
    _newest: int = -1

    def take(self, numbers: Numbers) -> list[Numbers]:
        """Return the runs of samples, each whole and in order, that are known now."""
        for at, row in enumerate(numbers.values):
            number = numbers.first + at
            if number < self.expected:
                if any(begin <= number < end for begin, end in self._given_up):
                    self.late += 1
                else:
                    self.doubled += 1
            elif number in self._waiting:
                self.doubled += 1
            else:
                self.reordered += number < self._newest
                self._newest = max(self._newest, number)
                self._waiting[number] = row
        return self._known(False)

    def rest(self) -> list[Numbers]:
        """Return what still waits at the end; what is missing between is lost."""
        return self._known(True)

    def _known(self, all_of_it: bool) -> list[Numbers]:
        found = []
        while self._waiting:
            run = []
            first = self.expected
            while self.expected in self._waiting:
                run.append(self._waiting.pop(self.expected))
                self.expected += 1
            if run:
                self.received += len(run)
                found.append(Numbers(first, np.array(run)))
            if not self._waiting or (self._newest - self.expected < WAIT and not all_of_it):
                break
            following = min(self._waiting)
            self.lost += following - self.expected
            self._given_up = [*self._given_up[-15:], (self.expected, following)]
            self.expected = following
        return found

    def as_json(self) -> dict[str, int]:
        """Return the counts as plain data."""
        return {
            "received": self.received,
            "lost": self.lost,
            "doubled": self.doubled,
            "late": self.late,
            "reordered": self.reordered,
        }
