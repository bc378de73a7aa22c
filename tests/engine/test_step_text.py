"""The text of an RK4 step made shorter: what nobody reads, and what is held through the sample."""

from __future__ import annotations

from lathesim.component import Component, Input, Output, Parameter, State
from lathesim.engine.assembly import Assembly, Part, Wire
from lathesim.engine.fusing.fuse import fuse
from lathesim.engine.fusing.step_text import shortened
from lathesim.engine.running.run import run
from lathesim.engine.wiring import wire
from tests.engine.small_machine import Axis, loop


class Filter(Component):
    """lag ds/dt = y - s."""

    state = State("m", doc="smooth value")
    given = Input("m", doc="value")
    smooth = Output("m", doc="smooth value")
    lag = Parameter("s", 0.1, low=0.0, doc="time constant")

    @staticmethod
    def derivative(state: float, given: float, lag: float) -> float:
        return (given - state) / lag

    @staticmethod
    def output(state: float) -> float:
        return state


def test_what_nobody_reads_goes_with_all_that_leads_to_it() -> None:
    lines = ["a = x * 2.0", "b = a + 1.0", "if x > 0.0:", "    b = a", "c, d = law(x)", "e, f = law(x)", "total = c"]
    assert shortened(lines, ["total"]) == ([], ["c, d = law(x)", "total = c"])


def test_what_is_held_is_computed_once() -> None:
    held, lines = shortened(["rate = (gain * volt - gain * volt * speed) / lag", "if volt > 0.0:", "    speed = rate"], [])
    assert held == ["held_1 = gain * volt", "held_2 = volt > 0.0"]
    assert lines == ["rate = (held_1 - held_1 * speed) / lag", "if held_2:", "    speed = rate"]


def test_what_might_raise_stays_where_its_branch_is() -> None:
    lines = ["a = x / gain", "b = 1.0 / gain", "c = math.log(gain)", "d = math.sin(volt)", "e = math.sin(angle)"]
    held, rest = shortened(lines, list("abcde"), parameters=["gain", "angle"])
    assert held == ["held_1 = math.sin(angle)"]
    assert rest == [*lines[:4], "e = held_1"]


def test_what_changes_from_step_to_step_is_not_held() -> None:
    assert shortened(["y = moment + reach * 2.0 + gain * position"], ["y"], ["moment", "reach", "position"])[0] == []


def test_the_step_of_a_machine_holds_what_its_converter_holds_and_calls_nothing() -> None:
    source = fuse(wire(loop())).source
    before, _, step = source.partition("for substep in range(steps):")
    assert "held_1 = axis__gain * controller__voltage" in before
    assert "axis__speed__rate" not in step
    assert "axis__velocity__rate = (held_1 - axis__velocity__stage) / axis__lag" in step
    assert "axis__travel__sum = axis__travel__sum + weight * axis__velocity__stage" in step
    assert "axis__travel__stage" not in step


def test_what_a_constant_feeds_is_the_same_in_a_stage_as_before_it() -> None:
    """An output that moves between samples, and an input of the same part that a wire gives a constant."""
    wires = (Wire("axis.voltage", constant=2.0), Wire("filter.given", "axis.position"))
    plan = wire(Assembly((Part("axis", Axis), Part("filter", Filter)), wires, 0.005, 0.0005))
    step = fuse(plan).source.partition("for substep in range(steps):")[2]
    assert "axis__voltage__stage" not in step
    record = run(plan, duration=1.0, engine="plain")
    assert 0.0 < record["filter.smooth"][-1] < record["axis.position"][-1]
