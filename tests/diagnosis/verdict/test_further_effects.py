"""What is possible beside a model: an effect that explains much of what is left, and too little of all to be named."""

import dataclasses

import pytest

from lathesim.diagnosis.method import STANDARD
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection.laboratory import Laboratory
from lathesim.diagnosis.selection.moves.split import form_starts
from lathesim.diagnosis.verdict.further_effects import further_effects
from lathesim.effects.friction import AsymmetricFriction, CoulombFriction, StribeckFriction
from lathesim.effects.offset_and_gain import ForceOffset
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.records.model import Model, Trial
from tests.diagnosis.pushed_table import Hidden, baseline, experiments, recording

SLOPE = 6.0
"""Viscous friction forward less mean [N*s/m], of a table on which 8 N of dry friction act."""


@pytest.fixture(scope="module")
def asymmetric() -> tuple[Laboratory, SearchResult, Trial]:
    """Return a table that rubs more in one direction, a model that knows the dry friction, and the trial of the uneven one in its place."""
    hidden = Hidden(dry=8.0, law=lambda v, q, t: SLOPE * abs(v))
    effects = (CoulombFriction, AsymmetricFriction, ForceOffset, StribeckFriction)
    first, second = experiments(*(recording(hidden, seed=seed) for seed in (1, 2)), effects=effects)
    laboratory = Laboratory(first, second, lambda text: None)
    fitted = fit(first.sensed, baseline(first), rounds=3)
    laboratory.weigh(fitted)
    before = laboratory.model((), fitted)
    friction, uneven = (_of(laboratory, name) for name in ("CoulombFriction", "AsymmetricFriction"))
    model = laboratory.settled(laboratory.trial(before, friction, (), before.free, list(friction.points[:2])).model)
    kept = [item for item in model.free if item.name not in friction.parameters]
    trial = laboratory.trial(model, uneven, (), kept, form_starts(friction, uneven, model))
    return laboratory, SearchResult(before, model, tried=[trial]), trial


def _of(laboratory: Laboratory, name: str) -> Candidate:
    return next(candidate for candidate in laboratory.experiment.candidates if candidate.name == name)


def _beside(laboratory: Laboratory, model: Model, name: str) -> Trial:
    candidate = _of(laboratory, name)
    return laboratory.trial(model, candidate, model.candidates, model.free, list(candidate.points[:2]))


def test_a_finer_form_is_possible_in_the_place_of_what_it_refines(asymmetric: tuple[Laboratory, SearchResult, Trial]) -> None:
    laboratory, found, trial = asymmetric
    assert trial.share_of_all < STANDARD.share_of_all  # too little of all to be named
    (one,) = further_effects(laboratory, found, STANDARD)
    assert (one.trial.candidate.name, [candidate.name for candidate in one.replaces]) == ("AsymmetricFriction", ["CoulombFriction"])
    assert one.trial.model.fitted.by_name[f"{trial.candidate.part}.viscous_difference"] == pytest.approx(SLOPE, rel=0.1)
    assert one.probability == 1.0


def test_what_explains_as_much_shares_the_probability(asymmetric: tuple[Laboratory, SearchResult, Trial]) -> None:
    laboratory, found, trial = asymmetric
    elsewhere = dataclasses.replace(trial.candidate, at="another place")
    other = dataclasses.replace(trial, candidate=elsewhere, model=dataclasses.replace(trial.model, candidates=(elsewhere,)))
    both = further_effects(laboratory, found.having_tried([other]), STANDARD)
    assert [one.probability for one in both] == pytest.approx([0.5, 0.5])


@pytest.mark.parametrize(
    "change",
    [{"gain": 5.0}, {"validation_gain": -1.0}, {"share_of_rest": 0.1}, {"becomes_implausible": True}, {"closed_loop_degradation": 2.0}],
    ids=["gains too little", "not on the other recording", "little of what is left", "an impossible machine", "a worse closed loop"],
)
def test_what_would_not_be_believed_whatever_its_size_is_not_possible(
    change: dict[str, float], asymmetric: tuple[Laboratory, SearchResult, Trial]
) -> None:
    laboratory, found, trial = asymmetric
    assert further_effects(laboratory, dataclasses.replace(found, tried=[dataclasses.replace(trial, **change)]), STANDARD) == ()  # type: ignore[arg-type]


def test_trials_on_another_model_are_not_asked(asymmetric: tuple[Laboratory, SearchResult, Trial]) -> None:
    laboratory, found, _ = asymmetric
    beside = _beside(laboratory, found.model, "ForceOffset")
    on_baseline = dataclasses.replace(found, model=found.baseline, tried=[beside])
    assert further_effects(laboratory, on_baseline, STANDARD) == ()
