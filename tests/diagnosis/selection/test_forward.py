"""How a model grows: what is tried first, and what is done where the first effect was the wrong one."""

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from lathesim.diagnosis.method import Method
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection import elimination
from lathesim.diagnosis.selection import forward as growth
from lathesim.diagnosis.selection.forward import _may_add, in_turn
from lathesim.diagnosis.selection.moves.restart import comparison_of_starts, restarts
from lathesim.effects.identification import Identification
from lathesim.identification.records.model import Score, Trial
from tests.diagnosis.stand_ins import effect_of

NOTHING = Score(0.0, 0.0)
SETTINGS = Method()


def candidate(name: str, share: float = 0.0) -> Any:
    return SimpleNamespace(candidate=SimpleNamespace(part=name), share=share)


@pytest.mark.parametrize(
    ("simple", "finer", "first"),
    [(0.98, 0.99, "friction"), (0.5, 0.99, "uneven friction"), (0.5, 0.9, "friction")],
    ids=["simple ones come first", "unless only a finer one promises nearly all", "and not if that leaves much as well"],
)
def test_what_is_tried_first(simple: float, finer: float, first: str) -> None:
    ranked = [candidate("uneven friction", finer), candidate("friction", simple)]
    assert in_turn(ranked, [candidate("friction").candidate])[0][0].candidate.part == first


@pytest.mark.parametrize(
    ("share", "gain", "explained", "near", "tried"),
    [
        (0.99, 600.0, 0.8, 1200.0, True),
        (0.6, 600.0, 0.99, 1200.0, False),
        (0.6, 1300.0, 0.99, 1200.0, True),
        (0.6, 1300.0, 0.4, math.inf, True),
        (0.6, 1300.0, 0.7, math.inf, False),
    ],
    ids=["promises more than was reached", "does not", "may be tied", "further down, and nothing explained much", "and something did"],
)
def test_what_may_still_do_better_is_tried(share: float, gain: float, explained: float, near: float, tried: bool) -> None:
    """A clock that runs slow promised less gain than a spring did, and explained what that left."""
    item: Any = SimpleNamespace(share=share, gain=gain)
    assert _may_add(item, explained, near) == tried


def model(score: float, validation: float, *parameters: int) -> Any:
    candidates = tuple(SimpleNamespace(name=f"effect {place}", parameters=("size",) * count) for place, count in enumerate(parameters))
    return SimpleNamespace(candidates=candidates, free=[], fitted=None, score=Score(score, score), validation=Score(validation, validation))


@pytest.mark.parametrize(
    ("score", "validation", "parameters", "better"),
    [
        (100.0, 100.0, (1, 1), True),
        (100.0, 2.0, (1, 1), False),
        (12.0, 12.0, (1, 1), True),
        (12.0, 12.0, (1, 3), False),
    ],
    ids=["on both", "on one recording only", "by little", "by less than its parameters cost"],
)
def test_another_model_takes_over_where_it_is_plainly_better(
    score: float, validation: float, parameters: tuple[int, ...], better: bool
) -> None:
    found = SearchResult(model(0.0, 0.0), model(0.0, 0.0, 1, 1))
    other = SearchResult(model(0.0, 0.0), model(score, validation, *parameters))
    assert (comparison_of_starts(other, found, SETTINGS) is not None) == better


def trial(name: str, kept: tuple[Any, ...], share_of_rest: float, moves: float = 5.0) -> Any:
    candidate = SimpleNamespace(name=name, part=name, parameters=())
    fitted = SimpleNamespace(by_name={})
    beside = SimpleNamespace(candidates=(*kept, candidate), fitted=fitted, score=NOTHING, validation=NOTHING)
    return SimpleNamespace(candidate=candidate, model=beside, gain=500.0, validation_gain=500.0, share_of_rest=share_of_rest, moves=moves)


def found_with(share_of_rest: float, moves: float = 5.0) -> SearchResult:
    model_found = model(0.0, 0.0, 1)
    tried = [trial("refused", model_found.candidates, share_of_rest, moves)]
    return SearchResult(model(0.0, 0.0), model_found, restarted_from=[trial("another first effect", (), 0.9)], tried=tried)


