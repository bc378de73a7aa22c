"""From trials to what is said: how sure a name is, what it is tied with, and whether what is left has a pattern."""

import dataclasses
import functools

import numpy as np
import pytest

from lathesim.diagnosis.method import Method
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection.search import search
from lathesim.diagnosis.verdict.ranking import RankedEffect, explains_nothing, rank_effects, removed_in_band, rivals_of
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.records.model import Trial
from lathesim.identification.replay.experiment import baseline_free
from tests.diagnosis.pushed_table import Hidden, pair

SETTINGS = Method()


@functools.cache
def searched() -> SearchResult:
    return search(*pair(Hidden(dry=8.0)))


def trials() -> dict[str, Trial]:
    """One trial an effect, with made-up gains."""
    found = searched()
    candidates = {candidate.name: candidate for candidate in pair(Hidden(dry=8.0))[0].candidates}
    one = found.trials["try_x_axis_coulomb_friction"][0]
    return {name: gaining(dataclasses.replace(one, candidate=candidate), 500.0) for name, candidate in candidates.items()}


def gaining(trial: Trial, nats: float) -> Trial:
    """Return the trial with other gains on both recordings, in the band of the motion and beyond."""
    names = [field.name for field in dataclasses.fields(trial) if field.name.endswith("gain")]
    return dataclasses.replace(trial, **dict.fromkeys(names, nats))  # type: ignore[arg-type]


def standing_of(*beside: Trial) -> RankedEffect:
    found = dataclasses.replace(searched(), trials={"try_x_axis_coulomb_friction": [trials()["CoulombFriction"], *beside]})
    (item,) = rank_effects(found, SETTINGS)
    return item


def test_a_name_without_a_rival_is_sure() -> None:
    item = standing_of()
    assert (item.candidate.name, item.probability, item.tied) == ("CoulombFriction", 1.0, ())
    assert item.share > 0.5


def test_a_rival_that_gains_as_much_is_a_tie() -> None:
    item = standing_of(trials()["ForceOffset"])
    assert [candidate.name for candidate in item.tied] == ["ForceOffset"]
    assert item.probability == pytest.approx(0.5, abs=0.01)


def test_a_rival_that_gains_much_less_is_none() -> None:
    item = standing_of(gaining(trials()["ForceOffset"], 300.0))
    assert item.tied == ()
    assert item.probability > 0.99


def test_a_rival_that_removes_less_of_the_error_is_none() -> None:
    less = trials()["ForceOffset"]
    item = standing_of(dataclasses.replace(less, share_of_all=less.share_of_all - 0.2))
    assert item.tied == ()


def test_a_rival_that_is_in_the_model_too_is_no_tie() -> None:
    other = trials()["ForceOffset"]
    model = dataclasses.replace(searched().model, candidates=(*searched().model.candidates, other.candidate))
    beside = {"try_x_axis_coulomb_friction": [trials()["CoulombFriction"], other]}
    found = dataclasses.replace(searched(), model=model, trials=beside)
    assert all(item.tied == () for item in rank_effects(found, SETTINGS))


def test_a_rival_that_is_in_the_model_with_fewer_of_its_values_is_no_tie() -> None:
    other = trials()["ForceOffset"]
    doubled = dataclasses.replace(other.candidate, points=np.vstack([other.candidate.points] * 2))
    model = dataclasses.replace(searched().model, candidates=(*searched().model.candidates, dataclasses.replace(doubled)))
    beside = {"try_x_axis_coulomb_friction": [trials()["CoulombFriction"], dataclasses.replace(other, candidate=doubled)]}
    found = dataclasses.replace(searched(), model=model, trials=beside)
    assert all(item.tied == () for item in rank_effects(found, SETTINGS))
    assert list(rivals_of(found.model.candidates[0], found, SETTINGS)) == []


def test_what_removes_most_comes_first() -> None:
    small = dataclasses.replace(trials()["ForceOffset"], share_of_all=0.1)
    model = dataclasses.replace(searched().model, candidates=(small.candidate, *searched().model.candidates))
    beside = {small.candidate.part: [small], "try_x_axis_coulomb_friction": [trials()["CoulombFriction"]]}
    found = dataclasses.replace(searched(), model=model, trials=beside)
    assert [item.candidate.name for item in rank_effects(found, SETTINGS)] == ["CoulombFriction", "ForceOffset"]


def test_the_share_of_the_error_that_is_gone() -> None:
    assert removed_in_band(searched()) > 0.8
    untouched = dataclasses.replace(searched(), model=searched().baseline)
    assert removed_in_band(untouched) == 0.0


def test_effects_that_take_nothing_of_next_to_nothing_are_none() -> None:
    """Where much is left that they take nothing of, something else is missing."""
    _, sound = pair(Hidden())
    baseline = fit(sound.sensed, [*baseline_free(sound.machine), *sound.start_states(sound.sensed.plan)])
    assert explains_nothing(sound, baseline, baseline)
    _, rubbing = pair(Hidden(dry=8.0))
    found = searched()
    assert not explains_nothing(rubbing, found.baseline.validation_fit, found.model.validation_fit)
    assert not explains_nothing(rubbing, found.baseline.validation_fit, found.baseline.validation_fit)
