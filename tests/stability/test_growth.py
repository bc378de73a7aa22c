"""The cut in the loop: growth from turn to turn against the multipliers of collocation, plain as compiled, and chatter that stays."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lathesim.engine.run import run
from lathesim.errors import SimulationError
from lathesim.stability.frequency_limit import limit_at
from lathesim.stability.lesson_settings import Milling
from lathesim.stability.lobes import growth, milling_rig, rig, time_limit
from lathesim.stability.periodic_delay import multipliers, turning
from lathesim.stability.tool_point import Mode, ToolPoint
from tests.stability.own_cut import radius, tooth_force

SLOTTED = ToolPoint((Mode(75.0, 0.02, 8e6),), (1.0,))
POINTS = [
    (1500, 1.0, 2.6446), (2000, 1.0, 1.9462), (2500, 1.0, 0.6015), (6000, 1.0, 0.5453), (1500, 0.5, 5.7593), (2500, 0.5, 1.2225),
    (3500, 0.5, 4.5752), (4000, 0.5, 10.819), (2000, 0.25, 6.4423), (3000, 0.25, 4.4855), (3500, 0.25, 15.61), (6000, 0.25, 2.2566),
]  # fmt: skip


@pytest.mark.parametrize(("speed", "share", "width"), POINTS)
def test_growth_in_the_engine_is_the_multiplier(speed: float, share: float, width: float) -> None:
    widths = np.array([0.98, 1.02]) * width * 1e-3
    found = growth(rig(SLOTTED, 6e8, speed, values={"interrupted": share}), widths)
    wanted = [abs(multipliers(turning(SLOTTED, 6e8, float(at), speed, share=share))[0]) for at in widths]
    assert [abs(value) for value in found] == pytest.approx(wanted, abs=1e-5)


def test_growth_converges_with_the_fourth_order() -> None:
    wanted = abs(multipliers(turning(SLOTTED, 6e8, 2.65e-3, 1500.0))[0])
    errors = []
    for steps in (12, 24):
        made = rig(SLOTTED, 6e8, 1500.0, steps_of_a_vibration=steps, fewest_steps=1)
        errors.append(abs(abs(growth(made, np.array([2.65e-3]))[0]) - wanted))
    assert 3.5 < np.log2(errors[0] / errors[1]) < 4.8


@pytest.mark.parametrize("share", [1.0, 0.4])
def test_the_cut_runs_plain_as_compiled(share: float) -> None:
    made = rig(SLOTTED, 6e8, 3000.0, values={"interrupted": share, "exponent": 0.75, "always_in_contact": 0.0, "run_out": 1e-5})
    changed = {"mode_1.swing": 1e-5}
    runs = [run(made.plan, duration=0.06, engine=engine, overrides=changed) for engine in ("plain", "compiled")]
    assert np.array_equal(runs[0]["mode_1.displacement"], runs[1]["mode_1.displacement"])


def test_the_limit_in_the_time_domain_with_two_modes() -> None:
    two = ToolPoint((Mode(250.0, 0.012, 2.26e8), Mode(150.0, 0.010, 2.13e8)), (0.75, 0.5))
    width, _ = time_limit(rig(two, 1e9, 5000.0), 3e-3, 0.2)
    assert width == pytest.approx(9.9268e-3, rel=5e-4)


def test_growth_of_milling_in_the_engine_is_the_multiplier() -> None:
    mode = Mode(922.0, 0.011, 0.03993 * (2.0 * math.pi * 922.0) ** 2)
    made = milling_rig(mode, Milling(2, 6e8, 2e8, 0.0, math.pi), 5000.0)
    found = [abs(value) for value in growth(made, np.array([0.2e-3, 0.5e-3, 0.7e-3, 1.0e-3]))]
    assert found == pytest.approx([0.81974278, 1.07397559, 1.22155614, 1.40647353], abs=2e-5)


@pytest.mark.parametrize(
    ("teeth", "entry", "leave", "speed", "wanted"),
    [(1, 60.0, 150.0, 9200.0, 27.268e-3), (1, 0.0, 120.0, 7000.0, None), (3, 90.0, 180.0, 2600.0, None)],
)
def test_the_limit_of_milling_whatever_the_number_of_teeth(
    teeth: int, entry: float, leave: float, speed: float, wanted: float | None
) -> None:
    cut = Milling(teeth, 9e8, 4e8, math.radians(entry), math.radians(leave))
    width, _ = time_limit(milling_rig(Mode(300.0, 0.02, 8e6), cut, speed), 5e-4, 0.2)
    if wanted is not None:
        assert width == pytest.approx(wanted, rel=1e-4)

    def push(time: float) -> float:
        return width * tooth_force(2.0 * math.pi * speed / 60.0 * time, 9e8, 4e8, cut.entry, cut.leave, teeth)

    assert radius([(300.0, 0.02, 8e6, 1.0, 1.0)], push, 0.0, 60.0 / speed / teeth, 80) == pytest.approx(1.0, abs=2e-3)


def test_process_damping_in_the_engine_acts_along_the_normal() -> None:
    slide = ToolPoint.of([Mode(100.658424, 0.09961174, 1e6, math.radians(angle)) for angle in (90.0, 0.0)], math.radians(70.0))
    width, _ = time_limit(rig(slide, 700e6, 1000.0, values={"process_damping": 2e5}), 0.5e-3, 0.05)
    assert width == pytest.approx(1.4189e-3, rel=1e-4)


def test_a_tooth_that_passes_within_a_sample_is_named() -> None:
    made = milling_rig(Mode(300.0, 0.02, 8e6), Milling(64, 9e8, 4e8, 0.0, math.pi), 5000.0)
    with pytest.raises(SimulationError, match=r"cut\.force stopped being a number"):
        run(made.plan, duration=1e-3, engine="compiled", overrides={"spindle.target": 2e5})


def lives_on(speed: float, exponent: float, share_of_limit: float, start: float) -> bool:
    """Return whether vibration of a cut of 0.1 mm lasts once begun at ``start`` [m], where the tool may leave the part."""
    made = rig(SLOTTED, 6e8, speed, values={"exponent": exponent, "always_in_contact": 0.0, "feed": 1e-4})
    changed = {"mode_1.swing": start, "cut.width": share_of_limit * limit_at(SLOTTED, 6e8, speed).width}
    x = run(made.plan, duration=500 * 60.0 / speed, engine="compiled", overrides=changed)["mode_1.displacement"]
    turn = made.samples_of_a_turn
    earlier, last = np.ptp(x[-200 * turn : -190 * turn]), np.ptp(x[-10 * turn :])
    return bool(last > 0.98 * earlier and last > 2e-5)


@pytest.mark.parametrize("speed", [1750.0, 2500.0, 3500.0, 4500.0])
def test_chatter_once_begun_lives_on_below_the_limit_with_a_force_that_bends(speed: float) -> None:
    starts = (7e-5, 1.5e-4, 3e-4)  # below, chatter falls back to the cut at rest; far above, to another wave that dies out
    assert any(lives_on(speed, 0.75, 0.95, start) for start in starts)
    assert not lives_on(speed, 0.75, 0.95, 1e-9)
    assert not any(lives_on(speed, 0.75, 0.92, start) for start in starts)
    assert not any(lives_on(speed, 1.0, 0.98, start) for start in starts)
