"""Limits of the chip width against published systems and against each other: frequency domain and collocation share no code."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lathesim.errors import LessonError
from lathesim.stability.frequency_limit import limit_at, smallest_limit, speeds_of
from lathesim.stability.periodic_delay import DelayEquation, chatter_frequency, kind_of, milling, multipliers, smallest_unstable, turning
from lathesim.stability.tool_point import Mode, ToolPoint
from tests.stability.own_cut import radius

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


DRAG = {
    300: (0.9245, 1.2864, 2.4530, math.inf),
    500: (0.9728, 1.1303, 1.4064, math.inf),
    800: (1.0187, 1.1068, 1.2229, 1.6482),
    1000: (0.9320, 1.0087, 1.1058, 1.4189),
    2000: (1.2291, 1.2654, 1.3050, 1.3963),
    4000: (0.9706, 0.9891, 1.0085, 1.0502),
}
"""Speed [rpm] -> limits [mm] with a drag of 0, 5e4, 1e5 and 2e5 N/m."""


@pytest.mark.parametrize(
    ("speed", "damping", "width"),
    [(speed, damping, width) for speed, row in DRAG.items() for damping, width in zip((0.0, 5e4, 1e5, 2e5), row, strict=True)],
)
def test_process_damping_by_both_methods(speed: float, damping: float, width: float) -> None:
    # the drag acts along the normal, however the cutting force of 70 deg lies to it
    found = limit_at(SLIDE, KS, speed, process_damping=damping, diameter=0.036).width
    assert found * 1e3 == pytest.approx(width, rel=5e-4)
    at = found if math.isfinite(width) else 20e-3
    size = abs(multipliers(turning(ONE, KS, at, speed, process_damping=damping, diameter=0.036))[0])
    assert size == pytest.approx(1.0, abs=1e-6) if math.isfinite(width) else size < 1.0


def test_an_own_reading_of_cuts_with_inclined_modes_and_process_damping() -> None:
    chance = np.random.default_rng(7)
    for _ in range(3):
        angles, force = chance.uniform(-1.0, 1.0, 2), float(chance.uniform(0.2, 0.8))
        modes = [Mode(float(f), 0.04, 6e6, float(a)) for f, a in zip(chance.uniform(80.0, 160.0, 2), angles, strict=True)]
        tool, speed, damping = ToolPoint.of(modes, force), float(chance.uniform(2000.0, 4000.0)), float(chance.uniform(1e4, 1e5))
        width = limit_at(tool, KS, speed, process_damping=damping, diameter=0.036).width
        rows = [
            (m.frequency, m.damping, m.stiffness, math.cos(force - m.direction) * math.cos(m.direction), math.cos(m.direction) ** 2)
            for m in modes
        ]
        drag = width * damping / (math.pi * 0.036 * speed / 60.0)
        assert radius(rows, lambda time, at=width: KS * at, drag, 60.0 / speed, 40) == pytest.approx(1.0, abs=2e-3)  # type: ignore[misc]


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


SLOT = {
    1500: ("2.6446 H", "5.7593 H", "10.5735 F"),
    2000: ("1.9462 H", "4.1459 H", "6.4423 F"),
    2500: ("0.6015 H", "1.2225 H", "2.5249 H"),
    3000: ("0.9864 H", "2.1002 H", "4.4855 H"),
    3500: ("2.8779 H", "4.5752 F", "15.610 H"),
    4000: ("5.5393 H", "10.819 F", "inf H"),
    6000: ("0.5453 H", "1.1198 H", "2.2566 H"),
}
"""Speed [rpm] -> limits [mm] and how stability is lost, with the bar in the cut for all, a half and a quarter of each turn."""


@pytest.mark.parametrize(
    ("speed", "share", "width", "kind"),
    [
        (speed, share, float(text.split()[0]), {"H": "Hopf", "F": "flip"}[text.split()[1]])
        for speed, row in SLOT.items()
        for share, text in zip((1.0, 0.5, 0.25), row, strict=True)
    ],
)
def test_interrupted_turning(speed: float, share: float, width: float, kind: str) -> None:
    found, multiplier = smallest_unstable(lambda b: turning(SLOTTED, 6e8, b, speed, share=share), 0.3e-3, largest=0.0199)
    if math.isinf(width):
        assert found > 0.0199
        return
    assert found * 1e3 == pytest.approx(width, rel=5e-4)
    assert kind_of(multiplier) == kind


def test_modes_far_apart_at_a_low_speed_agree_and_take_no_minutes() -> None:
    # 142 vibrations in a turn: 5760 values of a period, of which the largest multipliers alone are looked for
    tool = ToolPoint((Mode(155.0, 0.03, 1.2e7), Mode(1344.0, 0.02, 4e7)), (1.0, 1.0))
    wanted = limit_at(tool, 1e9, 567.0)
    sizes = [abs(multipliers(turning(tool, 1e9, share * wanted.width, 567.0))[0]) for share in (1.0, 1.0 + 1e-6)]
    assert sizes[0] == pytest.approx(1.0, abs=3e-10) and sizes[1] > 1.0
    at_limit = turning(tool, 1e9, wanted.width, 567.0)
    assert chatter_frequency(at_limit, multipliers(at_limit)[0]) == pytest.approx(wanted.frequency, rel=1e-9)


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
