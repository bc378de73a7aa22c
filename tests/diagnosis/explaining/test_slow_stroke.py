"""A slow stroke of two seconds: its motion has few frequencies, and the friction shows where the table stops and starts."""

from __future__ import annotations

import numpy as np
import pytest

from lathesim.diagnosis.method import STANDARD
from lathesim.effects.drive_errors import Cogging, TorqueRipple
from lathesim.effects.friction import CoulombFriction
from tests.diagnosis.pushed_table import FORCE, PERIOD, POSITION, Hidden, as_record, experiments, machine, searched, travel


def law(speed: float, place: float, time: float) -> float:
    """Return a force that is larger near standstill [N], as of a lubricated guideway, which no effect of this test has."""
    return float(8.0 * np.exp(-((speed / 0.05) ** 2)) * np.tanh(speed / 1e-4))


@pytest.mark.parametrize("push", [65.0, 85.0])
def test_the_dry_friction_of_a_slow_stroke_is_found(push: float) -> None:
    time = np.arange(1000) * PERIOD
    force = np.interp(time, [0.0, 0.05, 0.5, 0.8, 1.0, 1.15, 1.4, 1.7, 2.0], [0.0, 14.0, push, 6.0, 5.4, -14.0, -push, -6.0, -5.4])
    place = np.round(travel(force, Hidden(dry=11.5, law=law, mass=46.0, viscous=170.0)), 6)
    halves = [as_record({FORCE: ("N", force[half]), POSITION: ("m", place[half])}) for half in (slice(500), slice(500, None))]
    found = searched(*experiments(*halves, effects=(CoulombFriction, TorqueRipple, Cogging), of=machine(sure=0.3)))
    (candidate,) = found.model.candidates
    assert candidate.name == "CoulombFriction"
    assert 11.5 < found.model.fitted.by_name[f"{candidate.part}.level"] < 11.5 + 8.0
    assert found.worth[candidate.part].predicted.nats > STANDARD.margin
