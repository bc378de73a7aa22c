"""One number a law that can be checked by hand."""

from __future__ import annotations

import math
from typing import Any

import pytest

from lathesim.effects.register import stock_effects

QUARTER = math.pi / 2.0
NUMBERS: list[tuple[str, dict[str, float], float]] = [
    # weight of 100 kg on a bed slanted by 30 degrees
    ("GravityTorque", {"incoming": 0.0, "displacement": 0.3 + math.pi / 6.0, "torque": 4.0, "lowest": 0.3}, 2.0),
    ("ForceOffset", {"incoming": 0.0, "offset": 100.0 * 9.81 * 0.5}, 490.5),
    ("ConverterOffset", {"incoming": 1.2345, "offset": 0.01}, 1.2445),
    ("ConverterResolution", {"incoming": 1.2345, "resolution": 0.1, "origin": 0.0}, 1.2),
    # 8 bits from -10 V to 10 V: the two levels nearest to 0 are 39 mV away
    ("ConverterResolution", {"incoming": 0.03, "resolution": 20.0 / 255.0, "origin": 0.5}, 10.0 / 255.0),
    ("DriveGainError", {"incoming": 2.0, "error": 0.05, "sag": 0.01}, 2.06),
    ("ScaleFactorError", {"incoming": 1.0, "factor": 25.4}, 25.4),
    # class 5: 23 um over 300 mm
    ("CumulativePitchError", {"incoming": 0.3, "slope": 23e-6 / 0.3, "origin": 0.0}, 0.300023),
    ("PeriodicPitchError", {"incoming": 0.00125, "amplitude": 2e-6, "lead": 0.005, "phase": 0.0}, 0.001252),
    # at the top of the sine the second harmonic's cosine and the third's sine are at their bottom
    (
        "PeriodicPitchError",
        {"incoming": 0.00125, "amplitude": 2e-6, "lead": 0.005, "phase": 0.0, "second_cosine": 0.1, "third_sine": 0.2},
        0.0012514,
    ),
    # a steel screw 10 K warmer: 11.5 um/m/K * 10 K * 0.5 m = 57.5 um
    (
        "ThermalScrewGrowth",
        {"incoming": 0.5, "time": 1e9, "strain": 115e-6, "time_constant": 600.0, "fixed_end": 0.0, "warmed_before": 0.0},
        0.5000575,
    ),
    ("SquarenessError", {"incoming": 0.0, "other_position": 0.2, "slope": 20e-6, "bow": 0.0}, 4e-6),
    # 100 N/um pushed with 100 N
    ("TorsionalWindUp", {"incoming": 0.0, "twist": 1e-6, "compliance": 1e-8}, -1e-6),
    ("AmplifierDeadZone", {"incoming": -1.0, "half_width": 0.2}, -0.8),
    ("AmplifierDeadZone", {"incoming": 0.1, "half_width": 0.2}, 0.0),
    ("DriveSaturation", {"incoming": -12.0, "level": 10.0}, -10.0),
    ("CurrentLimit", {"incoming": 5.0, "flow": 2.0, "back_emf": 1.5, "level": 1.0}, 4.0),
    ("CurrentLimit", {"incoming": 3.5, "flow": 2.0, "back_emf": 1.5, "level": 1.0}, 3.5),
    ("DriveSaturation", {"incoming": -10.0, "level": 10.0, "softness": 0.5}, -10.0 / math.sqrt(2.0)),
    ("DriveSaturation", {"incoming": 30.0, "level": 10.0, "softness": 1.0}, 7.5),
    ("DriveSaturation", {"incoming": 30.0, "level": 10.0, "softness": 1e-9}, 10.0),
    (
        "TorqueRipple",
        {"incoming": 0.0, "applied": 100.0, "displacement": 0.00125, "amplitude": 2.0, "share": 0.01, "period": 0.005, "phase": 0.0},
        -3.0,
    ),
    (
        "Cogging",
        {"incoming": 0.0, "displacement": 0.0, "amplitude": 2.0, "second": 1.0, "period": 0.005}
        | {"phase": QUARTER, "second_phase": -QUARTER},
        1.0,
    ),
    ("EncoderEccentricity", {"incoming": 0.0, "amplitude": 3e-6, "turn": 0.005, "phase": QUARTER}, 3e-6),
    ("EncoderInterpolationError", {"incoming": 5e-6, "amplitude": 3e-7, "second": 0.0, "signal_period": 2e-5, "phase": 0.0}, 5.3e-6),
    ("LostCounts", {"incoming": 1.0, "time": 2.0, "jump": -1e-5, "instant": 2.0}, 0.99999),
    ("LostCounts", {"incoming": 1.0, "time": 1.9, "jump": -1e-5, "instant": 2.0}, 1.0),
    ("Quantisation", {"incoming": 1.4e-6, "count": 1e-6}, 1e-6),
    (
        "TachometerRipple",
        {"incoming": 100.0, "displacement": 0.0, "brush": 0.0, "ripple": 0.02, "gain_error": 0.01, "order": 2.0, "phase": QUARTER},
        103.0,
    ),
    # 0.05 mm off centre at 1 mm depth: 5 %
    ("Runout", {"incoming": 400.0, "angle": 0.0, "depth": 1e-3, "eccentricity": 5e-5, "order": 1.0, "phase": 0.0}, 420.0),
    # 1 g at 10 mm and 100 rad/s: 0.1 N
    ("Unbalance", {"incoming": 0.0, "angle": 0.0, "spindle_speed": 100.0, "moment": 1e-5, "phase": 0.0}, 0.1),
    ("BeltSlip", {"incoming": 100.0, "effort": 20.0, "slip": 0.01, "creep": 5e-4}, 98.0),
    ("SpeedDroop", {"incoming": 100.0, "loss": 20.0, "droop": 0.1}, 98.0),
    ("SpindleGrowth", {"incoming": 0.0, "warmth": 1.0, "growth": 3e-5}, 3e-5),
    # 40 N/mm on 2 mm
    ("EdgeForce", {"incoming": 400.0, "depth": 2e-3, "feed": 2e-4, "coefficient": 4e4}, 480.0),
    # Kienzle: h = 0.1 mm, m = 0.25 gives kc = 1.778 kc1.1
    ("ChipThicknessExponent", {"incoming": 100.0, "feed": 1e-4, "exponent": 0.25, "reference": 1e-3}, 177.8279410038923),
    (
        "SpeedDependence",
        {"incoming": 100.0, "speed": 4.0, "exponent": -0.5, "reference": 1.0, "hump": 0.2, "hump_speed": 4.0, "hump_width": 0.3},
        60.0,
    ),
    ("BuiltUpEdge", {"incoming": 100.0, "speed": 0.7, "built": 0.5, "share": 0.2, "speed_of_band": 0.7, "width_of_band": 0.5}, 110.0),
    ("TemperatureSoftening", {"incoming": 100.0, "warmth": 0.5, "softening": 0.2}, 90.0),
    # VB = 0.2 mm, 2000 per m: 40 %
    (
        "WearForceGrowth",
        {"incoming": 100.0, "cutting_time": 2000.0, "growth": 2000.0, "rate": 1e-7, "break_in": 0.0, "break_in_time": 30.0},
        140.0,
    ),
    ("EntryBuildUp", {"incoming": 100.0, "built": 0.0, "lacking": 0.6}, 40.0),
    ("InterruptedCut", {"incoming": 100.0, "angle": 6.0 * math.pi, "missing": 1.0, "width": 0.2, "middle": 0.0}, 0.0),
    ("InterruptedCut", {"incoming": 100.0, "angle": 7.0 * math.pi, "missing": 1.0, "width": 0.2, "middle": 0.0}, 100.0),
    ("HardSpot", {"incoming": 100.0, "angle": 1.0, "rise": 0.3, "width": 0.05, "middle": 1.0}, 130.0),
    ("ChipSegmentation", {"incoming": 100.0, "slid": 0.0125, "share": 0.1, "length": 0.05, "phase": 0.0}, 110.0),
    ("RegenerativeChatter", {"incoming": 100.0, "angle": 1.0, "feed": 2e-4, "swing": 1e-5, "surface": [0.0] * 8, "engagement": 1.0}, 95.0),
    ("WorkpieceDeflection", {"incoming": 0.01, "bent": 2e-5, "compliance": 2e-7}, 0.01002),
    ("DynamometerDrift", {"incoming": 100.0, "leaked": 10.0, "time": 5.0, "leak": 0.1, "drift": 1.0, "offset": 2.0}, 97.0),
    ("DynamometerCrosstalk", {"incoming": 100.0, "other_force": 50.0, "share": 0.02}, 101.0),
]


