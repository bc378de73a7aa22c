"""The search: it names what is hidden and nothing else, believes only what both recordings say, and keeps what it has when stopped."""

import dataclasses
import functools
from typing import Any

import numpy as np
import pytest

from lathesim.diagnosis.location.closed_loop_fit import compared
from lathesim.diagnosis.method import Method
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.reporting.evidence import gather, runners_up
from lathesim.diagnosis.selection.acceptance import believable, merit, replaces
from lathesim.diagnosis.selection.elimination import leave_out
from lathesim.diagnosis.selection.laboratory import becomes_implausible
from lathesim.diagnosis.selection.search import search
from lathesim.effects.effect import Effect
from lathesim.effects.friction import ViscousWarmUp
from lathesim.effects.structure import AxialResonance
from lathesim.identification.records.model import Trial
from tests.diagnosis.pushed_table import Hidden, experiments, pair, recording

RUBBING = Hidden(dry=8.0)
RUBBING_AND_PUSHED = Hidden(dry=8.0, law=lambda v, q, t: 6.0)
SETTINGS = Method()


@functools.cache
def found_in(hidden: Hidden) -> SearchResult:
    return search(*pair(hidden))


def names(found: SearchResult) -> list[str]:
    return sorted(candidate.name for candidate in found.model.candidates)


@pytest.mark.parametrize(
    ("hidden", "effects"),
    [
        (Hidden(), []),
        (RUBBING, ["CoulombFriction"]),
        (RUBBING_AND_PUSHED, ["CoulombFriction", "ForceOffset"]),
        (Hidden(mass=42.0, viscous=190.0), []),
        (Hidden(law=lambda v, q, t: 6.0 * np.sin(2.0 * np.pi * q / 0.012 + 0.5)), ["TorqueRipple"]),
    ],
    ids=["nothing", "friction", "friction and offset", "other values", "ripple"],
)
def test_what_is_hidden_is_found_and_nothing_else(hidden: Hidden, effects: list[str]) -> None:
    found = found_in(hidden)
    assert names(found) == effects
    assert found.complete


def test_a_search_that_has_cost_all_that_it_may_looks_for_no_further_effect() -> None:
    found = search(*experiments(*(recording(RUBBING_AND_PUSHED, seed=seed) for seed in (1, 2))), Method(most_runs=1, runs_a_candidate=0))
    assert names(found) == []
    assert found.ended_after > 1
    assert found.complete
    assert found_in(RUBBING_AND_PUSHED).ended_after == 0


def test_sizes_come_out_near_those_hidden() -> None:
    values = found_in(RUBBING_AND_PUSHED).model.fitted.by_name
    assert values["try_x_axis_coulomb_friction.level"] == pytest.approx(8.0, rel=0.1)
    assert values["try_x_axis_force_offset.offset"] == pytest.approx(6.0, rel=0.1)


def test_what_the_baseline_had_absorbed_is_given_back() -> None:
    found = found_in(RUBBING)
    without, with_it = (model.fitted.by_name["x_axis.viscous"] for model in (found.baseline, found.model))
    assert without > 230.0
    assert with_it == pytest.approx(200.0, rel=0.05)


def test_each_effect_is_held_against_the_model_before_it() -> None:
    trials = found_in(RUBBING).trials["try_x_axis_coulomb_friction"]
    assert trials[0].gain > 100.0
    assert trials[0].validation_gain > 50.0
    assert trials[0].share_of_all > 0.8
    assert trials[0].moves > 10.0


def test_an_effect_of_one_recording_alone_is_not_believed() -> None:
    """A push that only the fitted recording has explains nothing of the other."""
    first, second = experiments(recording(Hidden(law=lambda v, q, t: 6.0), seed=1), recording(seed=2))
    found = search(first, second)
    offset = [trial for trial in found.tried if trial.candidate.name == "ForceOffset"]
    assert offset
    assert offset[0].gain > 50.0
    assert offset[0].validation_gain < 0.0
    assert names(found) == []


def test_an_effect_of_the_held_out_recording_alone_is_not_found() -> None:
    first, second = experiments(recording(seed=1), recording(RUBBING, seed=2))
    assert names(search(first, second)) == []


