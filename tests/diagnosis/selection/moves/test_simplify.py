"""A simpler effect takes the place of a relative with more values where both recordings are explained as well by it."""

from dataclasses import replace

import numpy as np
import pytest

from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection.laboratory import Laboratory, candidate_free
from lathesim.diagnosis.selection.moves.simplify import simplify
from lathesim.effects.friction import AsymmetricFriction, CoulombFriction
from lathesim.effects.offset_and_gain import ForceOffset
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.records.candidate import Candidate
from tests.diagnosis.pushed_table import Hidden, baseline, experiments, recording

LEVEL, PUSH = 8.0, 6.0


def uneven(v: float, q: float, t: float) -> float:
    """A friction that also grows with speed, in one direction only."""
    turn = float(np.tanh(v / 1e-4))
    return LEVEL * turn + PUSH + (60.0 * v if v > 0.0 else 0.0)


def grown(hidden: Hidden) -> tuple[Laboratory, SearchResult]:
    """Return what a search would hold where the friction with more values had come in first, with the simple one as a rival."""
    first, second = experiments(
        recording(hidden, seed=1), recording(hidden, seed=2), effects=(CoulombFriction, AsymmetricFriction, ForceOffset)
    )
    laboratory = Laboratory(first, second, lambda text: None)
    fitted = fit(first.sensed, baseline(first))
    laboratory.weigh(fitted)
    before = laboratory.model((), fitted)
    simple, many, push = (_candidate(first.candidates, name) for name in ("CoulombFriction", "AsymmetricFriction", "ForceOffset"))
    trials = [laboratory.trial(before, candidate, (), before.free, list(candidate.points[:2])) for candidate in (many, simple)]
    free = [*trials[0].model.free, *candidate_free(push, np.array([1.0]))]
    model = laboratory.model((many, push), fit(first.sensed, free, rounds=3))
    return laboratory, SearchResult(before, model, {many.part: trials})


def _candidate(candidates: tuple[Candidate, ...], name: str) -> Candidate:
    return next(candidate for candidate in candidates if candidate.name == name)


@pytest.mark.parametrize(
    ("hidden", "named"),
    [
        (Hidden(dry=LEVEL, law=lambda v, q, t: PUSH), ["CoulombFriction", "ForceOffset"]),
        (Hidden(law=uneven), ["AsymmetricFriction", "ForceOffset"]),
    ],
    ids=["the simple one does as well", "the simple one does not"],
)
def test_the_simpler_one_is_taken_where_it_does_as_well(hidden: Hidden, named: list[str]) -> None:
    laboratory, found = grown(hidden)
    found = simplify(laboratory, found)
    assert sorted(candidate.name for candidate in found.model.candidates) == named


def test_what_gave_way_is_told_to_be_tied_with_it() -> None:
    laboratory, found = grown(Hidden(dry=LEVEL, law=lambda v, q, t: PUSH))
    found = simplify(laboratory, found)
    friction = _candidate(found.model.candidates, "CoulombFriction")
    assert [trial.candidate.name for trial in found.trials[friction.part]] == ["CoulombFriction", "AsymmetricFriction"]


def test_of_a_model_of_one_nothing_is_asked() -> None:
    laboratory, found = grown(Hidden(dry=LEVEL, law=lambda v, q, t: PUSH))
    found = replace(found, model=found.trials["try_x_axis_asymmetric_friction"][0].model)
    assert simplify(laboratory, found) is found
    assert [candidate.name for candidate in found.model.candidates] == ["AsymmetricFriction"]
