"""An effect that explains little is named only where its size is surely not zero."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lathesim.diagnosis.explaining.chance import is_clear
from lathesim.diagnosis.explaining.resolution import as_good, small_and_unsure
from lathesim.diagnosis.explaining.rounds import Rounds
from lathesim.diagnosis.explaining.search import explain, surer_instead
from lathesim.diagnosis.explaining.starts import candidate_free
from lathesim.diagnosis.explaining.study import Study
from lathesim.diagnosis.explaining.trial import modelled, over
from lathesim.diagnosis.explaining.trial import worth as worth_of
from lathesim.diagnosis.records.found import Found, Gain, Tried
from lathesim.effects.offset_and_gain import ForceOffset
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.records import Candidate, Free, Model
from tests.diagnosis.pushed_table import Hidden, baseline, pair, study

PULL = 8.0


@pytest.fixture(scope="module")
def found() -> Found:
    """A model with a constant force that is there and a dry friction that is not."""
    asked = study(*pair(Hidden(law=lambda v, q, t: PULL)))
    candidates = tuple(one for one in asked.estimation.candidates if one.name in ("CoulombFriction", "ForceOffset"))
    free = [one for candidate in candidates for one in candidate_free(asked, candidate, np.asarray(0.1 * candidate.usual))]
    sensed = asked.estimation.sensed
    model = modelled(asked, candidates, fit(sensed, [*baseline(asked.estimation), *free]))
    return Found(model, model)


def worth(found: Found, share: float, error: float = 20.0) -> list[Tried]:
    """Return both effects with one gain, which explains a share of what is left."""
    gain = Gain(200.0, error, share)
    return [Tried(candidate, found.model, found.model, gain, gain) for candidate in found.model.candidates]


def test_of_small_effects_the_one_whose_size_may_be_zero_is_found(found: Found) -> None:
    asked = study(*pair(Hidden(law=lambda v, q, t: PULL)))
    doubtful = small_and_unsure(asked, found.model, worth(found, 0.2))
    assert doubtful is not None
    assert doubtful.candidate.effect is not ForceOffset
    assert small_and_unsure(asked, found.model, worth(found, 0.8)) is None
    # clear whatever the blocks of the recording have in common
    assert small_and_unsure(asked, found.model, worth(found, 0.2, error=2.0)) is None


def test_what_may_be_nothing_takes_no_place_of_another_effect(found: Found) -> None:
    asked = study(*pair(Hidden(law=lambda v, q, t: PULL)))
    unsure = {one.candidate.name for one in worth(found, 0.2) if small_and_unsure(asked, found.model, [one])}
    assert unsure == {"CoulombFriction"}


@pytest.mark.parametrize(("wave", "as_well"), [(0.3, True), (3.0, False)])
def test_a_simpler_explanation_does_as_well_as_one_that_differs_by_less_than_the_model_error(wave: float, as_well: bool) -> None:
    """The wave gains clearly in both cases; 1 % of the forces, which are 42 N, may be an error of laws."""
    asked = study(*pair(Hidden(dry=10.0, law=lambda v, q, t: wave * math.sin(2.0 * math.pi * q / 0.01))))
    names = ("CoulombFriction", "TorqueRipple")
    friction, ripple = (one for name in names for one in asked.estimation.candidates if one.name == name)
    begun = np.array([wave, 0.0, 0.01, math.pi])
    starts = [*candidate_free(asked, friction, np.array([10.0])), *candidate_free(asked, ripple, begun)]
    lesson, simple, both = (_fitted(asked, chosen, starts) for chosen in ((), (friction,), (friction, ripple)))
    best = worth_of(ripple, lesson, both)
    assert is_clear(over(both, simple)[1], asked.method, best.parameters)
    assert as_good(simple, best, asked) is as_well


def _fitted(asked: Study, candidates: tuple[Candidate, ...], starts: list[Free]) -> Model:
    names = {name for one in candidates for name in one.parameters}
    free = [*baseline(asked.estimation), *(one for one in starts if one.name in names)]
    return modelled(asked, candidates, fit(asked.estimation.sensed, free))


def test_a_doubtful_effect_makes_way_for_one_whose_size_is_sure() -> None:
    asked = study(*pair(Hidden(law=lambda v, q, t: PULL)))
    sensed, free = asked.estimation.sensed, baseline(asked.estimation)
    alone = modelled(asked, (), fit(sensed, free))
    friction = next(one for one in asked.estimation.candidates if one.name == "CoulombFriction")
    with_it = modelled(asked, (friction,), fit(sensed, [*free, *candidate_free(asked, friction, np.asarray(0.1 * friction.usual))]))
    doubtful = worth_of(friction, alone, with_it)
    left = surer_instead(asked, Found(alone, with_it), doubtful, Rounds(asked).on(alone))
    assert [one.effect for one in left.model.candidates] == [ForceOffset]
    assert left.history[-1].move == "swap"


def test_a_gain_that_better_values_alone_make_is_no_effect() -> None:
    """A model that stopped short of its best values gains by whatever is fitted beside it."""
    asked = study(*pair(Hidden(dry=10.0)))
    friction = next(one for one in asked.estimation.candidates if one.name == "CoulombFriction")
    short = [*baseline(asked.estimation), *candidate_free(asked, friction, np.array([6.0]))]
    begun = modelled(asked, (friction,), fit(asked.estimation.sensed, short, rounds=0))
    found = explain(asked, begun)
    assert [one.name for one in found.model.candidates] == ["CoulombFriction"]
    assert found.model.fitted.by_name[f"{friction.part}.level"] == pytest.approx(10.0, rel=0.05)
    assert [step.move for step in found.history] == ["refit"]
    assert any(one.candidate.name != "CoulombFriction" and one.predicted.nats > 0.0 for one in found.tried)
