"""A finer form whose own values are nothing gives way to the plain one."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection.laboratory import Laboratory
from lathesim.diagnosis.selection.moves.specialise import _has_values_of_its_own, specialise
from lathesim.effects.friction import AsymmetricFriction, CoulombFriction
from lathesim.identification.estimation.least_squares import fit
from tests.diagnosis.pushed_table import Hidden, baseline, experiments, recording

LEVEL, UNEVEN = 8.0, 0.3


def uneven(v: float, q: float, t: float) -> float:
    """A friction that is larger in one direction."""
    turn = float(np.tanh(v / 1e-4))
    return LEVEL * (1.0 + UNEVEN * turn) * turn


@pytest.mark.parametrize(
    ("hidden", "named"),
    [(Hidden(dry=LEVEL), "CoulombFriction"), (Hidden(law=uneven), "AsymmetricFriction")],
    ids=["alike both ways", "larger in one direction"],
)
def test_only_what_differs_between_the_directions_keeps_its_name(hidden: Hidden, named: str) -> None:
    first, second = experiments(recording(hidden, seed=1), recording(hidden, seed=2), effects=(CoulombFriction, AsymmetricFriction))
    laboratory = Laboratory(first, second, lambda text: None)
    fitted = fit(first.sensed, baseline(first))
    laboratory.weigh(fitted)
    before = laboratory.model((), fitted)
    finer = next(candidate for candidate in first.candidates if candidate.name == "AsymmetricFriction")
    trial = laboratory.trial(before, finer, (), before.free, list(finer.points[:2]))
    found = SearchResult(before, trial.model, {finer.part: [trial]})
    found = specialise(laboratory, found)
    (friction,) = found.model.candidates
    assert friction.name == named
    assert found.model.fitted.by_name[f"{friction.part}.level"] == pytest.approx(LEVEL, rel=0.05)
    # how much it took away when it came in is still known
    assert found.removed_by(friction) == trial.share_of_all
    assert [candidate.name for candidate in found.unseen.get(friction.part, [])] == (
        ["AsymmetricFriction"] if named == "CoulombFriction" else []
    )


@pytest.mark.parametrize(("distance", "sure"), [(20e-6, True), (2e-6, False)], ids=["bristles that surely bend", "that may not"])
def test_what_has_a_value_of_its_own_stays_what_it_is(distance: float, sure: bool) -> None:
    """Presliding took eight tenths of what a plain friction had left, and little of all."""
    finer: Any = SimpleNamespace(parameters=("finer.level", "finer.distance"))
    plain: Any = SimpleNamespace(parameters=("plain.level",))
    fitted = SimpleNamespace(by_name={"finer.level": LEVEL, "finer.distance": distance}, error=lambda name: 1e-6)
    model: Any = SimpleNamespace(fitted=fitted)
    assert _has_values_of_its_own(finer, plain, model) == sure
