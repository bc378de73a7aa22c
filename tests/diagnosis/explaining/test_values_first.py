"""Values of the lesson that are far off compete with effects, and win where they predict as well."""

from dataclasses import replace

import pytest

from lathesim.diagnosis.records.found import Found
from lathesim.effects.friction import AsymmetricFriction, CoulombFriction
from lathesim.effects.offset_and_gain import ForceOffset, ScaleFactorError
from lathesim.identification.records import Model
from lathesim.lessons.insertion import insert_effect
from tests.diagnosis.pushed_table import Hidden, baselines, experiments, machine, recording, searched


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


def test_a_force_of_the_lesson_may_have_the_other_sign() -> None:
    """A weight of -3 N, declared to 0.6 N, is one of 7 N: a friction that differs by direction is none of it."""
    plain = machine()
    declared = {**plain.uncertain, "weight.offset": 0.6}
    hung = insert_effect(plain.assembly, ForceOffset, "x_axis", name="weight", parameters={"offset": -3.0})
    records = [recording(Hidden(law=lambda v, q, t: 7.0), seed=seed) for seed in (1, 2)]
    found = searched(*experiments(*records, effects=(AsymmetricFriction,), of=replace(plain, assembly=hung, uncertain=declared)))
    assert found.model.candidates == ()
    assert found.model.fitted.by_name["weight.offset"] == pytest.approx(7.0, rel=0.02)


def test_how_a_recording_begins_is_no_value_of_the_lesson() -> None:
    """A speed that the first rows show to be another one is not further off than the lesson declares possible."""
    fitted, validation = baselines(Hidden())
    begun = [one if one.is_declared else replace(one, given=1.0, uncertainty=1e-3) for one in fitted.free]
    assert any(not one.is_declared for one in begun)
    model = Model((), replace(fitted, free=tuple(begun)), validation)
    assert Found(model, model, values=model).jointly_off == ()
