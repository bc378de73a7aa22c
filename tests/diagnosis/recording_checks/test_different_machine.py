"""Two recordings are of different machines only by a value that the second one tells."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from lathesim.components.spindles import TorqueSpindle
from lathesim.diagnosis.recording_checks import different_machine
from lathesim.diagnosis.recording_checks.different_machine import another_machine
from lathesim.engine.assembly import Assembly, Part, Wire
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.records import Fitted, Model
from lathesim.identification.replay.experiment import Experiment, RecordedMachine, baseline_free, build_experiments
from lathesim.record import Channel, Record

PERIOD, FINE, COUNT = 10e-3, 5, 400
INERTIA, VISCOUS, WEIGHT, LOWEST = 0.02, 0.05, 0.3, 0.4
TORQUE, ANGLE = "spindle.torque", "spindle.angle"


def swung(seed: int, inertia: float = INERTIA) -> Record:
    """Return an arm that a torque swings, worked out in small steps."""
    rng = np.random.default_rng(seed)
    time = PERIOD * np.arange(COUNT)
    torque = 0.25 * np.sin(2.0 * np.pi * (0.4 + 0.2 * time) * time + seed) + 0.1 * np.sin(9.0 * time)
    angle, speed, angles = LOWEST, 0.0, []
    for pushed in torque:
        angles.append(angle)
        for _ in range(FINE):
            speed += PERIOD / FINE * (pushed - VISCOUS * speed - WEIGHT * math.sin(angle - LOWEST)) / inertia
            angle += PERIOD / FINE * speed
    noisy = np.array(angles) + 1e-3 * rng.standard_normal(COUNT)
    return Record(time, {TORQUE: Channel(TORQUE, "N*m", torque), ANGLE: Channel(ANGLE, "rad", noisy)}, {"sample_period": PERIOD})


@pytest.fixture(scope="module")
def arm() -> RecordedMachine:
    """An arm with a weight, as a lesson has it."""
    values = {"inertia": INERTIA, "viscous": VISCOUS, "gravity": WEIGHT, "lowest": LOWEST}
    assembly = Assembly((Part("spindle", TorqueSpindle, values),), (Wire(TORQUE, constant=0.0),), PERIOD, 0.2 * PERIOD)
    return RecordedMachine(assembly, (TORQUE,), (ANGLE,), {"spindle.lowest": 0.03, "spindle.inertia": 0.1 * INERTIA}, {})


def asked(machine: RecordedMachine, second: Record) -> str:
    """Return what the check says of an arm and a second recording."""
    first, other = build_experiments(machine, [("first.csv", swung(1)), ("second.csv", second)], ())
    fitted = fit(first.sensed, [*first.start_states(first.sensed.plan), *baseline_free(machine)], rounds=2)
    starts = other.start_states(other.sensed.plan)
    constant = {name: value for name, value in fitted.by_name.items() if name not in {item.name for item in starts}}
    return another_machine(Model((), fitted, fit(other.sensed, starts, constant, rounds=2)), first, other)


def test_another_inertia_is_another_machine(arm: RecordedMachine) -> None:
    said = asked(arm, swung(2, inertia=1.6 * INERTIA))
    assert re.fullmatch(
        r"second\.csv is of another machine: spindle\.inertia is 0\.03\d+ kg\*m\^2 there and 0\.0\d+ kg\*m\^2 in the fitted one\.", said
    )


def test_an_angle_a_turn_on_is_the_same_angle(arm: RecordedMachine, monkeypatch: pytest.MonkeyPatch) -> None:
    """A fit of its own may end some turns on, and other values that the lesson holds possible explain the rest."""
    assert asked(replace(arm, uncertain={"spindle.lowest": 0.03}), swung(2)) == ""
    own = different_machine._by_itself

    def a_turn_on(model: Model, experiment: Experiment, kept: Mapping[str, float] | None = None) -> Fitted:
        found = own(model, experiment, kept)
        turned = 0.0 if kept or experiment.name == "first.csv" else -4.0 * math.pi
        return replace(found, values=found.values + turned * (np.array(found.names) == "spindle.lowest"))

    monkeypatch.setattr(different_machine, "_by_itself", a_turn_on)
    unsure = replace(arm, uncertain={"spindle.lowest": 0.03, "spindle.inertia": INERTIA})
    assert asked(unsure, swung(2, inertia=1.6 * INERTIA)) == ""
