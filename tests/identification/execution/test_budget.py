"""Time that a search may spend: by a clock of its own here, which goes on by a second each time it is read."""

import itertools
import math

import pytest

from lathesim.identification.execution.budget import Deadline, until


def test_a_search_is_interrupted_once_at_the_first_step_after_its_time() -> None:
    seconds, told = itertools.count(), list[str]()
    tell = until(Deadline(2.0, lambda: float(next(seconds))), told.append)
    tell("at 0 s")
    tell("at 1 s")
    with pytest.raises(KeyboardInterrupt):
        tell("at 2 s")
    tell("later")
    assert told == ["at 0 s", "at 1 s", "at 2 s", "later"]


def test_a_part_of_the_time_is_counted_from_now() -> None:
    deadline = Deadline.after(30.0, lambda: 4.0)
    assert deadline.moment == 34.0
    assert not deadline.is_over
    assert deadline.share(0.5).moment == 19.0
    over = Deadline(3.0, lambda: 4.0)
    assert over.is_over
    assert over.share(0.5) == over


def test_without_a_limit_there_is_time_for_everything() -> None:
    assert not Deadline().is_over
    assert Deadline().share(0.5).moment == math.inf
