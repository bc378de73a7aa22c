"""Dry friction beside a weight: a friction that differs by direction does the same, with one value more."""

import pytest

from lathesim.effects.friction import AsymmetricFriction, CoulombFriction
from lathesim.effects.offset_and_gain import ForceOffset
from tests.diagnosis.pushed_table import Hidden, experiments, recording, searched


@pytest.mark.parametrize("weight", [4.0, 20.0])
def test_friction_and_weight_keep_both_names(weight: float) -> None:
    hidden = Hidden(dry=12.0, law=lambda v, q, t: weight)
    found = searched(*experiments(recording(hidden), recording(hidden, seed=2), effects=(AsymmetricFriction, CoulombFriction, ForceOffset)))
    assert {candidate.name for candidate in found.model.candidates} == {"CoulombFriction", "ForceOffset"}
