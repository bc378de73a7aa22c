"""Diagnoses as the pipeline might give them, made up, for looking at the report: one for each verdict."""

import math
from dataclasses import fields, replace
from typing import Any

import numpy as np

from lathesim.diagnosis.records.comparison import Explanation
from lathesim.diagnosis.records.diagnosis import (
    VERDICTS,
    AnsweredQuestion,
    BaselineValue,
    ChannelFit,
    ChannelTrace,
    Diagnosis,
    Evidence,
    FoundEffect,
    Interval,
    Location,
    MissingSignal,
    Unnamed,
    Verdict,
)

WIRES = (
    ("x_encoder", "x_controller"), ("x_controller", "x_dac"), ("x_dac", "x_drive"), ("x_axis", "x_drive"), ("x_drive", "x_axis"),
    ("x_axis", "x_encoder"), ("x_axis", "x_scale"), ("try_x_axis_coulomb_friction", "x_axis"),
)  # fmt: skip


def _evidence() -> Evidence:
    rng = np.random.default_rng(4)
    time = np.arange(8000) * 2e-3
    speed = 0.1 * np.sin(2.0 * np.pi * time / 4.0) * np.where(time < 8.0, 1.0, 0.4)
    travel = np.cumsum(speed) * 2e-3
    friction = 20.4 * np.tanh(speed / 1e-4)
    total = 95.0 * np.gradient(speed, time) + 203.0 * speed + friction
    noise = rng.standard_normal((3, len(time)))
    lag = 2e-6 * np.convolve(friction, np.ones(40) / 40.0, mode="same")
    position = ChannelTrace("x_encoder.position", "m", time, travel, travel - lag, travel - 4e-7 * noise[0])
    voltage = total / 35.15
    command = ChannelTrace("x_controller.voltage", "V", time, voltage, voltage - friction / 35.15, voltage + 0.01 * noise[1])
    missing = MissingSignal("x_axis.disturbance", "N", time, friction + noise[2], noise[2], total, 0.171, 0.043)
    runners_up = (("CoulombFriction at x_axis", "AsymmetricFriction at x_axis", 0.3),)
    return Evidence((missing,), (position, command), WIRES, (), runners_up)


FIT = {
    "x_encoder.position": ChannelFit("m", 2.1e-7, 2.7e-5, 4.4e-7, "validate.csv"),
    "x_controller.voltage": ChannelFit("V", 4e-3, 0.58, 0.0104, "validate.csv"),
}
BASELINE = {
    "x_axis.mass": BaselineValue("kg", 95.1, 97.9, 95.32, 94.95, 95.7),
    "x_axis.viscous": BaselineValue("N*s/m", 203.5, 410.2, 203.1, 198.8, 207.3),
    "x_drive.effort_constant": BaselineValue("N/A", 35.15, 35.21, 35.12, 34.2, 36.1),
}
COULOMB = FoundEffect(
    "CoulombFriction",
    "x_axis",
    "reversal",
    0.974,
    {"level": Interval(20.41, "N", 20.22, 20.6)},
    (),
    None,
    0.97,
    "Friction of constant size against the motion; at rest it balances any smaller force.",
)


def varied(diagnosis: Diagnosis, **changes: Any) -> Diagnosis:
    """Return a diagnosis with other values, of its own or of its parts."""
    parts = {name: getattr(diagnosis, name) for name in ("question", "rest", "lines", "search")}
    own = {name: {item.name: changes.pop(item.name) for item in fields(part) if item.name in changes} for name, part in parts.items()}
    return replace(diagnosis, **changes, **{name: replace(part, **own[name]) for name, part in parts.items()})


def made(verdict: Verdict, sentence: str, lesson: str, recording: str, validation: str = "", **more: Any) -> Diagnosis:
    """Return a diagnosis of some recordings."""
    return varied(Diagnosis(verdict, sentence, AnsweredQuestion(lesson, recording, validation)), **more)


def _tried(name: str, at: str, gain: float, reason: str, *, kept: bool = False) -> Explanation:
    return Explanation(name, at, "effect", gain, 0.1 * abs(gain), 12.4, kept, reason)


EXPLANATIONS = (
    Explanation("the lesson, its uncertain values refitted", "", "lesson", 0.0, 0.0, 0.0, False, "the others compete with it"),
    _tried("CoulombFriction", "x_axis", 7871.2, "predicts best", kept=True),
    _tried("PreslidingFriction", "x_axis", 7862.7, "refines CoulombFriction and explains little more"),
    _tried("AsymmetricFriction", "x_axis", 7870.9, "refines CoulombFriction and explains little more"),
    _tried("Backlash", "x_scale", 11.0, "gains no more than chance could"),
    _tried("TorqueRipple", "x_axis", 12.4, "gains no more than chance could"),
    _tried("TransportDelay", "x_drive", -31.0, "predicts worse than without it"),
    _tried("ForceOffset", "x_axis", math.nan, "gains too little, by a linear estimate, to be fitted"),
)
NOTHING_KEPT = (replace(EXPLANATIONS[0], kept=True), *EXPLANATIONS[4:])
SMOOTH = Explanation(
    "depends on position and direction of x_axis", "x_controller.voltage", "flexible", 2220.0, 210.0, 630.0, True, "predicts what is left",
)  # fmt: skip
LOCATION = Location(
    ("x_axis", "x_drive"),
    ("x_controller.voltage", "x_encoder.position"),
    ((1.99, 2.06), (3.98, 4.09), (6.0, 6.05), (7.99, 8.07), (10.0, 10.06)),
    ("sign of velocity of x_axis", "velocity of x_axis"),
)

