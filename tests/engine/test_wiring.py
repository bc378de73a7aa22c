"""What wiring refuses, by name, and the order it finds."""

from __future__ import annotations

from dataclasses import replace

import pytest

from lathesim.component import Component, DiscreteState, Input, Output, State
from lathesim.engine.assembly import Assembly, Part, Place, Wire
from lathesim.engine.run import run
from lathesim.engine.wiring import wire
from lathesim.errors import ComponentError, WiringError
from tests.engine.small_machine import PARTS, WIRES, Axis, loop


class Gain(Component):
    """y = 2 x."""

    taken = Input("m", doc="in")
    given = Output("m", doc="out")

    @staticmethod
    def output(taken: float) -> float:
        return 2.0 * taken


class Hold(Component):
    """y(k) = x(k)."""

    taken = Input("m", doc="in")
    held = DiscreteState("m", doc="held")
    given = Output("m", doc="out")

    @staticmethod
    def update(taken: float) -> float:
        return taken

    @staticmethod
    def output(held: float) -> float:
        return held


class DirectAxis(Component):
    """A position that waits for nothing and a current that answers at once to the voltage."""

    voltage = Input("V", doc="in")
    travel = State("m", doc="position")
    position = Output("m", doc="position")
    current = Output("A", doc="current")

    @staticmethod
    def derivative(voltage: float) -> float:
        return voltage

    @staticmethod
    def output(travel: float) -> float:
        return travel

    @staticmethod
    def output_current(voltage: float) -> float:
        return 3.0 * voltage


class GearedAxis(Component):
    """Written with outputs in the place of what they stand for: f = 3 u - 0.5 v,  p = f v,  dv/dt = f,  held(k) = f."""

    push = Input("m", doc="in")
    velocity = State("m/s", doc="velocity")
    held = DiscreteState("N", doc="force of the last sample")
    power = Output("W", doc="its power")
    force = Output("N", doc="force")
    speed = Output("m/s", doc="speed")
    last = Output("N", doc="force of the last sample")

    @staticmethod
    def derivative(force: float) -> float:
        return force

    @staticmethod
    def update(force: float) -> float:
        return force

    @staticmethod
    def output_power(force: float, speed: float) -> float:
        return force * speed

    @staticmethod
    def output_force(push: float, speed: float) -> float:
        return 3.0 * push - 0.5 * speed

    @staticmethod
    def output_speed(velocity: float) -> float:
        return velocity

    @staticmethod
    def output_last(held: float) -> float:
        return held


class WrittenOutAxis(GearedAxis):
    """The same, with what each output stands for written out."""

    @staticmethod
    def derivative(push: float, velocity: float) -> float:  # type: ignore[override]  # a law's arguments are its own
        return 3.0 * push - 0.5 * velocity

    @staticmethod
    def update(push: float, velocity: float) -> float:  # type: ignore[override]
        return 3.0 * push - 0.5 * velocity

    @staticmethod
    def output_power(push: float, velocity: float) -> float:  # type: ignore[override]
        return (3.0 * push - 0.5 * velocity) * velocity

    @staticmethod
    def output_force(push: float, velocity: float) -> float:  # type: ignore[override]
        return 3.0 * push - 0.5 * velocity


def refusal(assembly: Assembly) -> str:
    with pytest.raises(WiringError) as caught:
        wire(assembly)
    return str(caught.value)


@pytest.mark.parametrize(("text", "place"), [("x_axis.position", Place("x_axis", "position")), ("x_axis", Place("x_axis"))])
def test_a_place_is_read_from_its_text_and_written_as_it(text: str, place: Place) -> None:
    assert (Place.of(text), str(place), f"{place}") == (place, text, text)


def test_sampled_parts_come_in_the_order_of_the_signal() -> None:
    plan = wire(loop())
    updates = [part for part, law in plan.laws.instant if law == "update"]
    assert updates == ["source", "controller"]
    assert plan.laws.instant.index(("axis", "output")) < plan.laws.instant.index(("controller", "update"))


def test_an_output_with_a_law_of_its_own_does_not_hold_up_the_others() -> None:
    parts = (*PARTS[:2], Part("axis", DirectAxis))
    plan = wire(Assembly(parts, WIRES, 0.005, 0.0005))
    at = plan.laws.instant.index
    assert at(("axis", "output")) < at(("controller", "update")) < at(("axis", "output_current"))


