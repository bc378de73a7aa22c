"""How long the test of a guest's component may take: so much computing, however busy the machine is, and not for ever by the clock."""

import time
from collections.abc import Callable

import pytest

from lathesim.component import Component
from lathesim.components.cutting_forces import LinearForce
from lathesim.guest_check import guest_fault


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
