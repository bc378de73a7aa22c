"""Axes and spindles: the linear laws against their closed solutions, friction at rest and in motion, current limits."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lathesim.component import Component, Input, Parameter, State
from lathesim.components.axes import AnalyticalAxis, EmpiricalAxis, ForceAxis, LedRotaryTable
from lathesim.components.drives import dry_friction
from lathesim.components.servo_controllers import AngularPositionController, PositionController, SpindleController
from lathesim.components.spindles import AnalyticalSpindle, EmpiricalSpindle, TorqueSpindle
from lathesim.engine.assembly import Assembly, Part, Wire
from lathesim.engine.batch import Batch
from lathesim.engine.wiring import wire
from lathesim.lessons.lesson import load_machine
from lathesim.lessons.simulate import check_machine
from lathesim.plugins import load_registry
from lathesim.shipped import shipped_folder

STEP = 0.0005


def answer(component: type[Component], law: str, **values: float) -> tuple[float, ...]:
    known = {name: item.default for kind in (Parameter, Input) for name, item in component.declared(kind).items()}
    known |= dict.fromkeys(component.declared(State), 0.0) | {"step": STEP, "time": 0.0} | values
    return component.law_answer(law, known)


def integrate(
    component: type[Component], duration: float, watch: Callable[[list[float]], None] = lambda _: None, **values: float
) -> list[float]:
    """RK4 with the states from zero."""
    names = list(component.declared(State))
    state = [values.pop(name, 0.0) for name in names]

    def rates(point: list[float]) -> tuple[float, ...]:
        return answer(component, "derivative", **values, **dict(zip(names, point, strict=True)))

    for _ in range(round(duration / STEP)):
        k1 = rates(state)
        k2 = rates([s + STEP / 2 * k for s, k in zip(state, k1, strict=True)])
        k3 = rates([s + STEP / 2 * k for s, k in zip(state, k2, strict=True)])
        k4 = rates([s + STEP * k for s, k in zip(state, k3, strict=True)])
        state = [s + STEP / 6 * (a + 2 * (b + c) + d) for s, a, b, c, d in zip(state, k1, k2, k3, k4, strict=True)]
        watch(state)
    return state


def test_empirical_axis_answers_a_voltage_step_as_equation_9_says() -> None:
    speed, travel = integrate(EmpiricalAxis, 0.1, voltage=2.0)
    gain, tau = 0.01878, 0.0243
    assert speed == pytest.approx(2.0 * gain * (1 - math.exp(-0.1 / tau)), rel=1e-7)
    assert travel == pytest.approx(2.0 * gain * (0.1 - tau * (1 - math.exp(-0.1 / tau))), rel=1e-6)


def test_a_disturbance_acts_against_positive_motion() -> None:
    assert integrate(EmpiricalAxis, 0.5, voltage=0.0, force=100.0, disturbance_gain=1e-5)[0] == pytest.approx(-1e-3)
    assert integrate(ForceAxis, 5.0, force=100.0, disturbance=60.0)[0] < 0.2
    assert integrate(EmpiricalSpindle, 3.0, voltage=0.0, torque=2.0)[0] == pytest.approx(-2 * 1.0436, rel=1e-5)


def test_analytical_axis_is_the_empirical_one_while_nothing_saturates() -> None:
    # REFERENCE of the 2004 paper: D = B + Kt (Ka Kmtach + Kv)/R, K = Kl p Kt Ka/(R D), tau = J/D, Kd = (Kl p)^2/D
    ratio, viscous = 7.957747154594767e-4, 1e-3 + 1e-3 + 7.957747154594767e-4**2 * 200
    drag = viscous + 0.25 * (20 * 0.03 + 0.25) / 1.0
    gain, tau = ratio * 0.25 * 20 / drag, (2.2e-3 + 6e-4 + ratio**2 * 150) / drag
    speed, travel = integrate(AnalyticalAxis, 0.08, voltage=0.5, force=100.0)
    twin = integrate(EmpiricalAxis, 0.08, voltage=0.5, force=100.0, gain=gain, time_constant=tau, disturbance_gain=ratio**2 / drag)
    assert speed * ratio == pytest.approx(twin[0], rel=1e-9)
    assert travel == pytest.approx(twin[1], rel=1e-9)
    assert gain == pytest.approx(0.01853, rel=0.01)


def test_analytical_spindle_reaches_its_published_size() -> None:
    drag = 0.03 + 0.5 * (20 * 0.0122 + 0.5) / 0.4
    speed, _ = integrate(AnalyticalSpindle, 3.0, voltage=1.0)
    assert speed == pytest.approx(0.5 * 20 / (0.4 * drag), rel=1e-5)
    assert speed * 60 / (2 * math.pi) == pytest.approx(249.0, rel=0.01)  # rpm per volt


def test_current_is_limited() -> None:
    assert answer(AnalyticalAxis, "output_current", voltage=10.0, motor_speed=0.0) == (25.0,)
    assert answer(AnalyticalAxis, "output_current", voltage=-10.0, motor_speed=0.0) == (-25.0,)
    assert answer(AnalyticalSpindle, "output_current", voltage=10.0, rotation=0.0) == (200.0,)
    assert answer(AnalyticalSpindle, "output_motor_torque", voltage=10.0, rotation=0.0) == (100.0,)
    acceleration = answer(AnalyticalAxis, "derivative", voltage=10.0)[0]
    assert acceleration == answer(AnalyticalAxis, "derivative", voltage=1.25)[0]


def test_the_force_that_an_axis_tells_is_the_one_that_moves_it() -> None:
    ratio = 7.957747154594767e-4
    for speed in (-30.0, 0.0, 12.0):
        force = answer(AnalyticalAxis, "output_drive_force", voltage=0.3, motor_speed=speed)[0]
        (mass,) = answer(AnalyticalAxis, "output_equivalent_mass")
        assert answer(AnalyticalAxis, "derivative", voltage=0.3, motor_speed=speed)[0] * ratio == pytest.approx(force / mass, rel=1e-12)


def test_power_is_torque_times_speed_and_the_back_emf_what_a_speed_takes_up() -> None:
    torque, power = (answer(AnalyticalAxis, f"output_{name}", voltage=0.3, motor_speed=12.0)[0] for name in ("torque", "power"))
    assert power == pytest.approx(12.0 * torque)
    (takes_up,) = answer(AnalyticalAxis, "output_back_emf")
    current = answer(AnalyticalAxis, "output_current", voltage=takes_up * 0.01, motor_speed=0.01 / 7.957747154594767e-4)
    assert current[0] == pytest.approx(0.0, abs=1e-12)
    assert answer(AnalyticalAxis, "output_back_emf", amplifier_gain=0.0) == (0.0,)


def test_friction_holds_the_axis_still() -> None:
    # 0.01 V gives 0.05 N m; 0.08 N m of friction holds it
    speed, travel = integrate(AnalyticalAxis, 0.2, voltage=0.01, motor_coulomb=0.08)
    assert (speed, travel) == (0.0, 0.0)


def test_friction_brings_to_rest_without_chatter() -> None:
    speeds: list[float] = []
    friction = {"motor_coulomb": 0.1, "table_coulomb": 50.0}
    integrate(AnalyticalAxis, 0.3, lambda state: speeds.append(state[0]), voltage=0.0, motor_speed=20.0, **friction)
    assert all(later <= earlier for earlier, later in itertools.pairwise(speeds))
    assert min(speeds) >= 0.0
    assert speeds[-1] < 1e-12


def test_sliding_friction_is_the_full_friction() -> None:
    free, rubbing = (answer(AnalyticalAxis, "derivative", voltage=0.5, motor_speed=20.0, motor_coulomb=level)[0] for level in (0.0, 0.1))
    inertia = 2.2e-3 + 6e-4 + 7.957747154594767e-4**2 * 150
    assert free - rubbing == pytest.approx(0.1 / inertia)


@given(applied=st.floats(-100, 100), speed=st.floats(-1, 1), level=st.floats(0, 50), inertia=st.floats(0.1, 200))
def test_friction_never_drives(applied: float, speed: float, level: float, inertia: float) -> None:
    friction = dry_friction(applied, speed, level, inertia, STEP)
    assert abs(friction) <= level
    assert friction == -dry_friction(-applied, -speed, level, inertia, STEP)
    after = speed + (applied - friction) / inertia * STEP
    without = speed + applied / inertia * STEP
    assert abs(after) <= abs(without) + 1e-9


def swung(gravity: float, start: float, samples: int = 4000, inertia: float = 2e-8) -> np.ndarray:
    """Return the angle of an arm that is let go at an angle [rad], one value a millisecond."""
    part = Part("arm", TorqueSpindle, {"inertia": inertia, "viscous": 0.0, "gravity": gravity}, {"turned": start})
    plan = wire(Assembly((part,), (Wire("arm.torque", constant=0.0),), 1e-3, 1e-4, record=("arm.angle",)))
    (made,) = Batch(plan, samples, noisy=False).run([], np.zeros((1, 0)))
    return np.asarray(made[0])


@pytest.mark.parametrize(("start", "longer"), [(0.01, 1.0), (math.pi / 2, 1.18034)])
def test_an_arm_swings_as_a_pendulum_does(start: float, longer: float) -> None:
    """T = 4 K(sin(a/2)) sqrt(J/G): 1.18034 times 2 pi sqrt(J/G) from level. Inertia of 2e-8 kg m^2, a pointer of 0.1 g."""
    period = 0.5
    angle = swung(2e-8 * (2.0 * math.pi / period) ** 2, start)
    turns = np.flatnonzero((angle[1:-1] > angle[:-2]) & (angle[1:-1] >= angle[2:])) + 1
    assert np.mean(np.diff(turns)) * 1e-3 == pytest.approx(longer * period, abs=1e-3)
    assert angle.max() == pytest.approx(start, rel=1e-4)


def test_without_gravity_the_arm_stays() -> None:
    assert np.all(swung(0.0, 1.0, samples=50) == 1.0)


def test_a_mass_below_a_gram_is_taken() -> None:
    assert ForceAxis.declarations["mass"].low < 1e-6  # type: ignore[attr-defined]


def slopes(controller: type[PositionController | AngularPositionController], lag: float, errors: list[float]) -> list[float]:
    held = (0.0, 0.0, 0.0, 0.0)
    corrected = (0.0,) * ("correction" in controller.declarations)
    found = []
    for error in errors:
        voltage, *kept = controller.update(error, 0.0, *corrected, 0.0, 0.0, 1.0, lag, -1e9, 1e9, *held, 1e-3)
        found.append(voltage)
        held = (kept[0], kept[1], kept[2], kept[3])
    return found


@pytest.mark.parametrize("controller", [PositionController, AngularPositionController, SpindleController])
def test_a_derivative_without_a_filter_is_the_slope_of_the_last_sample_and_with_one_it_comes_late(
    controller: type[PositionController | AngularPositionController],
) -> None:
    ramp = [0.002 * sample for sample in range(2000)]
    assert slopes(controller, 0.0, ramp)[1:] == pytest.approx([2.0] * 1999)
    late = slopes(controller, 20e-3, ramp)
    assert late[1] == pytest.approx(2.0 / 21.0)
    assert late[20] == pytest.approx(2.0 * (1.0 - (20.0 / 21.0) ** 20))
    assert late[-1] == pytest.approx(2.0)


def test_a_led_table_takes_the_current_of_its_motion() -> None:
    assert LedRotaryTable.output_current(2.0, 3.0, 1.5, 0.5, 0.25, 10.0) == pytest.approx((0.5 * 3.0 + 0.25 * 2.0 + 1.5) / 10.0)


@pytest.mark.parametrize("name", ["led_rotary_table", "rotary_axis"])
def test_the_templates_are_whole(name: str) -> None:
    checked = check_machine(load_machine(shipped_folder("lesson_configs") / "machines" / f"{name}.yaml"), load_registry(installed=False))
    assert checked.assembly.parts
