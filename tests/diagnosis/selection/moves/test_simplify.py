"""A simpler effect takes the place of a relative with more values where both recordings are explained as well by it."""

import numpy as np
import pytest

from lathesim.diagnosis.records.search import Found
from lathesim.diagnosis.selection.laboratory import Bench, term_free
from lathesim.diagnosis.selection.moves.simplify import simpler_relatives
from lathesim.effects.friction import AsymmetricFriction, CoulombFriction
from lathesim.effects.offset_and_gain import ForceOffset
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.records.candidate import Term
from tests.diagnosis.pushed_table import Hidden, baseline, recording, rigs

LEVEL, PUSH = 8.0, 6.0


def uneven(v: float, q: float, t: float) -> float:
    """A friction that also grows with speed, in one direction only."""
    turn = float(np.tanh(v / 1e-4))
    return LEVEL * turn + PUSH + (60.0 * v if v > 0.0 else 0.0)


def grown(hidden: Hidden) -> tuple[Bench, Found]:
    """Give what a search would hold where the friction with more values had come in first, with the simple one as a rival."""
    first, second = rigs(recording(hidden, seed=1), recording(hidden, seed=2), effects=(CoulombFriction, AsymmetricFriction, ForceOffset))
    bench = Bench(first, second, lambda text: None)
    fitted = fit(first.sensed, baseline(first))
    bench.weigh(fitted)
    before = bench.model((), fitted)
    simple, many, push = (_term(first.candidates, name) for name in ("CoulombFriction", "AsymmetricFriction", "ForceOffset"))
    trials = [bench.trial(before, term, (), before.free, list(term.points[:2])) for term in (many, simple)]
    free = [*trials[0].model.free, *term_free(push, np.array([1.0]))]
    model = bench.model((many, push), fit(first.sensed, free, rounds=3))
    return bench, Found(before, model, {many.part: trials})


def _term(candidates: tuple[Term, ...], name: str) -> Term:
    return next(term for term in candidates if term.name == name)


@pytest.mark.parametrize(
    ("hidden", "named"),
    [
        (Hidden(dry=LEVEL, law=lambda v, q, t: PUSH), ["CoulombFriction", "ForceOffset"]),
        (Hidden(law=uneven), ["AsymmetricFriction", "ForceOffset"]),
    ],
    ids=["the simple one does as well", "the simple one does not"],
)
def test_the_simpler_one_is_taken_where_it_does_as_well(hidden: Hidden, named: list[str]) -> None:
    bench, found = grown(hidden)
    simpler_relatives(bench, found)
    assert sorted(term.name for term in found.model.terms) == named


def test_what_gave_way_is_told_to_be_tied_with_it() -> None:
    bench, found = grown(Hidden(dry=LEVEL, law=lambda v, q, t: PUSH))
    simpler_relatives(bench, found)
    friction = _term(found.model.terms, "CoulombFriction")
    assert [trial.term.name for trial in found.trials[friction.part]] == ["CoulombFriction", "AsymmetricFriction"]


def test_of_a_model_of_one_nothing_is_asked() -> None:
    bench, found = grown(Hidden(dry=LEVEL, law=lambda v, q, t: PUSH))
    found.model = found.trials["try_x_axis_asymmetric_friction"][0].model
    simpler_relatives(bench, found)
    assert [term.name for term in found.model.terms] == ["AsymmetricFriction"]
