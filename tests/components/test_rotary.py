"""Rotary axes: a controller in radians with a filtered derivative, gravity over the angle, a table that is led, very small inertias."""

import math

import numpy as np
import pytest

from lathesim.components.axes import ForceAxis, LedRotaryTable
from lathesim.components.servo_controllers import AngularPositionController
from lathesim.components.spindles import TorqueSpindle
from lathesim.engine.assembly import Assembly, Part, Wire
from lathesim.engine.batch import Batch
from lathesim.engine.wiring import wire
from lathesim.lessons.lesson import load_machine
from lathesim.lessons.simulate import check_machine
from lathesim.plugins import load_registry
from lathesim.shipped import shipped_folder


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


def slopes(lag: float, errors: list[float]) -> list[float]:
    held = (0.0, 0.0, 0.0, 0.0)
    found = []
    for error in errors:
        voltage, *kept = AngularPositionController.update(error, 0.0, 0.0, 0.0, 1.0, lag, -1e9, 1e9, *held, 1e-3)
        found.append(voltage)
        held = (kept[0], kept[1], kept[2], kept[3])
    return found


def test_a_derivative_without_a_filter_is_the_slope_of_the_last_sample_and_with_one_it_comes_late() -> None:
    ramp = [0.002 * sample for sample in range(2000)]
    assert slopes(0.0, ramp)[1:] == pytest.approx([2.0] * 1999)
    late = slopes(20e-3, ramp)
    assert late[1] == pytest.approx(2.0 / 21.0)
    assert late[20] == pytest.approx(2.0 * (1.0 - (20.0 / 21.0) ** 20))
    assert late[-1] == pytest.approx(2.0)


def test_a_led_table_takes_the_current_of_its_motion() -> None:
    assert LedRotaryTable.output_current(2.0, 3.0, 1.5, 0.5, 0.25, 10.0) == pytest.approx((0.5 * 3.0 + 0.25 * 2.0 + 1.5) / 10.0)


@pytest.mark.parametrize("name", ["led_rotary_table", "rotary_axis"])
def test_the_templates_are_whole(name: str) -> None:
    checked = check_machine(load_machine(shipped_folder("lesson_configs") / "machines" / f"{name}.yaml"), load_registry(installed=False))
    assert checked.assembly.parts
