"""Limits of the chip width against published systems and against each other: frequency domain and collocation share no code."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lathesim.errors import LessonError
from lathesim.stability.limits.delay_equations import milling, turning
from lathesim.stability.limits.frequency_limit import limit_at, smallest_limit, speeds_of
from lathesim.stability.limits.periodic_delay import DelayEquation, kind_of, multipliers, smallest_unstable
from lathesim.stability.tool_point.modes import Mode, ToolPoint

KS = 700e6
FREQUENCY = math.sqrt(1e6 / 2.5) / (2.0 * math.pi)
DAMPING = 315.0 / (2.0 * math.sqrt(1e6 * 2.5))
SLIDE = ToolPoint.of([Mode(FREQUENCY, DAMPING, 1e6, math.radians(90.0)), Mode(FREQUENCY, DAMPING, 1e6, 0.0)], math.radians(70.0))
ONE = ToolPoint.of([Mode(FREQUENCY, DAMPING, 1e6, 0.0)], math.radians(70.0))
TWO = ToolPoint(
    (Mode(250.0, 0.012, 2.26e8), Mode(150.0, 0.010, 2.13e8)), (math.cos(math.radians(30.0)) ** 2, math.cos(math.radians(45.0)) ** 2)
)
SLOTTED = ToolPoint((Mode(75.0, 0.02, 8e6),), (1.0,))


def test_the_smallest_limit_and_its_speeds() -> None:
    limit = smallest_limit(SLIDE, KS)
    assert limit.width == pytest.approx(0.91502e-3, rel=1e-5)
    assert limit.frequency == pytest.approx(110.230, abs=1e-3)
    assert speeds_of(limit, 6) == pytest.approx([8651.8, 3748.4, 2392.5, 1756.9, 1388.2, 1147.3], abs=0.065)


@pytest.mark.parametrize(
    ("speed", "width"),
    [(500, 0.9728), (1000, 0.9320), (1500, 1.0560), (2000, 1.2291), (2500, 0.9528), (3000, 1.6380), (4000, 0.9706), (5000, 1.7934),
     (6000, 3.1213), (8000, 0.9545)],
)  # fmt: skip
def test_limits_over_speed_by_both_methods(speed: float, width: float) -> None:
    assert limit_at(SLIDE, KS, speed).width * 1e3 == pytest.approx(width, abs=6e-5)
    found, _ = smallest_unstable(lambda b: turning(ONE, KS, b, speed), 0.5e-3)
    assert found * 1e3 == pytest.approx(width, rel=1e-4)


def test_multipliers_of_the_slide_at_2000_rpm() -> None:
    found = [abs(multipliers(turning(ONE, KS, width, 2000.0))[0]) for width in (1.0e-3, 1.5e-3)]
    assert found == pytest.approx([0.8093234, 1.2156405], abs=1e-6)


@pytest.mark.parametrize(
    ("speed", "width"), [(2000, 8.4435), (3000, 32.287), (5000, 9.9268), (8000, 10.7835), (9000, 7.6220), (12000, 9.4762), (14000, 12.867)]
)
def test_two_modes(speed: float, width: float) -> None:
    assert limit_at(TWO, 1e9, speed).width * 1e3 == pytest.approx(width, rel=1e-4)
    assert abs(multipliers(turning(TWO, 1e9, width * 1e-3, speed))[0]) == pytest.approx(1.0, abs=1e-4)


@pytest.mark.parametrize(
    ("speed", "damping", "width"),
    [(300, 5e4, 1.2864), (300, 1e5, 2.4530), (300, 2e5, math.inf), (500, 1e5, 1.4064), (800, 2e5, 1.6482), (1000, 5e4, 1.0087),
     (2000, 2e5, 1.3963), (4000, 1e5, 1.0085)],
)  # fmt: skip
def test_process_damping_by_both_methods(speed: float, damping: float, width: float) -> None:
    # the drag acts on the mode itself, as the force of the chip does along it
    tool = ToolPoint((Mode(FREQUENCY, DAMPING, 1e6),), (1.0,))
    stiffness = KS * math.cos(math.radians(70.0))
    found = limit_at(tool, stiffness, speed, process_damping=damping, diameter=0.036).width
    assert found * 1e3 == pytest.approx(width, rel=5e-4)
    if math.isfinite(width):
        cut = turning(tool, stiffness, found, speed, process_damping=damping, diameter=0.036)
        assert abs(multipliers(cut)[0]) == pytest.approx(1.0, abs=1e-6)


def test_hayes_and_mathieu() -> None:
    hayes = DelayEquation(lambda time: np.array([[-1.0]]), lambda time: np.array([[-1.0]]), 1.0)
    assert abs(multipliers(hayes)[0]) == pytest.approx(0.5460630043605498, abs=1e-10)
    mathieu = DelayEquation(
        lambda time: np.array([[0.0, 1.0], [-(3.0 + 2.0 * math.cos(time)), -0.1]]),
        lambda time: np.array([[0.0, 0.0], [-0.15, 0.0]]),
        2.0 * math.pi,
        frequency=0.5,
    )
    assert abs(multipliers(mathieu)[0]) == pytest.approx(0.51205228410, abs=1e-7)


MILL = Mode(922.0, 0.011, 0.03993 * (2.0 * math.pi * 922.0) ** 2)


@pytest.mark.parametrize(("width", "radius"), [(0.2, 0.81974278), (0.5, 1.07397559), (0.7, 1.22155614), (1.0, 1.40647353)])
def test_multipliers_of_slot_milling(width: float, radius: float) -> None:
    cut = milling(MILL, 6e8, 2e8, width * 1e-3, 5000.0, teeth=2, entry=0.0, leave=math.pi)
    assert abs(multipliers(cut)[0]) == pytest.approx(radius, abs=1e-7)


@pytest.mark.parametrize(
    ("speed", "entry", "width", "kind"),
    [(5000, 0.0, 0.4086, "Hopf"), (10000, 0.0, 0.3224, "Hopf"), (15000, 0.0, 0.3866, "Hopf"), (20000, 0.0, 1.4175, "flip"),
     (5000, 0.5, 0.8472, "Hopf"), (10000, 0.5, 2.1047, "flip"), (15000, 0.5, 2.5962, "flip"), (20000, 0.5, 0.7196, "Hopf")],
)  # fmt: skip
def test_limits_of_milling_and_how_stability_is_lost(speed: float, entry: float, width: float, kind: str) -> None:
    found, multiplier = smallest_unstable(
        lambda b: milling(MILL, 6e8, 2e8, b, speed, teeth=2, entry=entry * math.pi, leave=math.pi), 0.1e-3
    )
    assert found * 1e3 == pytest.approx(width, rel=5e-4)
    assert kind_of(multiplier) == kind


@pytest.mark.parametrize(
    ("speed", "share", "width", "kind"),
    [(1500, 1.0, 2.6446, "Hopf"), (1500, 0.25, 10.5735, "flip"), (2000, 0.5, 4.1459, "Hopf"), (2000, 0.25, 6.4423, "flip"),
     (2500, 0.5, 1.2225, "Hopf"), (3500, 0.5, 4.5752, "flip"), (3500, 0.25, 15.610, "Hopf"), (4000, 0.5, 10.819, "flip"),
     (6000, 0.25, 2.2566, "Hopf")],
)  # fmt: skip
def test_interrupted_turning(speed: float, share: float, width: float, kind: str) -> None:
    found, multiplier = smallest_unstable(lambda b: turning(SLOTTED, 6e8, b, speed, share=share), 0.3e-3, largest=0.02)
    assert found * 1e3 == pytest.approx(width, rel=5e-4)
    assert kind_of(multiplier) == kind


@pytest.mark.slow
def test_both_methods_agree_on_random_systems() -> None:
    chance = np.random.default_rng(4)
    for _ in range(20):
        count = int(chance.integers(1, 4))
        modes = tuple(Mode(float(f), float(z), float(k)) for f, z, k in zip(
            chance.uniform(60, 400, count), chance.uniform(0.01, 0.08, count), chance.uniform(2e6, 4e7, count), strict=True
        ))  # fmt: skip
        tool = ToolPoint(modes, tuple(chance.uniform(0.2, 1.0, count)))
        for speed in chance.uniform(800, 8000, 10):
            by_frequency = limit_at(tool, 1e9, float(speed)).width
            radius = [abs(multipliers(turning(tool, 1e9, share * by_frequency, float(speed)))[0]) for share in (0.999, 1.001)]
            assert radius[0] < 1.0 < radius[1], (modes, speed)


@pytest.mark.parametrize(
    "wrong", [lambda: Mode(100.0, -0.1, 1e6), lambda: Mode(100.0, 0.1, 0.0), lambda: turning(ONE, KS, 1e-3, 0.0),
              lambda: turning(ONE, KS, 1e-3, 1000.0, share=1.5)],
)  # fmt: skip
def test_what_cannot_be_is_refused_in_a_sentence(wrong: object) -> None:
    with pytest.raises(LessonError, match="Give"):
        wrong()  # type: ignore[operator]
