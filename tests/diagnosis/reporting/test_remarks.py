"""Sentences of an answer, and when a value that is impossible is no answer."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from lathesim.diagnosis.method import STANDARD
from lathesim.diagnosis.pruning import hardly_missed
from lathesim.diagnosis.records.diagnosis import BaselineValue, ChannelFit, Evidence, FoundEffect, MissingSignal, VariableBar
from lathesim.diagnosis.reporting.remarks import not_determined, not_shown, value_instead
from lathesim.diagnosis.verdict import adequacy as judging
from lathesim.diagnosis.verdict.adequacy import Adequacy, adequacy, redundant_sensors
from lathesim.diagnosis.verdict.judged import Judged
from lathesim.diagnosis.verdict.residual_tests import sensors_apart
from lathesim.identification.estimation.estimates import Estimate, Estimates
from tests.diagnosis.stand_ins import effect_of

MAIN, PRESSURE = "dynamometer.main", "cutting.specific_force"
BASELINE = {PRESSURE: BaselineValue("N/m^2", 8.5e8, 1.05e9, 1.05e9)}


def test_a_value_that_is_impossible_is_told_with_what_it_does() -> None:
    (whole,) = value_instead((PRESSURE,), BASELINE, whole=True)
    assert whole.startswith(
        f"{PRESSURE} of 1.05e+09 N/m^2 (+24%) explains by itself what is missing, though the lesson holds it impossible."
    )
    (part,) = value_instead((PRESSURE, "cutting.width"), BASELINE, whole=False)
    assert "takes away a part of what is missing, and not the whole" in part
    assert "; so would another value of cutting.width." in part
    assert value_instead((), BASELINE, whole=True) == []


def test_a_tie_without_an_experiment_ends_with_its_sentence() -> None:
    effect = FoundEffect("StribeckFriction", "x_axis", "reversal", 1.0, {}, tied_with=("x_axis.viscous",), separating_experiment=None)
    (sentence,) = not_determined((effect,))
    assert sentence == "StribeckFriction cannot be told from x_axis.viscous here; the lines to paste hold StribeckFriction."


def test_an_effect_that_is_tied_with_itself_at_another_sensor_is_told_with_its_place() -> None:
    effect = FoundEffect(
        "LostCounts",
        "x_scale",
        "encoder",
        0.5,
        {},
        tied_with=("LostCounts at x_encoder",),
        separating_experiment="Return to the index mark.",
    )
    (sentence,) = not_determined((effect,))
    assert sentence == (
        "LostCounts at x_scale cannot be told from LostCounts at x_encoder here; the lines to paste hold LostCounts at x_scale. "
        "Return to the index mark."
    )


def test_a_value_that_no_channel_shows_is_said_to_be_one() -> None:
    slopes = np.array([[[0.0, 1e-5]], [[0.0, 1e-2]], [[0.0, 0.0]]])
    fitted: Any = SimpleNamespace(names=["tachometer.gain", "spindle.inertia", "spindle.speed"], sensitivity=slopes)
    (sentence,) = not_shown(fitted, {"tachometer.gain": 1.0, "spindle.inertia": 1.0}, np.array([0.1]))
    assert sentence.startswith("tachometer.gain moves nothing that is compared")


def judge(monkeypatch: pytest.MonkeyPatch, taken: float, after: float, *, far_off: tuple[str, ...] = (), effects: int = 0) -> Adequacy:
    """Judge a model that needs the pressure of the chip further off than the lesson holds possible."""
    monkeypatch.setattr(judging, "narrow_bands", lambda *given, **_: [])
    monkeypatch.setattr(judging, "removed_in_band", lambda found, **_: taken)
    monkeypatch.setattr(judging, "off_by_chance", lambda *given, **_: set())
    signal = np.ones(4)
    missing = MissingSignal(MAIN, "N", signal, signal, after * signal, 10.0 * signal, 0.13, after)
    own: Any = SimpleNamespace(fit={MAIN: ChannelFit("N", 1.7, 55.0, 25.0, "held out")})
    sensed = SimpleNamespace(redundant_sensors=())
    experiment: Any = SimpleNamespace(machine=SimpleNamespace(compare=(MAIN,), uncertain={PRESSURE: 1e7}), feeds_back=True, sensed=sensed)
    effect = SimpleNamespace(
        parameters=("an effect.size",), neutral=(0.0,), part="an effect", name="Lag", at="x", effect=effect_of("lag", neutral={"size": 0.0})
    )
    nothing = SimpleNamespace(by_name={})
    model = SimpleNamespace(candidates=(effect,) * effects, validation_fit=nothing, fitted=nothing)
    found: Any = SimpleNamespace(model=model, far_off=far_off, values_off=far_off, jointly_off=())
    evidence = Evidence(missing=(missing,))
    return adequacy(
        experiment,
        experiment,
        found,
        evidence,
        own,
        BASELINE,
        taken,
        [],
        Estimates({"an effect.size": Estimate(1.0, 0.01, 0.01)}, 1.0, 0.0),
    )


@pytest.mark.parametrize(("after", "taken", "enough"), [(0.12, 0.84, False), (0.01, 0.84, True), (0.12, 0.95, True)])
def test_a_value_that_is_impossible_has_to_explain_what_it_is_believed_for(
    after: float, taken: float, enough: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A force that remembers the feed was taken for another pressure of the chip, with an eighth of the force still missing."""
    assert judge(monkeypatch, taken, after, far_off=(PRESSURE,)).adequate == enough


