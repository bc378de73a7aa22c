"""Values of the lesson that are off by far are an answer of their own, asked before any effect; beside a friction they are not."""

from __future__ import annotations

import pytest

from lathesim.diagnosis.selection.search import search
from tests.diagnosis.pushed_table import EFFECTS, MASS, VISCOUS, Hidden, experiments, machine, recording


def test_two_values_that_are_off_by_far_are_told_together() -> None:
    hidden = Hidden(mass=1.4 * MASS, viscous=0.5 * VISCOUS)
    found = search(*experiments(recording(hidden, seed=1), recording(hidden, seed=2), effects=EFFECTS, of=machine(sure=0.05)))
    assert found.model.candidates == ()
    assert set(found.jointly_off) == {"x_axis.mass", "x_axis.viscous"}
    values = found.model.fitted.by_name
    assert values["x_axis.mass"] == pytest.approx(1.4 * MASS, rel=0.03)
    assert values["x_axis.viscous"] == pytest.approx(0.5 * VISCOUS, rel=0.1)
    assert found.complete


def test_a_friction_that_a_viscosity_makes_up_for_is_no_value_far_off() -> None:
    hidden = Hidden(dry=15.0)
    found = search(*experiments(recording(hidden, seed=1), recording(hidden, seed=2), effects=EFFECTS, of=machine(sure=0.05)))
    assert found.jointly_off == ()
    assert [candidate.name for candidate in found.model.candidates] == ["CoulombFriction"]
