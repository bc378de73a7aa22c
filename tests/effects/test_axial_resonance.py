"""Two masses and a spring, against SciPy's integrator: the motor side is the host, and a scale that closes no loop sees the table."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from lathesim.components.axes import ForceAxis
from lathesim.components.sensors import LinearEncoder, Tachometer
from lathesim.components.spindles import TorqueSpindle
from lathesim.effects.effect import Effect
from lathesim.effects.friction import CoulombFriction
from lathesim.effects.offset_and_gain import ForceOffset
from lathesim.effects.structure import AxialResonance, TorsionalWindUp
from lathesim.engine.assembly import Assembly, Part, Wire
from lathesim.engine.run import run
from lathesim.engine.wiring import wire
from lathesim.errors import WiringError
from lathesim.identification.replay.open_loop import sense
from lathesim.lessons.insertion import insert_effect

MASS, VISCOUS, PUSH, LOAD = 80.0, 150.0, 300.0, 40.0
SHARE, FREQUENCY, DAMPING = 0.4, 60.0, 0.05


def two_masses(times: np.ndarray, at_motor: float, load: float = LOAD, held: float = 0.0, damping: float = DAMPING) -> np.ndarray:
    """Return motor and table position under a constant push and the load, with a share of the viscous friction at the motor: (2, times).

    ``held`` is a further force against the motor side.
    """
    table, motor, angular = SHARE * MASS, (1.0 - SHARE) * MASS, 2.0 * math.pi * FREQUENCY

    def rates(_: float, state: np.ndarray) -> list[float]:
        x1, v1, x2, v2 = state
        spring = table * (angular**2 * (x2 - x1) + 2.0 * damping * angular * (v2 - v1))
        pushed, against = PUSH - held - at_motor * VISCOUS * v1, load + (1.0 - at_motor) * VISCOUS * v2
        return [v1, (pushed + spring) / motor, v2, (-spring - against) / table]

    solved = solve_ivp(rates, (0.0, times[-1]), [0.0] * 4, t_eval=times, rtol=1e-10, atol=1e-14)
    return np.asarray(solved.y[[0, 2]])


@pytest.fixture
def machine() -> Assembly:
    parts = (Part("x_axis", ForceAxis, {"mass": MASS, "viscous": VISCOUS}), Part("x_scale", LinearEncoder, {"resolution": 0.0}))
    wires = (Wire("x_axis.force", constant=PUSH), Wire("x_scale.measured", "x_axis.position"))
    bare = Assembly(parts, wires, 1e-3, 1e-4, record=("x_axis.position", "x_scale.position"))
    loaded = insert_effect(bare, ForceOffset, "x_axis", name="load", parameters={"offset": LOAD})
    values = {"table_share": SHARE, "frequency": FREQUENCY, "damping": DAMPING}
    return insert_effect(loaded, AxialResonance, "x_axis", name="resonance", parameters=values)


@pytest.mark.parametrize("at_motor", [0.0, 0.3, 1.0])
def test_motor_and_table_move_as_two_masses_do(machine: Assembly, at_motor: float) -> None:
    found = run(wire(machine), overrides={"resonance.motor_friction": at_motor}, duration=0.2)
    motor, table = two_masses(found.time, at_motor)
    assert found["x_axis.position"] == pytest.approx(motor, abs=1e-8)
    assert found["x_scale.position"] == pytest.approx(table, abs=1e-8)


@pytest.mark.parametrize("effect, parameter", [(ForceOffset, "offset"), (CoulombFriction, "level")])
@pytest.mark.parametrize(("at", "load", "held"), [("x_axis", LOAD, 25.0), ("resonance", LOAD + 25.0, 0.0)])
def test_what_is_inserted_after_a_spring_acts_on_the_side_that_it_says(
    machine: Assembly, effect: type[Effect], parameter: str, at: str, load: float, held: float
) -> None:
    """Each side soon moves one way, so that its dry friction is a constant force; a table at rest has less of it at first."""
    loaded = insert_effect(machine, effect, at, parameters={parameter: 25.0})
    found = run(wire(loaded), overrides={"resonance.damping": 0.9}, duration=0.2)
    motor, table = two_masses(found.time, 0.0, load, held, damping=0.9)
    late = found.time > 0.1
    assert found["x_scale.position"][late] - found["x_axis.position"][late] == pytest.approx((table - motor)[late], abs=2e-8)
    if effect is ForceOffset or at == "x_axis":
        assert found["x_axis.position"] == pytest.approx(motor, abs=1e-8)


def test_a_friction_of_the_motor_side_holds_the_motor_and_not_the_table(machine: Assembly) -> None:
    """The motor is pushed less than its friction carries: it stands, and the load swings the table out on the spring."""
    stiffness = SHARE * MASS * (2.0 * math.pi * FREQUENCY) ** 2
    held = insert_effect(machine, CoulombFriction, "x_axis", parameters={"level": 2.5 * PUSH})
    found = run(wire(held), overrides={"resonance.damping": 0.3}, duration=1.0)
    assert np.max(np.abs(found["x_axis.position"])) < 0.01 * LOAD / stiffness
    assert found["x_scale.position"][-1] == pytest.approx(-LOAD / stiffness, rel=0.01)


def test_a_sensor_that_closes_a_loop_stays_on_the_motor_side() -> None:
    parts = (Part("x_axis", ForceAxis), Part("x_encoder", LinearEncoder), Part("x_scale", LinearEncoder), Part("after", LinearEncoder))
    wires = (
        Wire("x_axis.force", constant=PUSH),
        Wire("x_encoder.measured", "x_axis.position"),
        Wire("x_scale.measured", "x_axis.position"),
        Wire("after.measured", "x_encoder.position"),
    )
    assembly = insert_effect(Assembly(parts, wires, 1e-3, 1e-3), AxialResonance, "x_axis", name="resonance")
    source = {item.target: item.source for item in assembly.wires}
    assert source["x_encoder.measured"] == "x_axis.position"
    assert source["x_scale.measured"] == "resonance_beyond_x_scale.outgoing"


def test_of_two_sensors_that_close_no_loop_the_first_is_on_the_motor_side() -> None:
    parts = (Part("x_axis", ForceAxis), Part("x_encoder", LinearEncoder), Part("x_scale", LinearEncoder))
    wires = (
        Wire("x_axis.force", constant=PUSH), Wire("x_encoder.measured", "x_axis.position"), Wire("x_scale.measured", "x_axis.position")
    )  # fmt: skip
    assembly = insert_effect(Assembly(parts, wires, 1e-3, 1e-3), AxialResonance, "x_axis", name="resonance")
    source = {item.target: item.source for item in assembly.wires}
    assert source["x_encoder.measured"] == "x_axis.position"
    assert source["x_scale.measured"] == "resonance_beyond_x_scale.outgoing"


def sides(encoder: str, scale: str) -> dict[str, str]:
    """Return what feeds an encoder that closes a loop and a scale, with the sides that they say and a spring in between."""
    parts = (
        Part("x_axis", ForceAxis), Part("x_encoder", LinearEncoder, side=encoder), Part("x_scale", LinearEncoder, side=scale),
        Part("after", LinearEncoder),
    )  # fmt: skip
    wires = (
        Wire("x_axis.force", constant=PUSH), Wire("x_encoder.measured", "x_axis.position"), Wire("x_scale.measured", "x_axis.position"),
        Wire("after.measured", "x_encoder.position"),
    )  # fmt: skip
    assembly = insert_effect(Assembly(parts, wires, 1e-3, 1e-3), AxialResonance, "x_axis", name="spring")
    source = {item.target: item.source for item in assembly.wires}
    return {name: source[f"{name}.measured"] for name in ("x_encoder", "x_scale")}


def test_a_sensor_sits_on_the_side_of_the_spring_that_it_says() -> None:
    """A loop may be closed by the scale at the load, and an encoder that closes none may sit at the motor."""
    assert sides("load", "motor") == {"x_encoder": "spring_beyond_x_encoder.outgoing", "x_scale": "x_axis.position"}
    assert sides("load", "load") == {"x_encoder": "spring_beyond_x_encoder.outgoing", "x_scale": "spring_beyond_x_scale.outgoing"}
    assert sides("motor", "motor") == dict.fromkeys(("x_encoder", "x_scale"), "x_axis.position")
    # what does not say it sits at the motor where nothing else does
    assert sides("load", "") == sides("load", "motor")


def test_a_tachometer_at_the_load_sees_the_speed_behind_the_spring() -> None:
    parts = (Part("spindle", TorqueSpindle), Part("tachometer", Tachometer, {"gain": 1.0}, side="load"))
    wires = (Wire("spindle.torque", constant=1.0), Wire("tachometer.speed", "spindle.speed"))
    bare = Assembly(parts, wires, 1e-3, 1e-4, record=("spindle.speed", "tachometer.voltage"))
    values = {"table_share": SHARE, "frequency": FREQUENCY, "damping": DAMPING}
    assembly = insert_effect(bare, AxialResonance, "spindle", name="spring", parameters=values)
    found = run(wire(replace(assembly, record=(*bare.record, "spring.stretch_speed"))), duration=0.1)
    behind = found["spindle.speed"] + found["spring.stretch_speed"]
    assert found["tachometer.voltage"] == pytest.approx(behind, abs=1e-12)
    assert np.max(np.abs(found["spring.stretch_speed"])) > 0.0


def test_a_wind_up_is_refused_at_a_sensor_on_the_motor_side() -> None:
    parts = (Part("x_axis", ForceAxis), Part("x_encoder", LinearEncoder, side="motor"))
    wires = (Wire("x_axis.force", constant=PUSH), Wire("x_encoder.measured", "x_axis.position"))
    with pytest.raises(WiringError, match="x_encoder sits on the motor side, where TorsionalWindUp does not show"):
        insert_effect(Assembly(parts, wires, 1e-3, 1e-3), TorsionalWindUp, "x_encoder")


@pytest.mark.parametrize(("motor_friction", "twists"), [(0.0, 1.0), (0.25, 0.75), (1.0, 0.0)])
def test_what_is_held_on_the_motor_side_twists_no_screw(motor_friction: float, twists: float) -> None:
    """At a steady speed the viscous friction takes the whole push, wherever it acts."""
    parts = (Part("x_axis", ForceAxis, {"mass": MASS, "viscous": VISCOUS}), Part("x_scale", LinearEncoder, {"resolution": 0.0}))
    wires = (Wire("x_axis.force", constant=PUSH), Wire("x_scale.measured", "x_axis.position"))
    bare = Assembly(parts, wires, 1e-3, 1e-3, record=("x_axis.position", "x_scale.position"))
    values = {"compliance": 1e-8, "motor_friction": motor_friction}
    found = run(wire(insert_effect(bare, TorsionalWindUp, "x_scale", parameters=values)), duration=8.0)
    assert (found["x_axis.position"] - found["x_scale.position"])[-1] == pytest.approx(twists * 1e-8 * PUSH, abs=1e-4 * 1e-8 * PUSH)


def test_a_friction_that_comes_before_the_spring_holds_the_table() -> None:
    """The motor is pushed less than the table's friction carries: the motor gives way by the spring, the table does not move."""
    stiffness = SHARE * MASS * (2.0 * math.pi * FREQUENCY) ** 2
    parts = (Part("x_axis", ForceAxis, {"mass": MASS, "viscous": 0.0}), Part("x_scale", LinearEncoder, {"resolution": 0.0}))
    wires = (Wire("x_axis.force", constant=PUSH), Wire("x_scale.measured", "x_axis.position"))
    bare = Assembly(parts, wires, 1e-3, 1e-4, record=("x_axis.position", "x_scale.position"))
    held = insert_effect(bare, CoulombFriction, "x_axis", name="friction", parameters={"level": 2.5 * PUSH})
    values = {"table_share": SHARE, "frequency": FREQUENCY, "damping": 0.3}
    found = run(wire(insert_effect(held, AxialResonance, "x_axis", name="resonance", parameters=values)), duration=1.0)
    assert found["x_axis.position"][-1] == pytest.approx(PUSH / stiffness, rel=1e-3)
    assert np.max(np.abs(found["x_scale.position"])) < 0.01 * PUSH / stiffness


