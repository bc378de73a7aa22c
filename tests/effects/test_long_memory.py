"""Parts that remember samples, against an exact delay that is longer than their declared rings."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from lathesim.component import Component, Input, Memory, Output
from lathesim.engine.assembly import Assembly, Part, Wire
from lathesim.engine.batch import Batch
from lathesim.engine.run import run
from lathesim.engine.wiring import wire
from lathesim.errors import SimulationError
from lathesim.plugins import Registry

PERIOD = 1e-3


@pytest.fixture(scope="module")
def registry() -> Registry:
    return Registry()


SAMPLES: dict[str, tuple[dict[str, float], Callable[[np.ndarray], np.ndarray]]] = {
    "DelayLine": ({"delay": 0.3}, lambda time: time - 0.3),
    "TransportDelay": ({"delay": 1.1}, lambda time: time - 1.1),
    "ChannelTimeShift": ({"shift": 1.1}, lambda time: time - 1.1),
    "ClockSkew": ({"skew": 0.1}, lambda time: time - 0.1 * time),
    "ReplayAttack": ({"lap": 8.5}, lambda time: time - 8.5),
    "DelayAttack": ({"delay": 8.5}, lambda time: time - 8.5),
    "InputShaper": ({"frequency": 0.1, "damping": 0.0, "kind": 1.0, "share": 1.0}, lambda time: time - 2.5),
}
"""Parameters, and the time at which the signal, its own time, was what comes out."""
ELSEWHERE = {"JerkLimitedInterpolator"}
NO_DELAYS = {"MillingCut", "RegenerativeCut", "RegenerativeChatter", "Stock", "SurfaceFinish", "PredictiveController"}
"""Maps over the turn or the part, and a plan ahead: they do not grow with a time."""


class Clock(Component):
    """Gives the time as a signal."""

    value = Output("m", doc="time")

    @staticmethod
    def output(time: float) -> float:
        return time


class Wish(Component):
    """Passes on a delay."""

    given = Input("s", doc="delay", default=0.0)
    value = Output("s", doc="the same")

    @staticmethod
    def output(given: float) -> float:
        return given


def late(registry: Registry, name: str, *more: Part, wires: tuple[Wire, ...] = (), values: dict[str, float] | None = None) -> Assembly:
    """Return a clock that a part with a memory makes late."""
    found = {**registry.components, **registry.effects, **registry.remedies}[name].with_units({"signal": "m"})
    parts = (Part("clock", Clock), Part("late", found, SAMPLES[name][0] if values is None else values), *more)
    return Assembly(parts, (Wire("late.incoming", "clock.value"), *wires), PERIOD, PERIOD, record=("late.outgoing",))


def test_every_part_with_a_memory_is_held_against_its_delay(registry: Registry) -> None:
    known = {**registry.components, **registry.effects, **registry.remedies}
    found = {name for name, part in known.items() if part.declared(Memory)}
    assert found == {*SAMPLES, *ELSEWHERE, *NO_DELAYS}
    for name in (*SAMPLES, *ELSEWHERE):
        assert all(item.holds is not None for item in known[name].declared(Memory).values())


@pytest.mark.parametrize("name", SAMPLES)
def test_a_ring_is_as_long_as_its_delay(name: str, registry: Registry) -> None:
    record = run(wire(late(registry, name)), duration=10.8, engine="plain")
    after = record.time > 10.65
    assert record["late.outgoing"][after] == pytest.approx(SAMPLES[name][1](record.time[after]), abs=1e-9)


def test_each_member_of_a_batch_has_a_ring_of_its_own(registry: Registry) -> None:
    batch = Batch(wire(late(registry, "ChannelTimeShift", values={})), 3001)
    found = batch.run(["late.shift"], np.array([[0.5], [2.5]]), reduce=lambda record: float(record[0, -1]))
    assert found == pytest.approx([2.5, 0.5], abs=1e-9)


@pytest.mark.parametrize(("name", "wired"), [("TransportDelay", "delay"), ("ReplayAttack", "lap")])
def test_a_delay_that_comes_by_a_wire_and_is_too_long_breaks_the_run(name: str, wired: str, registry: Registry) -> None:
    wires = (Wire("wish.given", constant=9.0), Wire(f"late.{wired}", "wish.value"))
    with pytest.raises(SimulationError, match=rf"late\.\w+ stopped being a number .* {wired} = 9 s"):
        run(wire(late(registry, name, Part("wish", Wish), wires=wires, values={})), duration=9.5, engine="plain")


def test_a_delay_that_no_memory_holds_is_refused(registry: Registry) -> None:
    with pytest.raises(SimulationError, match=r"late\.history would have to hold .* delay = 5000, and holds at most") as caught:
        run(wire(late(registry, "DelayLine", values={"delay": 5000.0})), duration=1.0)
    assert "shorter delay" in caught.value.remedy