def test_an_unconnected_input_is_refused() -> None:
    assert refusal(replace(loop(), wires=WIRES[:2])) == "nothing feeds axis.voltage (command voltage). Add a wire, or a constant in V."


def test_units_that_differ_are_refused() -> None:
    wrong = (*WIRES[:2], Wire("axis.voltage", "axis.position"))
    assert refusal(replace(loop(), wires=wrong)) == "wire axis.voltage <- axis.position: units differ, V against m."


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        (Wire("axis.volage", "controller.voltage"), "axis has no input 'volage'. Did you mean 'voltage'?"),
        (Wire("axs.voltage", "controller.voltage"), "there is no part 'axs'. Did you mean 'axis'?"),
        (Wire("axis.voltage", "controller.voltag"), "controller has no output 'voltag'. Did you mean 'voltage'?"),
    ],
)
def test_a_misspelt_name_is_answered_with_the_nearest(changed: Wire, sentence: str) -> None:
    assert refusal(replace(loop(), wires=(*WIRES[:2], changed))).endswith(sentence)


def test_two_wires_to_one_input_are_refused() -> None:
    assert refusal(replace(loop(), wires=(*WIRES, WIRES[0]))) == "two wires feed controller.reference. Take one of them away."


def test_a_loop_without_a_state_is_refused() -> None:
    parts = (Part("first", Gain), Part("second", Gain))
    wires = (Wire("first.taken", "second.given"), Wire("second.taken", "first.given"))
    sentence = refusal(Assembly(parts, wires, 0.01, 0.01))
    assert sentence.startswith("Outputs form a loop with no state in it: ")
    assert sentence.endswith("Give one of them a state or a sample period.")


def test_a_loop_of_sampled_parts_is_refused_with_its_own_remedy() -> None:
    parts = (Part("first", Hold), Part("second", Hold))
    wires = (Wire("first.taken", "second.given"), Wire("second.taken", "first.given"))
    assert "Input(..., previous=True)" in refusal(Assembly(parts, wires, 0.01, 0.01))


def test_a_step_that_does_not_divide_the_sample_period_is_refused() -> None:
    assert refusal(loop(step=0.0003)).startswith("the sample period of 0.005 s is 16.6667 steps of 0.0003 s.")


def test_a_value_out_of_bounds_is_refused() -> None:
    parts = (*PARTS[:2], Part("axis", Axis, {"lag": -1.0}))
    assert refusal(Assembly(parts, WIRES, 0.005, 0.0005)) == "axis.lag is -1 s, outside 0 to inf. Choose a value inside."


def test_a_parameter_may_be_fed_by_a_wire() -> None:
    plan = wire(Assembly(PARTS, (*WIRES, Wire("controller.gain", constant=7.0)), 0.005, 0.0005))
    assert plan.values["controller.gain"] == 7.0


def test_laws_that_take_outputs_of_their_part_give_what_these_stand_for() -> None:
    def recorded(axis: type[Component], engine: str) -> list[bytes]:
        plan = wire(
            Assembly((PARTS[0], Part("axis", axis, start={"velocity": 2.0})), (Wire("axis.push", "source.reference"),), 0.01, 0.0025)
        )
        record = run(plan, duration=0.2, seed=1, engine=engine)
        return [record[name].tobytes() for name in record.channels]

    assert recorded(GearedAxis, "plain") == recorded(GearedAxis, "compiled") == recorded(WrittenOutAxis, "plain")
    assert GearedAxis.taken_for("power") == ("push", "velocity")
    assert GearedAxis.value_of("power", {"push": 1.0, "velocity": 2.0}) == 4.0


def test_laws_of_a_part_that_wait_for_one_another_are_refused() -> None:
    sentence = r"the laws output_force -> output_power -> output_force wait for one another\. Compute one of them from states, inputs and"
    with pytest.raises(ComponentError, match=sentence):

        class Circle(GearedAxis):
            """Two outputs, each of which takes the other."""

            @staticmethod
            def output_force(power: float) -> float:  # type: ignore[override]
                return power