def call(effect: Any, law: str, values: dict[str, float]) -> Any:
    """What a law gives; an effect of which no finer shape is given has its plain one."""
    given = {name: effect.declarations[name].default for name in effect.identification.extended} | values
    return effect.laws[law](*(given[name] for name in effect.arguments[law]))


@pytest.mark.parametrize(("name", "values", "expected"), NUMBERS)
def test_number(name: str, values: dict[str, float], expected: float) -> None:
    effect = stock_effects()[name]
    law = "output" if "output" in effect.laws else "output_outgoing"
    assert call(effect, law, values) == pytest.approx(expected, rel=1e-9, abs=1e-12)


def test_a_slew_limit_ramps_within_the_sample() -> None:
    """A step of 1 V at 100 V/s takes 10 ms: with 4 ms samples it is there in the third one."""
    effect = stock_effects()["SlewLimit"]
    states = dict.fromkeys(("reached", "wanted", "sampled"), 0.0)
    values = {"rate": 100.0, "sample_period": 0.004, "incoming": 0.0}
    states = dict(zip(states, call(effect, "update", values | states | {"time": 0.0}), strict=True))
    acting = []
    for sample in range(4):
        values["incoming"] = 1.0
        states = dict(zip(states, call(effect, "update", values | states | {"time": 0.004 * (sample + 1)}), strict=True))
        acting += [call(effect, "output", values | states | {"time": 0.004 * (sample + 1) + late}) for late in (0.0, 0.001)]
    assert acting == pytest.approx([0.0, 0.1, 0.4, 0.5, 0.8, 0.9, 1.0, 1.0])


