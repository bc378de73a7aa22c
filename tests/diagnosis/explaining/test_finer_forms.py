"""A finer form takes the place of a simpler one where it predicts better, and stays there."""

from __future__ import annotations

from lathesim.diagnosis.candidates.eligibility import finer
from lathesim.diagnosis.explaining.rounds import with_simpler_forms
from lathesim.diagnosis.explaining.search import explain
from lathesim.diagnosis.explaining.trial import modelled
from lathesim.diagnosis.records.found import Found, Screened
from lathesim.effects.effect import Effect
from lathesim.effects.friction import AsymmetricFriction, CoulombFriction, PreslidingFriction
from lathesim.effects.offset_and_gain import ForceOffset
from lathesim.identification.estimation.least_squares import fit
from tests.diagnosis.pushed_table import Hidden, baseline, experiments, recording, study


def searched(hidden: Hidden, *more: type[Effect]) -> Found:
    """Return the search for what explains a table best, where dry friction, its finer form and ``more`` effects may."""
    both = (recording(hidden, seed=seed) for seed in (1, 2))
    return explain(study(*experiments(*both, effects=(CoulombFriction, AsymmetricFriction, *more))))


def named(found: Found) -> list[str]:
    return [candidate.name for candidate in found.model.candidates]


def test_a_friction_that_differs_between_the_directions_keeps_its_name() -> None:
    assert named(searched(Hidden(dry=10.0, law=lambda v, q, t: 2.0 + 10.0 * abs(v)))) == ["AsymmetricFriction"]


def test_a_friction_alike_in_both_directions_is_the_simpler_one() -> None:
    assert named(searched(Hidden(dry=10.0))) == ["CoulombFriction"]


def test_a_finer_form_comes_before_a_further_effect_that_predicts_less() -> None:
    found = searched(Hidden(dry=10.0, law=lambda v, q, t: 2.0 + 10.0 * abs(v)), ForceOffset)
    assert [step.came_in for step in found.history] == [("CoulombFriction at x_axis",), ("AsymmetricFriction at x_axis",), ()]
    assert [step.move for step in found.history] == ["add", "refine", "refit"]


def test_a_weight_beside_dry_friction_stays_a_weight() -> None:
    assert named(searched(Hidden(dry=10.0, law=lambda v, q, t: 2.0), ForceOffset)) == ["CoulombFriction", "ForceOffset"]


def test_the_simpler_forms_are_fitted_with_a_finer_one_in_any_batch_of_a_round() -> None:
    """A robot axis had its dry friction named as a finer one whose size may be zero, as the plain one came in no batch."""
    candidates = experiments(recording(), effects=(CoulombFriction, AsymmetricFriction, ForceOffset))[0].candidates
    screened = {one.name: Screened(one, 1.0, ()) for one in candidates}
    ranked = offset, asymmetric, coulomb = [screened[name] for name in ("ForceOffset", "AsymmetricFriction", "CoulombFriction")]
    assert with_simpler_forms([asymmetric], ranked) == [asymmetric, coulomb]
    assert with_simpler_forms([asymmetric, coulomb], ranked) == [asymmetric, coulomb]
    assert with_simpler_forms([offset], ranked) == [offset]


def test_two_finer_forms_of_one_friction_do_not_stand_side_by_side() -> None:
    both = experiments(*(recording(seed=seed) for seed in (1, 2)), effects=(AsymmetricFriction, PreslidingFriction))
    asked, own = study(*both), both[0].candidates
    fitted = fit(both[0].sensed, baseline(both[0]), rounds=1)
    assert {one.name for one in finer(modelled(asked, (), fitted), both[0])} == {"AsymmetricFriction", "PreslidingFriction"}
    assert [finer(modelled(asked, (one,), fitted), both[0]) for one in own] == [[], []]