def test_stopped_it_keeps_what_it_has() -> None:
    said: list[str] = []

    def stop_in_the_second_round(text: str) -> None:
        said.append(text)
        if sum(line.startswith("screening") for line in said) == 2:
            raise KeyboardInterrupt

    found = search(*pair(RUBBING_AND_PUSHED), tell=lambda text: None if "stopped" in text else stop_in_the_second_round(text))
    assert not found.complete
    assert len(found.model.candidates) == 1
    assert len(found.tried) >= 1


def test_it_tells_what_it_does() -> None:
    said: list[str] = []
    search(*pair(Hidden()), tell=said.append)
    assert said[:2] == ["fitting the baseline", "screening 3 candidates"]


def test_what_an_effect_took_away_is_kept() -> None:
    found = found_in(RUBBING)
    (friction,) = found.model.candidates
    other = next(candidate for candidate in pair(RUBBING)[0].candidates if candidate.name == "TorqueRipple")
    assert found.removed_by(friction) > 0.9
    assert found.removed_by(other) == 0.0


def test_what_is_left_is_told_of_trials_against_the_model_that_was_found() -> None:
    """A rival that was tried before an effect came in is tied with it, and takes nothing away of what that one leaves."""
    experiment, _ = pair(RUBBING)
    friction, ripple, push = (
        next(t for t in experiment.candidates if t.name == name) for name in ("CoulombFriction", "TorqueRipple", "ForceOffset")
    )
    found = dataclasses.replace(found_in(RUBBING), model=dataclasses.replace(found_in(RUBBING).model, candidates=(friction, ripple)))

    def tried(*candidates: Any) -> Trial:
        return trial(candidate=candidates[-1], model=dataclasses.replace(found.model, candidates=candidates))

    assert found.was_held_against(tried(friction, ripple, push))
    assert not found.was_held_against(tried(friction, push))
    assert not found.was_held_against(tried(friction, ripple))


def test_a_runner_up_was_tried_beside_the_same_effects() -> None:
    """What gained more in another round, with more of the error left to gain, is no rival."""
    experiment, _ = pair(RUBBING)
    friction, ripple, push = (
        next(t for t in experiment.candidates if t.name == name) for name in ("CoulombFriction", "TorqueRipple", "ForceOffset")
    )
    model = found_in(RUBBING).model

    def tried(validation: float, *candidates: Any) -> Trial:
        return trial(candidate=candidates[-1], model=dataclasses.replace(model, candidates=candidates), validation_gain=validation)

    first, second = tried(500.0, friction), tried(40.0, friction, ripple)
    found = SearchResult(
        model,
        dataclasses.replace(model, candidates=(friction, ripple)),
        {friction.part: [first], ripple.part: [second]},
        [first, tried(300.0, push), tried(250.0, ripple), second, tried(8.0, friction, push)],
    )
    assert list(runners_up(found)) == [
        ("CoulombFriction at x_axis", "ForceOffset at x_axis", 200.0),
        ("TorqueRipple at x_axis", "ForceOffset at x_axis", 32.0),
    ]


def test_an_effect_is_left_out_again() -> None:
    first, second = pair(RUBBING_AND_PUSHED)
    found = found_in(RUBBING_AND_PUSHED)
    push = [candidate for candidate in found.model.candidates if candidate.name == "ForceOffset"]
    found = leave_out(found, push, first, second, lambda text: None)
    assert names(found) == ["CoulombFriction"]
    assert "try_x_axis_force_offset.offset" not in found.model.fitted.names
    found = leave_out(found, found.model.candidates, first, second, lambda text: None)
    assert found.model is found.baseline


def trial(**changes: Any) -> Trial:
    first = found_in(RUBBING)
    sure = Trial(first.model.candidates[0], first.model, 100.0, 80.0, 20.0, 0.5, 0.5)
    return dataclasses.replace(sure, **changes)


@pytest.mark.parametrize(
    ("changes", "believed"),
    [
        ({}, True),
        ({"gain": 12.0}, False),
        ({"validation_gain": 2.0}, False),
        ({"moves": 0.5}, False),
        ({"share_of_all": 0.01}, False),
        ({"share_of_rest": 0.1}, False),
        ({"share_of_all": 0.01, "share_of_rest": 0.7}, True),
    ],
    ids=["sure", "no gain", "held out says no", "moves nothing", "little of all", "little of the rest", "nearly all of the rest"],
)
def test_what_it_takes_to_be_believed(changes: dict[str, float], believed: bool) -> None:
    assert believable(trial(**changes), SETTINGS, 5.0) == believed


def test_chance_must_be_beaten() -> None:
    assert believable(trial(gain=40.0), SETTINGS, 5.0)
    assert not believable(trial(gain=40.0), SETTINGS, 30.0)


