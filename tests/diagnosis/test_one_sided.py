"""A friction that differs between two directions is nothing but a friction where a machine moves in one of them."""

import numpy as np
import pytest

from lathesim.diagnosis.candidates.eligibility import without_one_sided
from lathesim.diagnosis.diagnose import diagnose
from lathesim.diagnosis.location.direction import one_way
from lathesim.diagnosis.question import Question
from lathesim.diagnosis.verdict.ranking import is_told_by_direction
from lathesim.effects.drive_errors import Cogging
from lathesim.effects.friction import AsymmetricFriction, CoulombFriction, PositionDependentFriction
from lathesim.effects.offset_and_gain import ForceOffset
from lathesim.identification.replay.loading import Recorded
from lathesim.record import Record
from tests.diagnosis.pushed_table import FORCE, POSITION, RESOLUTION, Hidden, as_record, experiments, force, machine, recording, travel

EFFECTS = (CoulombFriction, AsymmetricFriction, ForceOffset)


def forward(dry: float, seed: int, pull: float = 80.0) -> Record:
    """Return a recording of a table that is pulled forward all the time, with more force and with less."""
    pushed = pull + 0.5 * force(2000, seed)
    place = travel(pushed, Hidden(dry=dry)) + 0.3e-6 * np.random.default_rng(seed).standard_normal(2000)
    return as_record({FORCE: ("N", pushed), POSITION: ("m", np.round(place / RESOLUTION) * RESOLUTION)})


def test_it_is_no_candidate_where_no_recording_moves_its_host_both_ways() -> None:
    ahead = experiments(forward(8.0, 1), forward(8.0, 2), effects=EFFECTS)
    assert all(one_way(experiment, "x_axis") for experiment in ahead)
    (experiment, _) = without_one_sided(ahead)
    assert {candidate.name for candidate in experiment.candidates} == {"CoulombFriction", "ForceOffset"}
    assert [candidate.name for candidate in experiment.one_sided] == ["AsymmetricFriction"]


def test_a_ripple_is_tied_with_a_friction_that_varies_along_the_way() -> None:
    """In one direction the one is the other; a wave of friction that no friction is under would be the stranger of the two."""
    ahead = experiments(forward(8.0, 1), forward(8.0, 2), effects=(CoulombFriction, PositionDependentFriction, Cogging, ForceOffset))
    (experiment, _) = without_one_sided(ahead)
    (varying,) = experiment.one_sided
    told = {candidate.name: is_told_by_direction(candidate, varying) for candidate in experiment.candidates}
    assert (varying.name, told) == ("PositionDependentFriction", {"CoulombFriction": False, "Cogging": True, "ForceOffset": False})


def test_one_recording_both_ways_is_enough_to_look_for_it() -> None:
    pair = experiments(forward(8.0, 1), recording(Hidden(dry=8.0), seed=2), effects=EFFECTS)
    assert [one_way(experiment, "x_axis") for experiment in pair] == [True, False]
    assert [experiment.one_sided for experiment in without_one_sided(pair)] == [(), ()]


def test_the_plain_friction_is_tied_with_it_and_the_experiment_is_named() -> None:
    first, second = (Recorded(f"{seed}.csv", forward(8.0, seed), ()) for seed in (1, 2))
    found = diagnose(Question("A table", machine(sure=0.02), first, second, EFFECTS))
    (friction,) = [effect for effect in found.effects if effect.effect == "CoulombFriction"]
    assert found.verdict == "tied"
    assert "AsymmetricFriction" in friction.tied_with
    assert friction.parameters["level"].value == pytest.approx(8.0, rel=0.2)
    assert "both directions" in (friction.separating_experiment or "")