def test_a_search_is_begun_otherwise_where_something_refused_takes_away_most(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lathesim.diagnosis.selection.moves.restart._exchanged", lambda laboratory, found, refused, **_: iter(()))
    monkeypatch.setattr("lathesim.diagnosis.selection.moves.restart.is_implausible", lambda fitted, **_: False)
    laboratory: Any = None
    again = list(restarts(laboratory, found_with(0.8), SETTINGS))
    assert [candidate.name for other in again for candidate in other.model.candidates] == ["another first effect"]
    assert list(restarts(laboratory, found_with(0.3), SETTINGS)) == []
    assert list(restarts(laboratory, found_with(0.8, moves=0.9), SETTINGS)) == []  # lost in what is left


@pytest.mark.parametrize(
    ("strain", "believed", "begun"),
    [(3.5, True, ["drawn"]), (1.0, True, []), (3.5, False, [])],
    ids=["values are strained", "none is", "nothing would be believed"],
)
def test_what_is_not_believed_beside_strained_values_is_taken_in_once(
    strain: float, believed: bool, begun: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A tight spot and a cogging: the friction that is the mean of the one was taken up by the viscous coefficient, until both are in."""
    asked: list[bool] = []

    def believable(trial: Any, method: Method, null_maximum: float) -> bool:
        asked.append(method.despite_implausible_values)
        return believed

    monkeypatch.setattr("lathesim.diagnosis.selection.moves.restart.is_implausible", lambda fitted, **_: strain > 2.9)
    monkeypatch.setattr("lathesim.diagnosis.selection.moves.restart.believable", believable)
    monkeypatch.setattr("lathesim.diagnosis.selection.moves.restart.is_part_of_a_wave", lambda trial, model, **_: False)
    monkeypatch.setattr("lathesim.diagnosis.selection.moves.restart.simplest", lambda good, method, **_: good[0])
    monkeypatch.setattr("lathesim.diagnosis.selection.moves.restart.merit", lambda trial, method, **_: 1.0)
    found = found_with(0.3)
    drawn = trial("drawn", found.model.candidates, 0.3)
    drawn.implausible = True
    found = replace(found, restarted_from=(), tried=[drawn])
    laboratory: Any = None
    again = list(restarts(laboratory, found, SETTINGS))
    assert [other.model.candidates[-1].name for other in again] == begun
    assert all(other.to_ease for other in again)
    assert all(asked)


def test_a_search_that_was_to_ease_the_values_counts_only_if_it_does(monkeypatch: pytest.MonkeyPatch) -> None:
    found = SearchResult(model(0.0, 0.0), model(0.0, 0.0, 1))
    other = SearchResult(model(0.0, 0.0), model(100.0, 100.0, 1, 1), to_ease=True)
    for implausible in (True, False):
        monkeypatch.setattr(
            "lathesim.diagnosis.selection.moves.restart.is_implausible", lambda fitted, implausible=implausible, **_: implausible
        )
        assert (comparison_of_starts(other, found, SETTINGS) is None) is implausible


def lag(part: str) -> Any:
    effect = SimpleNamespace(identification=Identification(delay="lag"), declarations={"lag": SimpleNamespace(unit="s")})
    return SimpleNamespace(name="SensorFilter", part=part, at="x_scale", parameters=(f"{part}.lag",), effect=effect)


@pytest.mark.parametrize(("late", "stays"), [(3e-4, False), (5e-4, True)], ids=["under a fifth of a sample", "more"])
def test_a_lag_that_shrinks_to_next_to_nothing_beside_another_effect_goes(
    late: float, stays: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A filter of the scale stood for a play until the play came in."""
    filtered, play = lag("filter"), SimpleNamespace(name="Backlash", part="play", at="x_scale", parameters=("play.width",))
    grown = SimpleNamespace(
        candidates=(filtered, play), fitted=SimpleNamespace(by_name={"filter.lag": late}), score=NOTHING, validation=NOTHING
    )
    left = SimpleNamespace(candidates=(play,), fitted=grown.fitted, score=NOTHING, validation=NOTHING)
    monkeypatch.setattr(elimination, "_is_needless", lambda *given, **_: False)
    monkeypatch.setattr(elimination, "fewer", lambda laboratory, model, candidate, **_: left)
    found: Any = SearchResult(grown, grown)  # type: ignore[arg-type]
    machine = SimpleNamespace(assembly=SimpleNamespace(sample_period=2e-3))
    laboratory: Any = SimpleNamespace(experiment=SimpleNamespace(machine=machine, record=[0.0] * 100), progress=lambda text: None)
    found = elimination.without_needless(laboratory, found, SETTINGS)
    assert [candidate.part for candidate in found.model.candidates] == (["filter", "play"] if stays else ["play"])


def test_a_model_that_grows_to_a_known_one_is_not_grown_further() -> None:
    known = model(0.0, 0.0, 1)
    known.candidates[0].part = "play"
    found: Any = SimpleNamespace(model=known)
    assert growth.last_of(growth.grow(Any, found, SETTINGS, known.candidates)) is found  # type: ignore[arg-type]


def test_what_takes_the_place_of_an_effect_is_credited_with_its_share() -> None:
    """A friction with bristles removes 4 % of all beside the plain one whose place it takes, and the 95 % that this one had removed."""
    plain, bristles = (SimpleNamespace(part=name) for name in ("plain", "bristles"))
    taken = [Trial(candidate, None, 100.0, 100.0, 5.0, share, 0.9) for candidate, share in ((plain, 0.95), (bristles, 0.04))]  # type: ignore[arg-type]
    found = SearchResult(model(0.0, 0.0), model(0.0, 0.0), {trial.candidate.part: [trial] for trial in taken})
    found = found.taking_over(bristles, plain)  # type: ignore[arg-type]
    assert found.removed_by(bristles) == pytest.approx(0.99)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("family", "gain", "validation", "again"),
    [
        ("reversal", 8000.0, 16000.0, True),
        ("reversal", 8000.0, 1000.0, True),
        ("reversal", 8000.0, 7000.0, False),
        ("lag", 8000.0, 1000.0, False),
    ],
    ids=["explains the other recording better", "or much worse", "both alike", "holds nothing still"],
)
def test_a_friction_that_explains_one_recording_better_is_tried_with_the_motion_it_makes(
    family: str, gain: float, validation: float, again: bool
) -> None:
    """A slide stood still in one pass of three: what its friction held there added up."""
    candidate = SimpleNamespace(effect=effect_of(family), parameters=("try.level",))
    fitted = SimpleNamespace(fitted=SimpleNamespace(by_name={"try.level": 150.0}))
    made: Any = SimpleNamespace(candidate=candidate, gain=gain, validation_gain=validation, model=fitted, share_of_rest=0.99)
    asked = growth._with_simulated_motion([made], [], model(0.0, 0.0, 1))
    assert [(one.with_simulated_motion, one.starts[0].tolist()) for one in asked] == ([(True, [150.0])] if again else [])


@pytest.mark.parametrize(
    ("gain", "share", "again"),
    [(14000.0, 0.99, True), (14000.0, 0.5, False), (8100.0, 0.99, False)],
    ids=["holds still as well", "does something else", "does no better"],
)
def test_a_friction_beside_which_a_dead_zone_gains_more_is_tried_with_the_motion_it_makes(gain: float, share: float, again: bool) -> None:
    friction = SimpleNamespace(effect=effect_of("reversal"), parameters=("try.level",))
    fitted = SimpleNamespace(fitted=SimpleNamespace(by_name={"try.level": 140.0}))
    made: Any = SimpleNamespace(candidate=friction, gain=8000.0, validation_gain=7000.0, model=fitted, share_of_rest=0.99)
    dead_zone: Any = SimpleNamespace(candidate=SimpleNamespace(effect=effect_of("drive range")), gain=gain, share_of_rest=share)
    assert bool(growth._with_simulated_motion([made], [dead_zone], model(0.0, 0.0, 1))) == again


@pytest.mark.parametrize(
    ("kept", "frictions", "family", "again"),
    [
        (0.24, True, "once per turn", True),
        (0.9, True, "once per turn", False),
        (0.24, False, "once per turn", False),
        (0.24, True, "reversal", False),
    ],
    ids=["kept little", "kept most", "nothing holds", "holds by itself"],
)
def test_what_pushes_a_table_at_rest_is_tried_with_frictions_that_hold_it(kept: float, frictions: bool, family: str, again: bool) -> None:
    """A cogging promised nearly all and kept a quarter: a friction that senses a recorded rest lets the spindle go."""
    candidate = SimpleNamespace(part="try_cogging", effect=effect_of(family, site="effort"))
    item: Any = SimpleNamespace(candidate=candidate, share=0.99, starts=(np.array([3.0, 0.14]), np.array([3.0, 0.07])))
    made: Any = SimpleNamespace(candidate=candidate, share_of_rest=kept)
    experiment: Any = SimpleNamespace(simulated_motion_of=lambda candidates: {"sensed_bearing_flow.share": 0.0} if frictions else {})
    asked = growth._held_at_rest(experiment, [item], [made], model(0.0, 0.0, 1))
    assert [(one.with_simulated_motion, one.starts[0].tolist()) for one in asked] == ([(True, [3.0, 0.14])] if again else [])


@pytest.mark.parametrize(("gain", "kept"), [(9700.0, True), (4200.0, False)], ids=["far better", "no better"])
def test_a_friction_with_the_motion_it_makes_counts_where_it_explains_more(gain: float, kept: bool) -> None:
    """Held against another recording in the closed loop it would else be preferred to what holds nothing still."""
    candidate = SimpleNamespace(part="try_friction")
    made: Any = [
        SimpleNamespace(candidate=candidate, gain=4100.0),
        SimpleNamespace(candidate=SimpleNamespace(part="try_offset"), gain=9900.0),
    ]
    with_simulated_motion: Any = SimpleNamespace(candidate=candidate, gain=gain)
    assert growth._holds_still(with_simulated_motion, made) == kept


def test_the_barest_form_of_a_friction_is_tried_with_recorded_and_with_felt_motion() -> None:
    names = ("friction.level", "friction.distance", "friction.excess")
    bare = SimpleNamespace(parameters=names[:2])
    item: Any = SimpleNamespace(candidate=SimpleNamespace(parameters=names, bare=bare), starts=(np.array([20.0, 5e-6, 3.0]),))
    plain: Any = SimpleNamespace(candidate=SimpleNamespace(bare=None))
    asked = growth._bare([plain, item], model(0.0, 0.0))
    assert [(one.candidate, one.with_simulated_motion) for one in asked] == [(bare, False), (bare, True)]
    assert asked[0].starts[0].tolist() == [20.0, 5e-6]


@pytest.mark.parametrize(("without", "kept"), [((0.10,), True), ((0.021,), False)], ids=["takes away much", "was a part of the shape"])
def test_what_was_a_part_of_a_finer_shape_goes(without: tuple[float, ...], kept: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """A ripple at half the wavelength of a friction, once the friction has its second harmonic."""
    ripple, friction = (SimpleNamespace(name=name, at="x_axis", part=name) for name in ("ripple", "friction"))
    whole: Any = SimpleNamespace(candidates=(ripple, friction), error=np.array([0.02]), score=NOTHING, validation=NOTHING)
    fewer: Any = SimpleNamespace(candidates=(friction,), error=np.array(without), score=NOTHING, validation=NOTHING)
    monkeypatch.setattr(elimination, "fewer", lambda laboratory, model, candidate, **_: fewer)
    laboratory: Any = SimpleNamespace(everything=np.ones(1), baseline_error=np.ones(1), progress=lambda text: None)
    found = elimination.without_parts_of_a_shape(laboratory, SearchResult(whole, whole), SETTINGS)
    assert (ripple in found.model.candidates) == kept


@pytest.mark.parametrize(
    ("closed_loop_degradation", "share", "other", "kept"),
    [(1.34, 0.985, 0.994, ["friction"]), (1.34, 0.985, 1.2, ["friction", "dead zone"]), (0.8, 0.985, 0.994, ["friction", "dead zone"])],
    ids=["a controller would not have it", "both spoil", "none does"],
)
def test_what_holds_a_replay_that_runs_away_has_to_do_so_in_the_loop_as_well(
    closed_loop_degradation: float, share: float, other: float, kept: list[str]
) -> None:
    """A light slide stood still as often as it moved: with a dead zone its replay hardly moved at all, and that was near to the place."""
    trials: Any = [
        SimpleNamespace(candidate=SimpleNamespace(name=name), share_of_rest=of_rest, closed_loop_degradation=worse)
        for name, of_rest, worse in (("friction", 0.938, other), ("dead zone", share, closed_loop_degradation))
    ]
    assert [trial.candidate.name for trial in growth._without_degradation(trials)] == kept