def test_a_gain_counts_as_far_as_the_other_recording_agrees() -> None:
    agreed = trial(full_band_gain=100.0, full_band_validation_gain=80.0)
    not_agreed = trial(full_band_gain=100.0, full_band_validation_gain=-50.0)
    assert merit(agreed, SETTINGS) == pytest.approx(80.0 + 50.0 - 3.0)
    assert merit(not_agreed, SETTINGS) == pytest.approx(-50.0 + 50.0 - 3.0)


def test_what_spoils_the_lessons_own_simulation_is_not_believed() -> None:
    trial = found_in(RUBBING).trials["try_x_axis_coulomb_friction"][0]
    assert believable(trial, SETTINGS, null_maximum=0.0)
    assert not believable(dataclasses.replace(trial, closed_loop_degradation=2.0), SETTINGS, null_maximum=0.0)


def test_a_refined_form_must_leave_the_less_the_more_values_it_has() -> None:
    experiment, _ = pair(RUBBING)
    simple, ripple = (
        next(candidate for candidate in experiment.candidates if candidate.name == name) for name in ("CoulombFriction", "TorqueRipple")
    )
    one_more = dataclasses.replace(ripple, parameters=ripple.parameters[:2])
    for candidate, enough, too_little in ((one_more, 0.76, 0.74), (ripple, 0.95, 0.85)):
        assert replaces(trial(candidate=candidate, share_of_all=0.01, share_of_rest=enough), simple, SETTINGS)
        assert not replaces(trial(candidate=candidate, share_of_all=0.01, share_of_rest=too_little), simple, SETTINGS)


def test_an_effect_far_beyond_its_usual_size_is_not_believed() -> None:
    trial = found_in(RUBBING).trials["try_x_axis_coulomb_friction"][0]
    assert not believable(trial, dataclasses.replace(SETTINGS, largest_size=0.01), null_maximum=0.0)


@pytest.mark.parametrize(
    ("effect", "values", "believed"),
    [
        (ViscousWarmUp, {"change": 5.0, "time_constant": 10.0}, True),
        (ViscousWarmUp, {"change": 5.0, "time_constant": 1e-3}, False),
        (AxialResonance, {"table_share": 0.4, "frequency": 50.0, "damping": 0.03, "motor_friction": 0.0}, True),
        (AxialResonance, {"table_share": 0.4, "frequency": 50.0, "damping": 1e-6, "motor_friction": 0.3}, False),
    ],
)
def test_a_value_far_below_its_usual_range_is_a_constant_in_disguise(
    effect: type[Effect], values: dict[str, float], believed: bool
) -> None:
    """Nothing of the friction need be on the motor side, and a warm-up takes more than a millisecond."""
    (experiment,) = experiments(recording(RUBBING), effects=(effect,))
    (candidate,) = experiment.candidates
    fitted = dataclasses.replace(
        found_in(RUBBING).model.fitted, constant={f"{candidate.part}.{name}": value for name, value in values.items()}
    )
    sure = trial(candidate=candidate, model=dataclasses.replace(found_in(RUBBING).model, candidates=(candidate,), fitted=fitted))
    assert believable(sure, SETTINGS, null_maximum=0.0) is believed


def test_an_effect_that_needs_a_value_beyond_belief_is_refused() -> None:
    """Values that were near what the lesson says before an effect came in, and are as far off as it may be after, speak against it."""
    fitted = search(*pair(Hidden())).model.fitted
    mass = next(place for place, item in enumerate(fitted.free) if item.name == "x_axis.mass")
    item = fitted.free[mass]
    far = dataclasses.replace(fitted, values=np.where(np.arange(len(fitted.values)) == mass, item.high, fitted.values))
    assert becomes_implausible(fitted, far)
    assert not becomes_implausible(far, far)
    assert not becomes_implausible(far, fitted)


def test_a_candidate_that_was_tried_in_several_ways_is_told_once() -> None:
    experiment, validation = pair(RUBBING)
    found = found_in(RUBBING)
    found = dataclasses.replace(found, tried=[*found.tried, *found.tried])
    own = compared(validation, found.baseline.validation_fit.by_name, found.model.validation_fit.by_name)
    told = [name for name, _, _ in gather(experiment, validation, found, own).tried]
    assert "CoulombFriction at x_axis" in told
    assert len(told) == len(set(told))
