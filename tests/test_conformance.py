"""``check_component`` passes what keeps the contract, and names what does not."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Callable

import pytest

from lathesim.component import Component, DiscreteState, Input, Output, Parameter, State
from lathesim.components.cutting_forces import LinearForce
from lathesim.components.stock_parts import STOCK, stock_components
from lathesim.conformance import check_component
from lathesim.guest_check import guest_fault


def test_every_stock_part_keeps_the_contract() -> None:
    assert {name: faults for name, part in stock_components().items() if (faults := check_component(part))} == {}


@pytest.mark.slow
@pytest.mark.parametrize("name", STOCK)
def test_every_stock_part_gives_the_same_bits_compiled(name: str) -> None:
    assert check_component(stock_components()[name], compiled=True) == []


def test_a_part_compiles_to_the_same_bits() -> None:
    assert check_component(stock_components()["DAConverter"], compiled=True) == []


def only_fault(component: type[Component], compiled: bool = False) -> str:
    faults = check_component(component, compiled=compiled)
    assert len(faults) == 1
    place, _, sentence = str(faults[0]).partition(": ")
    assert re.fullmatch(r"test_conformance\.py:\d+", place)
    return sentence


def test_missing_docstring_is_named() -> None:
    class Silent(Component):
        force = Output("N", doc="force")

        @staticmethod
        def output(time: float) -> float:
            return time

    assert only_fault(Silent) == "Silent has no docstring. Say what it gives, its equation and its source."


def test_unknown_unit_is_named_with_its_line() -> None:
    class Odd(Component):
        """A force in a unit nobody knows."""

        force = Output("newtonne", doc="force")

        @staticmethod
        def output(time: float) -> float:
            return time

    assert only_fault(Odd).startswith("Odd.force has the unit 'newtonne', which is none.")


def test_units_are_si() -> None:
    class Inches(Component):
        """A length in inches."""

        length = Output("mm", doc="length")

        @staticmethod
        def output(time: float) -> float:
            return time

    assert only_fault(Inches) == "Inches.length is declared in 'mm'. Laws work in SI units."


def test_wrong_number_of_values_is_named() -> None:
    class Short(Component):
        """Two outputs, one value."""

        first = Output("N", doc="first")
        second = Output("N", doc="second")

        @staticmethod
        def output(time: float) -> float:
            return time

    sentence = only_fault(Short)
    assert sentence == "Short.output gives 1 values, but 2 are declared: first, second. Return one value for each, in that order."


def test_a_corner_that_is_no_number_is_named() -> None:
    class Steep(Component):
        """A spring without a limit."""

        push = Input("N", doc="push")
        stiffness = Parameter("N/m", 1.0, low=0.0, doc="stiffness")
        bend = Output("m", doc="bend")

        @staticmethod
        def output(push: float, stiffness: float) -> float:
            return push / stiffness

    sentence = only_fault(Steep)
    assert sentence.startswith("Steep raises ZeroDivisionError")
    assert "stiffness = 0" in sentence
    assert sentence.endswith("guard the division, root or logarithm.")


def test_nan_at_a_corner_is_named() -> None:
    class Endless(Component):
        """A part that gives what is no number."""

        level = Parameter("N", 1.0, low=0.0, high=5.0, doc="level")
        force = Output("N", doc="force")

        @staticmethod
        def output(level: float) -> float:
            return math.inf * (level - 5.0) if level == 5.0 else level

    assert only_fault(Endless).startswith("Endless.output gives nan for force with level = 5; it was given level = 5.")


def test_whole_numbers_are_refused() -> None:
    class Whole(Component):
        """A count as an int."""

        count = Output("1", doc="count")

        @staticmethod
        def output(time: float) -> float:
            return 0

    assert only_fault(Whole) == "Whole.output gives int for count. Return floats, 0.0 instead of 0."


_calls = [0.0]


def test_a_law_with_a_memory_of_its_own_is_named() -> None:
    class Sly(Component):
        """Counts its calls in secret."""

        count = Output("1", doc="count")

        @staticmethod
        def output(time: float) -> float:
            _calls[0] += 1.0
            return _calls[0]

    faults = [str(fault) for fault in check_component(Sly)]
    assert "the law uses '_calls'" in faults[0]
    assert "Sly gives two answers to the same values." in faults[1]


def test_what_cannot_be_compiled_is_named() -> None:
    class Mixed(Component):
        """Gives a text in one branch."""

        held = DiscreteState("1", doc="held")
        speed = State("m/s", doc="speed")
        count = Output("1", doc="count")

        @staticmethod
        def derivative(speed: float) -> float:
            return -speed

        @staticmethod
        def update(held: float) -> float:
            seen = {1.0: held}
            return seen[1.0]

        @staticmethod
        def output(held: float) -> float:
            return float(f"{held:.3f}")

    sentence = only_fault(Mixed, compiled=True)
    assert sentence.startswith("Mixed cannot be compiled:")
    assert sentence.endswith("runs with this part stay plain.")


def test_something_else_than_a_part_is_refused() -> None:
    assert str(check_component(int)[0]) == "<class 'int'> is no Component. Derive the class from lathesim.component.Component."  # type: ignore[arg-type]


def waits() -> None:
    time.sleep(0.4)


def computes() -> None:
    while True:
        pass


@pytest.mark.parametrize(
    ("does", "computing", "asleep", "endless"),
    [(waits, 0.1, 5.0, False), (waits, 5.0, 0.1, True), (computes, 0.1, 5.0, True)],
    ids=["a busy machine", "a law that sleeps", "a law that runs on"],
)
def test_what_is_slow_is_told_from_what_never_ends(
    does: Callable[[], None], computing: float, asleep: float, endless: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    def check(component: type[Component]) -> list[str]:
        does()
        return []

    monkeypatch.setattr("lathesim.guest_check.check_component", check)
    monkeypatch.setattr("lathesim.guest_check.PATIENCE", computing)
    monkeypatch.setattr("lathesim.guest_check._ASLEEP", asleep)
    assert ("LinearForce: a law runs on without end" in guest_fault(LinearForce)) == endless
