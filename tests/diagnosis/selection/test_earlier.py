"""A recording from before a change: what explains as much of it is no part of the change."""

import functools
import math

from lathesim.diagnosis.method import Method
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection.search import search
from lathesim.diagnosis.verdict.ranking import rank_effects
from tests.diagnosis.pushed_table import Hidden, experiments, recording

RIPPLE, TURN = 4.0, 0.02


def law(speed: float, place: float, time: float) -> float:
    """Return a force that repeats along the way, which the lesson never knew."""
    return RIPPLE * math.sin(2.0 * math.pi * place / TURN)


@functools.cache
def found(dry: float, *, beside_earlier: bool) -> SearchResult:
    """Return what a search finds in two recordings of a table that ripples and now rubs by ``dry`` [N] too."""
    now = [recording(Hidden(dry=dry, law=law), seed=seed) for seed in (1, 2)]
    first, second, earlier = experiments(*now, recording(Hidden(law=law), seed=3))
    method = Method().beside_an_earlier_recording() if beside_earlier else Method()
    return search(first, second, method, before=earlier if beside_earlier else None)


def names(result: SearchResult) -> set[str]:
    return {candidate.name for candidate in result.model.candidates}


def named(result: SearchResult) -> list[str]:
    return [item.candidate.name for item in rank_effects(result, Method())]


def test_what_was_there_before_is_in_the_model_and_no_part_of_a_change() -> None:
    assert sorted(named(found(3.0, beside_earlier=False))) == ["CoulombFriction", "TorqueRipple"]
    result = found(3.0, beside_earlier=True)
    assert names(result) == {"TorqueRipple", "CoulombFriction"}
    assert named(result) == ["CoulombFriction"]


def test_where_nothing_changed_nothing_is_named() -> None:
    assert named(found(0.0, beside_earlier=False)) == ["TorqueRipple"]
    assert not named(found(0.0, beside_earlier=True))
