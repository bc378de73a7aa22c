"""Effects on wires: where they sit, in which order they act, what they sense, and that a neutral one changes no bit."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lathesim.effects.force_law import EdgeForce
from lathesim.effects.force_over_turn import HardSpot
from lathesim.effects.spindle_error import Unbalance
from lathesim.engine.wiring import wire
from lathesim.errors import WiringError
from lathesim.lessons.assemble import assemble
from lathesim.lessons.insertion import GoesWithMain, Machinery, effect_part_name, insert_effect
from lathesim.lessons.lesson import load_lesson
from tests.lessons.small_machine import Drag, Shift, small_registry, write_lesson
from tests.shipped_machine import shipped_machine

LATHE = "two_axis_lathe_analytical"


def feeds(machinery: Machinery) -> dict[str, str | float]:
    return {item.target: item.source or item.constant for item in machinery.wires}


def machine(folder: Path, body: str = "") -> Machinery:
    return assemble(load_lesson(write_lesson(folder, body)), small_registry())


def test_on_an_input_the_effect_takes_what_fed_it(tmp_path: Path) -> None:
    wires = feeds(machine(tmp_path, "insert: [{effect: Drag, at: table, level: 2 N}]"))
    assert wires["table_drag.incoming"] == 0.0
    assert wires["table.disturbance"] == "table_drag.outgoing"
    assert wires["table_drag.flow"] == "table.velocity"


def test_units_follow_the_host(tmp_path: Path) -> None:
    machinery = machine(tmp_path, "insert: [{effect: Drag, at: table, level: 2 kN, name: grease}]")
    grease = machinery.parts[-1]
    assert grease.name == "grease"
    assert grease.parameters == {"level": 2000.0}
    assert {name: item.unit for name, item in grease.component.declarations.items()} == {
        "incoming": "N",
        "flow": "m/s",
        "outgoing": "N",
        "level": "N",
        "blur": "m/s",
    }


def test_several_on_one_input_act_in_the_order_written(tmp_path: Path) -> None:
    wires = feeds(machine(tmp_path, "insert: [{effect: Shift, at: table.disturbance, name: a}, {effect: Drag, at: table, name: b}]"))
    assert (wires["a.incoming"], wires["b.incoming"], wires["table.disturbance"]) == (0.0, "a.outgoing", "b.outgoing")


def test_several_on_one_output_act_in_the_order_written(tmp_path: Path) -> None:
    machinery = machine(
        tmp_path, "insert: [{effect: Shift, at: ruler, name: a}, {effect: Shift, at: ruler.reading, name: b, offset: 2 mm}]"
    )
    wires = feeds(machinery)
    assert (wires["a.incoming"], wires["b.incoming"], wires["push.measured"]) == ("ruler.reading", "a.outgoing", "b.outgoing")
    assert machinery.seen_as == {"ruler.reading": "b.outgoing"}


def test_an_effect_senses_its_host_before_other_effects(tmp_path: Path) -> None:
    body = "insert: [{effect: Drag, at: table, name: drag}, {effect: Shift, at: table.velocity, name: shift}]"
    wires = feeds(machine(tmp_path, body))
    assert wires["drag.flow"] == "table.velocity"
    assert wires["shift.incoming"] == "table.velocity"


def test_on_a_parameter_the_set_value_is_what_comes_in(tmp_path: Path) -> None:
    machinery = machine(tmp_path, "insert: [{effect: Shift, at: table.mass, offset: 5 kg}]")
    wires = feeds(machinery)
    assert wires["table_mass_shift.incoming"] == "table.mass"
    assert wires["table.mass"] == "table_mass_shift.outgoing"
    plan = wire(machinery)
    assert plan.values["table.mass"] == 20.0


def test_an_input_of_an_effect_can_be_wired_by_hand(tmp_path: Path) -> None:
    wires = feeds(machine(tmp_path, "insert: [{effect: Drag, at: table.force, flow: table.velocity}]"))
    assert wires["table_force_drag.incoming"] == "push.force"
    assert wires["table_force_drag.flow"] == "table.velocity"


def test_set_reaches_the_parameters_of_an_effect(tmp_path: Path) -> None:
    machinery = machine(tmp_path, "insert: [{effect: Drag, at: table, level: 2 N}]\nset: {table_drag.level: 4 N}")
    assert machinery.parts[-1].parameters == {"level": 4.0}


def test_variants_add_their_effects_to_those_of_the_lesson(tmp_path: Path) -> None:
    body = "insert: [{effect: Drag, at: table}]\nvariants: {I: {insert: [{effect: Shift, at: ruler}]}}"
    lesson = load_lesson(write_lesson(tmp_path, body))
    names = [part.name for part in assemble(lesson, small_registry(), "I").parts]
    assert names == ["push", "table", "ruler", "table_drag", "ruler_shift"]


def test_the_outputs_of_an_effect_are_recorded_too(tmp_path: Path) -> None:
    machinery = machine(tmp_path, "record: [table.position]\ninsert: [{effect: Drag, at: table}]")
    assert wire(machinery).channels == ("table.position", "table_drag.outgoing")


def test_an_effect_that_repeats_with_the_turn_senses_the_only_spindle() -> None:
    """The cut of a whole lathe knows no angle of its own: a hard spot could not even be looked for there."""
    wires = feeds(insert_effect(shipped_machine(LATHE), HardSpot, "cutting_force", name="spot"))
    assert wires["spot.angle"] == "spindle.angle"


def test_what_an_effect_does_to_the_main_force_of_a_cut_the_other_forces_do_with_it() -> None:
    """A slot leaves no thrust either. A process whose shares are of what arrives at it needs no help."""
    lathe = insert_effect(
        insert_effect(shipped_machine(LATHE), HardSpot, "cutting_force", name="spot"), EdgeForce, "cutting_force", name="edge"
    )
    wires = feeds(lathe)
    assert [wires[f"spot_radial_force.{item}"] for item in ("incoming", "before", "after")] == [
        "cutting_force.radial_force", "cutting_force.cutting_force", "spot.outgoing",
    ]  # fmt: skip
    assert [wires[f"edge_radial_force.{item}"] for item in ("incoming", "before", "after")] == [
        "spot_radial_force.outgoing", "spot.outgoing", "edge.outgoing",
    ]  # fmt: skip
    assert (wires["edge.thrust_incoming"], wires["load.radial_force"]) == ("edge_radial_force.outgoing", "edge.thrust_outgoing")
    process = insert_effect(shipped_machine("cutting_process"), HardSpot, "cutting", name="spot")
    assert [part.name for part in process.parts if part.name.startswith("spot")] == ["spot"]
    assert "unbalance_radial_force" not in {
        part.name for part in insert_effect(shipped_machine(LATHE), Unbalance, "cutting_force", name="unbalance").parts
    }


@pytest.mark.parametrize(("before", "after", "force"), [(100.0, 100.0, 40.0), (100.0, 0.0, 0.0), (100.0, 120.0, 48.0), (0.0, 5.0, 40.0)])
def test_a_force_goes_with_the_main_one(before: float, after: float, force: float) -> None:
    assert GoesWithMain.output(40.0, before, after) == force


def test_of_two_parts_that_turn_neither_is_the_spindle() -> None:
    machine = shipped_machine(LATHE)
    spindle = next(part for part in machine.parts if part.name == "spindle")
    fed = [replace(item, target=item.target.replace("spindle.", "second.")) for item in machine.wires if item.target.startswith("spindle.")]
    both = replace(machine, parts=(*machine.parts, replace(spindle, name="second")), wires=(*machine.wires, *fed))
    with pytest.raises(WiringError, match="no port 'angle', which HardSpot needs"):
        insert_effect(both, HardSpot, "cutting_force")


def test_only_effects_are_inserted(tmp_path: Path) -> None:
    ruler = small_registry().component("Ruler")
    with pytest.raises(WiringError, match=r"^Ruler is a component and no effect\. Put it among the parts of a machine\.$"):
        insert_effect(machine(tmp_path), ruler, "table")


@pytest.mark.parametrize(("effect", "place"), [(Drag, "table"), (Shift, "ruler"), (Shift, "table.mass"), (Shift, "push.force")])
def test_a_neutral_effect_changes_no_bit(effect: type, place: str, tmp_path: Path) -> None:
    from lathesim.engine.run import run

    plain = machine(tmp_path)
    with_effect = insert_effect(plain, effect, place, parameters=effect.neutral)
    before, after = (run(wire(machinery), duration=0.5, engine="plain") for machinery in (plain, with_effect))
    for name in ("table.position", "table.velocity", "push.force"):
        assert np.array_equal(before[name], after[name])


def test_names_of_inserted_parts() -> None:
    assert effect_part_name("x_axis", "CoulombFriction") == "x_axis_coulomb_friction"
    assert effect_part_name("x_dac.voltage", "DACOffset") == "x_dac_voltage_dac_offset"


def test_an_effect_that_is_inserted_at_another_one_comes_before_it(tmp_path: Path) -> None:
    own = "{effect: Drag, at: table, name: own, level: 2 N}"
    wires = feeds(machine(tmp_path, f"insert: [{own}, {{effect: Drag, at: own, name: first, level: 1 N}}]"))
    assert (wires["first.incoming"], wires["own.incoming"], wires["table.disturbance"]) == (0.0, "first.outgoing", "own.outgoing")


def test_an_effect_may_sit_on_a_port_of_another_one(tmp_path: Path) -> None:
    own = "{effect: Drag, at: table, name: own, level: 2 N}"
    wires = feeds(machine(tmp_path, f"insert: [{own}, {{effect: Drag, at: own.incoming, name: first, flow: table.velocity}}]"))
    assert wires["own.incoming"] == "first.outgoing"
