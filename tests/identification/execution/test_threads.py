"""Work done two pieces at a time: results in order, and nothing begun after an interruption."""

import time

import pytest

from lathesim.identification.execution.threads import together


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
