"""What is next to nothing of what acts is no effect beside others; nor is it looked for."""

import dataclasses
from types import SimpleNamespace
from typing import Any

import pytest

from lathesim.diagnosis.method import Method
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection.forward import grow, last_of
from lathesim.diagnosis.selection.laboratory import Laboratory
from lathesim.diagnosis.selection.refusing.refusal import is_much_of_it, is_trifling, pushes_at, quiet_parts
from lathesim.effects.friction import CoulombFriction
from lathesim.effects.offset_and_gain import ForceOffset
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.records.model import Model, Trial
from tests.diagnosis.pushed_table import Hidden, baseline, experiments, recording
from tests.diagnosis.stand_ins import effect_of

LEVEL = 8.0


def with_friction(push: float) -> tuple[Laboratory, Model, list[Trial]]:
    """Return a table that rubs and is pushed a little besides, the friction in the model, and what a force that repeats does beside it."""
    hidden = Hidden(dry=LEVEL, law=lambda v, q, t: push)
    first, second = experiments(*(recording(hidden, seed=seed, noise=0.0) for seed in (1, 2)), effects=(CoulombFriction, ForceOffset))
    laboratory = Laboratory(first, second, lambda text: None)
    fitted = fit(first.sensed, baseline(first), rounds=3)
    laboratory.weigh(fitted)
    before = laboratory.model((), fitted)
    friction, offset = (
        next(candidate for candidate in first.candidates if candidate.name == name) for name in ("CoulombFriction", "ForceOffset")
    )
    model = laboratory.trial(before, friction, (), before.free, list(friction.points[:2])).model
    trial = laboratory.trial(model, offset, (friction,), model.free, list(offset.points[:1]))
    return laboratory, model, [dataclasses.replace(trial, share_of_all=share) for share in (0.001, 0.5)]


@pytest.mark.parametrize(("push", "trifling"), [(0.02, True), (1.0, False)], ids=["next to nothing", "a small force"])
def test_a_force_is_held_against_what_acts(push: float, trifling: bool) -> None:
    """Forty newtons act; two hundredths of one are how finely a simulation steps."""
    laboratory, model, (small, large) = with_friction(push)
    assert is_trifling(laboratory, model, small.model, small) == trifling
    assert not is_trifling(laboratory, model, large.model, large)


def test_what_only_pushes_is_not_looked_for_where_nothing_is_missing() -> None:
    """The counts of this encoder alone are half a percent of what acts."""
    method = dataclasses.replace(Method(), location=dataclasses.replace(Method().location, integration_error=0.01))
    laboratory, model, _ = with_friction(0.0)
    baseline_alone = dataclasses.replace(model, candidates=())
    assert quiet_parts(laboratory, baseline_alone, method=method) == set()
    assert quiet_parts(laboratory, model, method=method) == {"x_axis"}
    assert [pushes_at(candidate, {"x_axis"}) for candidate in laboratory.experiment.candidates] == [True, True]
    said: list[str] = []
    laboratory.progress = said.append
    last_of(grow(laboratory, SearchResult(baseline_alone, model), method))
    assert said == ["screening 0 candidates"]
    laboratory, model, _ = with_friction(1.0)
    assert quiet_parts(laboratory, model, method=method) == set()


@pytest.mark.parametrize(
    ("family", "share", "much"),
    [("once per turn", 0.5, True), ("once per turn", 0.1, False), ("lag", 0.9, False)],
    ids=["a ripple", "a little of it", "any resonance explains what stepping leaves"],
)
def test_a_wave_that_is_much_of_what_was_left_is_no_trifle(family: str, share: float, much: bool) -> None:
    """A motion is slow, and a ripple quicker: in the band of the motion, where a missing force is told, next to nothing of it is seen."""
    candidate: Any = SimpleNamespace(effect=effect_of(family))
    found: Any = SimpleNamespace(removed_by=lambda asked: share)
    assert is_much_of_it(candidate, found) == much