NAMED = made(
    "named",
    VERDICTS["named"],
    "EMPS axis with mass and viscous friction only",
    "recording.csv",
    "validate.csv",
    effects=(COULOMB,),
    location=LOCATION,
    fit=FIT,
    removed_share=0.983,
    adequate=True,
    baseline=BASELINE,
    insert=({"effect": "CoulombFriction", "at": "x_axis", "level": "20.41 N"},),
    left=("At x_axis 4.3 % of the force is still missing; it repeats with the position (period 11.9 mm).",),
    not_told=(
        "x_drive.effort_constant is not determined: mass, friction and gain scale together. A current sensor, or a known mass "
        "on the table, would tell.",
    ),
    findings=("x_encoder.position moves in steps of 50 nm.", "3 samples of 8000 were missing and were joined by lines."),
    wall_time=13.2,
    evidence=_evidence(),
    explanations=EXPLANATIONS,
)

TIED = varied(
    NAMED,
    verdict="tied",
    sentence=VERDICTS["tied"],
    effects=(
        FoundEffect(
            "ForceOffset", "x_axis", "constants", 0.52, {"force": Interval(11.0, "N", 10.4, 11.6)}, ("ConverterOffset at x_drive",),
            "Record the current as well, or switch the power off: an offset of the converter vanishes, gravity does not.",
            0.91,
        ),
    ),
    insert=({"effect": "ForceOffset", "at": "x_axis", "force": "11.0 N"},),
)  # fmt: skip

UNKNOWN = varied(
    NAMED,
    verdict="unknown",
    sentence=VERDICTS["unknown"],
    effects=(),
    explanations=(*NOTHING_KEPT, SMOOTH),
    adequate=False,
    removed_share=0.61,
    discovered="F = 3.1 N (x / 10 mm)^2 sgn(v),   0 < x < 120 mm, abs(v) < 0.1 m/s   (empirical, unverified)",
    insert=({"effect": "DiscoveredTerm", "at": "x_axis"},),
    unnamed=(Unnamed("x_axis.disturbance", 3.1, "N", ("depends on position and direction of x_axis",)),),
    left=("x_axis stands still in 15% of the samples.",),
)

FAULT = varied(
    NAMED,
    verdict="recording_fault",
    sentence="The column of x_encoder.position is 25.4 times too small: it looks like inches where the lesson says millimetres.",
    effects=(),
    location=Location((), ("x_encoder.position",), (), ()),
    insert=(),
    baseline={},
    left=(),
    not_told=("No physics is named from this recording. Mend the unit in the lesson, and diagnose again.",),
    evidence=Evidence((), _evidence().traces[:1], WIRES),
    explanations=(Explanation("unit", "x_encoder.position", "fault", math.nan, math.nan, math.nan, True, "25.4 times too small"),),
)

CLEAN = varied(
    NAMED,
    verdict="no_mismatch",
    sentence=VERDICTS["no_mismatch"],
    effects=(),
    explanations=NOTHING_KEPT,
    location=Location(),
    fit={name: replace(item, before=1.1 * item.floor, after=1.1 * item.floor) for name, item in FIT.items()},
    baseline={name: replace(item, refit_without=item.refit_with) for name, item in BASELINE.items()},
    insert=(),
    left=(),
    evidence=Evidence((), tuple(replace(item, before=item.after) for item in _evidence().traces), WIRES),
)

PARAMETERS = varied(
    CLEAN,
    verdict="parameters_only",
    sentence=VERDICTS["parameters_only"],
    removed_share=0.99,
    fit=FIT,
    baseline=BASELINE,
    evidence=_evidence(),
)

STOPPED = made(
    "unknown",
    "Stopped after locating: the mismatch sits in x_axis.",
    "EMPS axis",
    "recording.csv",
    "laps 5 to 8 of recording.csv",
    location=LOCATION,
    complete=False,
    wall_time=4.0,
    evidence=Evidence(wires=WIRES),
)

ALL = {
    "named": NAMED, "tied": TIED, "unknown": UNKNOWN, "recording_fault": FAULT, "no_mismatch": CLEAN, "parameters_only": PARAMETERS,
    "stopped": STOPPED,
}  # fmt: skip