def test_backlash_follows_behind_by_half_its_width() -> None:
    effect = stock_effects()["Backlash"]
    follower = 0.0
    path = [*(k * 1e-6 for k in range(51)), *(k * 1e-6 for k in range(50, -1, -1))]
    seen = []
    for x in path:
        values = {"incoming": x, "follower": follower, "leader": 0.0, "width": 2e-5, "start_in_gap": 0.0, "time": 1.0}
        follower, _ = call(effect, "update", values)
        seen.append(follower)
    assert (seen[40], seen[60], seen[-1]) == (pytest.approx(3e-5), pytest.approx(4e-5), pytest.approx(1e-5))


@pytest.mark.parametrize(
    ("softness", "left"),
    # of a gap of 20 um, from its middle, after 5 um of the way: u = 1 - s / half; (1 - s / (2 half))^2; exp(-s / half)
    [(0.0, 0.5), (1e-9, 0.5), (0.5, 0.75**2), (1.0, math.exp(-0.5))],
)
def test_a_soft_play_closes_gradually(softness: float, left: float) -> None:
    effect = stock_effects()["Backlash"]
    follower, leader = 0.0, 0.0
    for x in (0.0, 2e-6, 5e-6):
        values = {"incoming": x, "follower": follower, "leader": leader, "width": 2e-5, "softness": softness}
        shown = call(effect, "output", values)
        follower, leader = call(effect, "update", values | {"start_in_gap": 0.0, "time": 1.0})
        assert shown == follower
    assert 1.0 - (leader - follower) / 1e-5 == pytest.approx(left, rel=1e-6)


def test_workpiece_deflection_of_a_cantilever() -> None:
    """Steel, 20 mm by 100 mm, 100 N at the end: F L^3/(3 E I) = 20.2 um; an eighth of it half way."""
    second_moment = math.pi * 0.02**4 / 64.0
    compliance = 0.1**3 / (3.0 * 210e9 * second_moment)
    values = {"force": 100.0, "distance": 0.1, "compliance": compliance, "length": 0.1}
    effect = stock_effects()["WorkpieceDeflection"]
    assert call(effect, "update", values) == pytest.approx(20.2e-6, rel=0.01)
    assert call(effect, "update", values | {"distance": 0.05}) == pytest.approx(20.2e-6 / 8.0, rel=0.01)


def test_ranges_lie_within_the_bounds() -> None:
    for name, effect in stock_effects().items():
        for given in (effect.identification.typical, effect.identification.typical_rotary):
            for parameter, (low, high) in given.items():
                declared: Any = effect.declarations[parameter]
                assert declared.low <= low <= high <= declared.high, f"{name}.{parameter}"
        assert set(effect.neutral) <= set(effect.identification.typical) | {"share"} or name in ("RegenerativeChatter",), name
