"""What an effect was tied with when it came in is held against it again once the rest was found."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from lathesim.diagnosis.method import Method
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection.moves import retry_rivals as rivals_again
from lathesim.diagnosis.verdict.ranking import rank_effects
from lathesim.identification.records.model import Score, Trial
from tests.diagnosis.stand_ins import effect_of


def candidate(name: str, family: str = "reversal") -> Any:
    effect, part = effect_of(family), f"try_{name}"
    return SimpleNamespace(
        name=name, part=part, at="x_drive", parameters=(f"{part}.size",), family=family, effect=effect, shaped=None, acts_elsewhere=False
    )


def model(*candidates: Any, score: float = 0.0) -> Any:
    values = SimpleNamespace(by_name={one.parameters[0]: 1.0 for one in candidates})
    return SimpleNamespace(candidates=candidates, free=[], fitted=values, score=Score(score, score), validation=Score(score, score))


def trial(one: Any, gain: float, share: float = 0.99) -> Trial:
    return Trial(one, model(one), gain, gain, 5.0, share, share, full_band_gain=gain, full_band_validation_gain=gain)


@pytest.mark.parametrize(("again", "tied"), [(1000.0, True), (300.0, False)], ids=["does as well still", "did so only at first"])
def test_a_rival_that_does_far_worse_beside_the_rest_is_no_tie(again: float, tied: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    delay, lag, friction = candidate("delay"), candidate("lag"), candidate("friction")
    found = SearchResult(model(), model(delay, friction), {delay.part: [trial(delay, 500.0), trial(lag, 499.0)]})
    asked: list[str] = []

    def side_by_side(laboratory: Any, before: Any, those: Any) -> list[Trial]:
        asked.extend(one.candidate.name for one in those)
        assert all(np.array_equal(one.starts[0], [1.0]) for one in those)
        return [trial(delay, 1000.0), trial(lag, again)]

    monkeypatch.setattr(rivals_again, "fewer", lambda laboratory, full, one, **_: model(friction))
    monkeypatch.setattr(rivals_again, "side_by_side", side_by_side)
    laboratory: Any = SimpleNamespace(progress=lambda text: None)
    assert rank_effects(found, Method())[0].tied == (lag,)
    found = rivals_again.retry_rivals(laboratory, found, Method())
    assert asked == ["delay", "lag"]
    assert rank_effects(found, Method())[0].tied == ((lag,) if tied else ())


def test_a_rival_that_does_better_beside_the_rest_takes_the_place(monkeypatch: pytest.MonkeyPatch) -> None:
    """A current that was shown late did better than a drive that acts late, until the friction was in."""
    shown_late, delay, friction = candidate("shown_late"), candidate("delay"), candidate("friction")
    found = SearchResult(model(), model(shown_late, friction), {shown_late.part: [trial(shown_late, 500.0), trial(delay, 470.0)]})
    monkeypatch.setattr(rivals_again, "fewer", lambda laboratory, full, one, **_: model(friction))
    monkeypatch.setattr(rivals_again, "is_implausible", lambda fitted, **_: False)
    monkeypatch.setattr(
        rivals_again, "side_by_side", lambda laboratory, before, asked, **_: [trial(shown_late, 600.0), trial(delay, 900.0)]
    )
    laboratory: Any = SimpleNamespace(progress=lambda text: None, settled=lambda one: one)
    found = rivals_again.retry_rivals(laboratory, found, Method())
    assert found.model.candidates == (delay,)
    assert [trial.candidate for trial in found.trials[delay.part]] == [shown_late, delay]
    assert shown_late.part not in found.trials


def disc(name: str, *shape: str) -> Any:
    """Return an effect that may have a second harmonic, with the values it has of that."""
    one = candidate(name, "once per turn")
    one.effect.identification = replace(one.effect.identification, extended=("second_sine",))
    one.parameters = (f"{one.part}.amplitude", *(f"{one.part}.{item}" for item in shape))
    one.keeping = lambda names: disc(name, *[item.partition(".")[2] for item in names if not item.endswith("amplitude")])
    one.shaped = None if shape else disc(name, "second_sine")
    return one


@pytest.mark.parametrize(("again", "kept"), [(1005.0, True), (1020.0, False)], ids=["as good", "better by more than a hundredth"])
def test_an_encoders_disc_is_held_against_a_screw_in_the_same_shape(again: float, kept: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """A pure sine would have lost to a screw with harmonics, whose equation is the same at another sensor."""
    screw, eccentric, friction = disc("screw", "second_sine"), disc("eccentric"), candidate("friction")
    full = model(screw, friction)
    full.fitted.by_name = {"try_screw.amplitude": 2.0, "try_screw.second_sine": 0.3, "try_friction.size": 1.0}
    plain = trial(eccentric, 499.0)
    plain.model.fitted.by_name = {"try_eccentric.amplitude": -1.9}
    found = SearchResult(model(), full, {screw.part: [trial(screw, 500.0), plain]})
    asked: list[Any] = []

    def side_by_side(laboratory: Any, before: Any, those: Any) -> list[Trial]:
        asked.extend(those)
        return [trial(screw, 1000.0), trial(those[1].candidate, again)]

    monkeypatch.setattr(rivals_again, "fewer", lambda laboratory, full, one, **_: model(friction))
    monkeypatch.setattr(rivals_again, "side_by_side", side_by_side)
    monkeypatch.setattr(rivals_again, "is_implausible", lambda fitted, **_: False)
    laboratory: Any = SimpleNamespace(progress=lambda text: None, settled=lambda one: one)
    found = rivals_again.retry_rivals(laboratory, found, Method())
    assert asked[1].candidate.parameters == ("try_eccentric.amplitude", "try_eccentric.second_sine")
    assert [start.tolist() for start in asked[1].starts] == [[-1.9, 0.3], [-1.9, -0.3]]
    assert (found.model is full) == kept


def test_a_single_effect_is_not_asked_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rivals_again, "side_by_side", lambda *given, **_: pytest.fail("asked"))
    delay, lag = candidate("delay"), candidate("lag")
    found = SearchResult(model(), model(delay), {delay.part: [trial(delay, 500.0), trial(lag, 499.0)]})
    laboratory: Any = None
    found = rivals_again.retry_rivals(laboratory, found, Method())
    assert rank_effects(found, Method())[0].tied == (lag,)


@pytest.mark.parametrize(("lost", "taken"), [(100.0, True), (5000.0, False)], ids=["does what both do", "does much less"])
def test_two_late_channels_are_one_late_drive(lost: float, taken: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Beside a friction that was not found yet the delay of a drive moved next to nothing, and two sensors were called late."""
    delay, current, encoder = candidate("delay", "lag"), candidate("current", "recording"), candidate("encoder", "recording")
    friction = candidate("friction")
    both = model(friction, current, encoder, score=46000.0)
    trials = {current.part: [trial(current, 40000.0)], encoder.part: [trial(encoder, 6000.0)]}
    found = SearchResult(model(), both, trials, unmoved={current.part: [trial(delay, 39500.0)]})

    def side_by_side(laboratory: Any, before: Any, those: Any) -> list[Trial]:
        alone = before.candidates == (friction,)
        return [
            replace(trial(one.candidate, 45900.0), model=model(*before.candidates, one.candidate, score=46000.0 - lost))
            for one in those
            if alone
        ]

    monkeypatch.setattr(
        rivals_again, "fewer", lambda laboratory, full, one, **_: model(*[other for other in full.candidates if other is not one])
    )
    monkeypatch.setattr(rivals_again, "is_implausible", lambda fitted, **_: False)
    monkeypatch.setattr(rivals_again, "believable", lambda trial, method, null_maximum, **_: True)
    monkeypatch.setattr(
        rivals_again,
        "side_by_side",
        lambda laboratory, before, those, **_: (
            side_by_side(laboratory, before, those)
            or [trial(one.candidate, 40000.0 if one.candidate is current else 13000.0) for one in those]
        ),
    )
    laboratory: Any = SimpleNamespace(progress=lambda text: None, settled=lambda one: one)
    found = rivals_again.retry_rivals(laboratory, found, Method())
    assert found.model.candidates == ((friction, delay) if taken else (friction, current, encoder))
    assert found.removed_by(delay) == (1.0 if taken else 0.0)
