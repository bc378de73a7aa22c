"""Work under a limit of time, and two pieces at a time."""

import itertools
import math
import time

import pytest

from lathesim.identification.execution import Deadline, together, until


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


def test_results_come_in_the_order_of_the_items() -> None:
    def slow(number: int) -> int:
        time.sleep(0.01 * (4 - number))
        return number * number

    assert list(together(slow, range(4))) == [0, 1, 4, 9]


def test_an_interruption_drops_what_has_not_begun() -> None:
    begun = []

    def stopped(number: int) -> int:
        begun.append(number)
        time.sleep(0.02)
        if number == 0:
            raise KeyboardInterrupt
        return number

    with pytest.raises(KeyboardInterrupt):
        list(together(stopped, range(40)))
    assert len(begun) < 10
