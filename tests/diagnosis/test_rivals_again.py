"""What an effect was tied with when it came in is held against it again once the rest was found."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from lathesim.diagnosis import rivals_again
from lathesim.diagnosis.belief import Settings
from lathesim.diagnosis.found import Found
from lathesim.diagnosis.trial import Trial
from lathesim.diagnosis.verdict import standing


def term(name: str) -> Any:
    return SimpleNamespace(name=name, part=f"try_{name}", at="x_drive", parameters=(f"try_{name}.size",))


def model(*terms: Any) -> Any:
    return SimpleNamespace(terms=terms, free=[], fitted=SimpleNamespace(by_name={one.parameters[0]: 1.0 for one in terms}))


def trial(one: Any, gain: float, share: float = 0.99) -> Trial:
    return Trial(one, model(one), gain, gain, 5.0, share, share, wide_gain=gain, wide_held_out_gain=gain)


@pytest.mark.parametrize(("again", "tied"), [(1000.0, True), (300.0, False)], ids=["does as well still", "did so only at first"])
def test_a_rival_that_does_far_worse_beside_the_rest_is_no_tie(again: float, tied: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    delay, lag, friction = term("delay"), term("lag"), term("friction")
    found = Found(model(), model(delay, friction), {delay.part: [trial(delay, 500.0), trial(lag, 499.0)]})
    asked: list[str] = []

    def side_by_side(bench: Any, before: Any, those: Any) -> list[Trial]:
        asked.extend(one.term.name for one in those)
        assert all(np.array_equal(one.starts[0], [1.0]) for one in those)
        return [trial(delay, 1000.0), trial(lag, again)]

    monkeypatch.setattr(rivals_again, "fewer", lambda bench, full, one: model(friction))
    monkeypatch.setattr(rivals_again, "side_by_side", side_by_side)
    bench: Any = SimpleNamespace(say=lambda text: None)
    assert standing(found, Settings())[0].tied == (lag,)
    rivals_again.try_rivals_again(bench, found, Settings())
    assert asked == ["delay", "lag"]
    assert standing(found, Settings())[0].tied == ((lag,) if tied else ())


def test_a_rival_that_does_better_beside_the_rest_takes_the_place(monkeypatch: pytest.MonkeyPatch) -> None:
    """A current that was shown late did better than a drive that acts late, until the friction was in."""
    shown_late, delay, friction = term("shown_late"), term("delay"), term("friction")
    found = Found(model(), model(shown_late, friction), {shown_late.part: [trial(shown_late, 500.0), trial(delay, 470.0)]})
    monkeypatch.setattr(rivals_again, "fewer", lambda bench, full, one: model(friction))
    monkeypatch.setattr(rivals_again, "is_strained", lambda fitted: False)
    monkeypatch.setattr(rivals_again, "side_by_side", lambda bench, before, asked: [trial(shown_late, 600.0), trial(delay, 900.0)])
    bench: Any = SimpleNamespace(say=lambda text: None, settled=lambda one: one)
    rivals_again.try_rivals_again(bench, found, Settings())
    assert found.model.terms == (delay,)
    assert [trial.term for trial in found.trials[delay.part]] == [shown_late, delay]
    assert shown_late.part not in found.trials


def test_a_single_effect_is_not_asked_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rivals_again, "side_by_side", lambda *given: pytest.fail("asked"))
    delay, lag = term("delay"), term("lag")
    found = Found(model(), model(delay), {delay.part: [trial(delay, 500.0), trial(lag, 499.0)]})
    bench: Any = None
    rivals_again.try_rivals_again(bench, found, Settings())
    assert standing(found, Settings())[0].tied == (lag,)
