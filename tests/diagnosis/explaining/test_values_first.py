"""Values of the lesson that are far off compete with effects, and win where they predict as well."""

import pytest

from lathesim.effects.friction import CoulombFriction
from lathesim.effects.offset_and_gain import ScaleFactorError
from tests.diagnosis.pushed_table import Hidden, experiments, recording, searched


@pytest.mark.parametrize(
    "hidden", [Hidden(mass=30.0, viscous=260.0), Hidden(mass=52.0, viscous=90.0)], ids=["an effect is clear", "none is"]
)
def test_values_far_off_are_found_and_no_effect_beside_them(hidden: Hidden) -> None:
    first, second = experiments(recording(hidden, seed=1), recording(hidden, seed=2), effects=(CoulombFriction, ScaleFactorError))
    found = searched(first, second)
    assert found.values is not None
    assert found.model.candidates == ()
    assert found.model.fitted.by_name["x_axis.mass"] == pytest.approx(hidden.mass, rel=0.02)
    assert found.model.fitted.by_name["x_axis.viscous"] == pytest.approx(hidden.viscous, rel=0.02)