def test_a_second_spring_that_idles_changes_nothing_behind_the_first() -> None:
    """The friction behind the first spring is driven and weighed by that one still, and feels what both give."""
    parts = (Part("x_axis", ForceAxis, {"mass": MASS, "viscous": VISCOUS}),)
    bare = Assembly(parts, (Wire("x_axis.force", constant=PUSH),), 1e-3, 1e-4, record=("x_axis.position", "x_axis.velocity"))
    held = insert_effect(bare, CoulombFriction, "x_axis", name="friction", parameters={"level": 0.5 * PUSH})
    values = {"table_share": SHARE, "frequency": FREQUENCY, "damping": 0.3}
    one = insert_effect(held, AxialResonance, "x_axis", name="screw", parameters=values)
    two = insert_effect(one, AxialResonance, "x_axis", name="coupling")
    source = {item.target: item.source for item in two.wires}
    assert (source["friction.applied"], source["friction.inertia"]) == ("screw.spring_force", "screw.table_inertia")
    assert source["screw.applied"] == "coupling.spring_force"
    before, after = (run(wire(assembly), duration=0.2) for assembly in (one, two))
    assert np.array_equal(before["x_axis.position"], after["x_axis.position"])
    moving = {"x_axis.velocity": np.zeros(10)}
    sensing = sense(two, moving, {"friction", "screw"})
    assert {part.name for part in sensing.parts} >= {"sensed_friction_flow", "sensed_screw_flow"}


def test_without_a_table_behind_it_the_friction_holds_the_whole() -> None:
    parts = (Part("x_axis", ForceAxis, {"mass": MASS, "viscous": VISCOUS}),)
    bare = Assembly(parts, (Wire("x_axis.force", constant=PUSH),), 1e-3, 1e-4, record=("x_axis.position", "x_axis.velocity"))
    held = insert_effect(bare, CoulombFriction, "x_axis", name="friction", parameters={"level": 0.5 * PUSH})
    before = run(wire(held), duration=0.2)
    after = run(wire(insert_effect(held, AxialResonance, "x_axis", name="resonance")), duration=0.2)
    assert np.array_equal(before["x_axis.position"], after["x_axis.position"])
    assert np.array_equal(before["x_axis.velocity"], after["x_axis.velocity"])
