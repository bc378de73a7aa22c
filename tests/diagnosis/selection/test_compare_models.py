"""When a model is better than another one, and when it is as good: the one comparison that every move of the search asks."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from lathesim.diagnosis.method import Method
from lathesim.diagnosis.selection.compare_models import Gains, compare_models, due, further_parameters, gains_over
from lathesim.identification.records.model import Score

METHOD = Method()
"""A margin of 10 nats, 3 a parameter; 3 % of what is explained cannot be distinguished, 1 % of it by a fit."""


@pytest.mark.parametrize(
    ("gains", "asked", "better"),
    [
        (Gains(14.0, 5.0), {"effects": 1, "parameters": 1}, True),
        (Gains(12.0, 5.0), {"effects": 1, "parameters": 1}, False),
        (Gains(14.0, 2.0), {"effects": 1, "parameters": 1}, False),
        (Gains(1000.0, 9.0), {"effects": 1, "parameters": 1}, False),
        (Gains(30.0, 20.0), {"effects": 1, "parameters": 1, "null_maximum": 20.0}, False),
        (Gains(14.0), {"effects": 1, "parameters": 1}, True),
        (Gains(2.0, 2.0), {}, False),
        (Gains(14.0, 14.0), {"effects": 1, "explained": 1000.0}, False),
        (Gains(14.0, 14.0), {"effects": 1, "explained": 1000.0, "alike": True}, True),
    ],
    ids=[
        "more than is due on both recordings",
        "less than an effect and its parameter cost",
        "nothing on the validation recording",
        "next to nothing on it, of so much",
        "no more than the best of the candidates gains by chance",
        "the validation recording was not asked",
        "less than one parameter gains by chance",
        "a small share of what both explain",
        "which counts where both have one form",
    ],
)
def test_what_is_better_gains_more_than_it_costs_and_more_than_models_are_right(gains: Gains, asked: dict[str, Any], better: bool) -> None:
    assert compare_models(gains, METHOD, **asked).better is better


@pytest.mark.parametrize(
    ("gains", "asked", "as_good"),
    [
        (Gains(-2.0, -2.0), {}, True),
        (Gains(-4.0, 5.0), {}, False),
        (Gains(5.0, -4.0), {}, False),
        (Gains(-12.0, -12.0), {"effects": -1, "parameters": -1}, True),
        (Gains(-14.0, 0.0), {"effects": -1, "parameters": -1}, False),
        (Gains(-20.0, -20.0), {"explained": 1000.0}, True),
        (Gains(-20.0, -20.0), {"explained": 1000.0, "alike": True}, False),
        (Gains(0.0, 0.0), {"apart": 0.05}, False),
        (Gains(5.0, 5.0), {"effects": 1, "parameters": 1}, False),
    ],
    ids=[
        "loses less than a parameter gains by chance",
        "loses on the estimation recording",
        "loses on the validation recording",
        "loses what an effect and its parameter save",
        "loses more",
        "loses a small share of what both explain",
        "which counts where both have one form",
        "explains another share of the error",
        "has more effects and is not better",
    ],
)
def test_what_is_as_good_loses_no_more_than_it_saves_or_than_can_be_told(gains: Gains, asked: dict[str, Any], as_good: bool) -> None:
    assert compare_models(gains, METHOD, **asked).as_good is as_good


def test_a_stricter_method_asks_more() -> None:
    assert due(METHOD, parameters=2) == 16.0
    assert due(METHOD, effects=-1, parameters=-2) == -16.0
    strict = replace(METHOD, margin=20.0)
    assert not compare_models(Gains(14.0, 5.0), strict, effects=1, parameters=1).better


def test_the_comparison_is_said_in_words() -> None:
    larger = compare_models(Gains(140.4, 90.0), METHOD, effects=1, parameters=1)
    assert larger.reason == "gains 140 nats on the estimation recording and 90 on the validation recording; 13 are due"
    assert compare_models(Gains(-2.0), METHOD, effects=-1).reason == "gains -2 nats on the estimation recording; it saves 10"


@pytest.mark.parametrize(("goes_beyond", "gain"), [(False, 10.0), (True, 25.0)], ids=["within the motion", "beyond it"])
def test_gains_are_taken_in_the_band_that_either_model_is_fitted_in(goes_beyond: bool, gain: float) -> None:
    """Numbers of parameters are those of all effects together."""

    def model(score: Score, *parameters: int) -> Any:
        effect = SimpleNamespace(identification=SimpleNamespace(full_band=goes_beyond))
        candidates = tuple(SimpleNamespace(parameters=("size",) * count, effect=effect) for count in parameters)
        return SimpleNamespace(candidates=candidates, score=score, validation=score)

    one, other = model(Score(30.0, 75.0), 1, 3), model(Score(20.0, 50.0), 2)
    assert gains_over(one, other) == Gains(gain, gain)
    assert gains_over(one, other, full_band=True).estimation == 25.0
    assert further_parameters(one, other) == 2
