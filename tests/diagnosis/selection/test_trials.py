"""Trials side by side: the order of what is asked, whatever is ready first, and what is remembered is made once."""

import time
from typing import Any

import numpy as np
import pytest

from lathesim.diagnosis.selection.trials import Asked, side_by_side
from lathesim.identification.execution.cache import Remembered
from tests.diagnosis.pushed_table import Hidden, pair


class Told:
    """Stands for a trial of which only the outcome is told."""

    def __init__(self, name: str, gain: float) -> None:
        self.candidate = type("Term", (), {"name": name, "at": "x_axis"})()
        self.gain, self.validation_gain = gain, gain
        self.share_of_all, self.share_of_rest = 0.5, 0.25


class SlowBench:
    """Tries terms that take the longer the earlier they are asked for."""

    def __init__(self) -> None:
        self.said: list[str] = []

    def progress(self, text: str) -> None:
        self.said.append(text)

    def trial(
        self, before: Any, candidate: Any, kept: Any, free: Any, starts: Any, promised: float, *, with_simulated_motion: bool
    ) -> Told:
        name, wait, gain = candidate
        time.sleep(wait)
        if name == "broken":
            raise KeyboardInterrupt
        return Told(name, gain)


def asked(*candidates: tuple[str, float, float]) -> list[Asked]:
    return [Asked(candidate, (), [], []) for candidate in candidates]  # type: ignore[arg-type]


def test_they_are_given_and_told_in_the_order_in_which_they_were_asked_for() -> None:
    laboratory = SlowBench()
    found = side_by_side(laboratory, None, asked(("slow", 0.05, 3.0), ("quick", 0.0, 2.0), ("none", 0.0, -np.inf)))  # type: ignore[arg-type]
    assert [trial.candidate.name for trial in found] == ["slow", "quick", "none"]
    assert [text.split()[0] for text in laboratory.said] == ["slow", "quick"]


def test_an_interruption_goes_on_and_what_waits_is_not_begun() -> None:
    laboratory = SlowBench()
    with pytest.raises(KeyboardInterrupt):
        side_by_side(laboratory, None, asked(("broken", 0.0, 1.0), *[("late", 0.02, 1.0)] * 20))  # type: ignore[arg-type]
    assert laboratory.said == []


def test_what_is_asked_again_is_not_made_again_as_long_as_it_is_remembered() -> None:
    made: list[int] = []
    remembered = Remembered[int](2)
    for number in (1, 2, 1, 3, 3, 1):
        assert remembered.get(number, lambda number=number: made.append(number) or number) == number  # type: ignore[misc]
    assert made == [1, 2, 3, 1]


def test_a_simulator_that_is_asked_twice_for_its_noise_simulates_once() -> None:
    simulator = pair(Hidden())[0].sensed
    values = {"x_axis.mass": 40.0}
    assert simulator.noise_shapes(values) is simulator.noise_shapes(dict(values))
    assert simulator.noise_shapes(values) is not simulator.noise_shapes(values, coloured=True)