@pytest.mark.parametrize(("taken", "credited"), [(0.97, True), (0.84, False)])
def test_effects_that_need_an_impossible_machine_and_leave_much_are_credited_with_nothing(
    taken: float, credited: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    judged = judge(monkeypatch, taken, 0.01, effects=1)
    assert judged.implausible == (PRESSURE,)
    discredited = [test.name for test in judged.tests if not test.passed and test.severity == "discredits"]
    assert discredited == ([] if credited else ["possible machine"])


@pytest.mark.parametrize(("floors", "told"), [(10.0, False), (1000.0, True)])
def test_two_sensors_that_differ_by_far_more_than_both_resolve_are_told(floors: float, told: bool) -> None:
    """A logger gave blocks of a scale twice: millimetres, and yet a small share of the way."""
    sight = SimpleNamespace(row=1, first=0, rate=False)
    plan = SimpleNamespace(unit=lambda name: "m")
    sensed = SimpleNamespace(redundant_sensors=(sight,), seen_floors=np.array([1e-7, 1e-7]), plan=plan, channels=("a", "b"))
    experiment: Any = SimpleNamespace(machine=SimpleNamespace(compare=("x_encoder.position", "x_scale.position")), sensed=sensed)
    fitted = SimpleNamespace(residual=np.array([np.zeros(100), np.full(100, floors * 1e-7)]))
    found: Any = SimpleNamespace(model=SimpleNamespace(validation_fit=fitted))
    (test,) = sensors_apart(Judged(sensors=redundant_sensors(experiment, found)), STANDARD)
    assert test.passed != told
    assert not told or [test.sentence] == ["x_scale.position and x_encoder.position differ by 0.1 mm (root mean square)"]


@pytest.mark.parametrize(
    ("share", "followed", "hardly"),
    [(0.3, 0.5, False), (0.005, 0.5, True), (0.3, 0.0, True)],
    ids=["much that follows the motion", "little", "much noise"],
)
def test_what_was_little_of_all_that_acts_was_hardly_missed(share: float, followed: float, hardly: bool) -> None:
    signal = np.ones(4)
    missing = MissingSignal(MAIN, "N", signal, signal, signal, signal, share, share)
    evidence = Evidence(missing=(missing,), bars=(VariableBar(MAIN, "time", followed, 0.0),))
    assert hardly_missed(evidence, (MAIN,)) == hardly
    assert hardly_missed(evidence, (MAIN,), "dynamometer") == hardly
    # where no force was looked at nothing is known
    assert not hardly_missed(evidence, (MAIN,), "x_axis")
