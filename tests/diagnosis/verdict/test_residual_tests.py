"""A model that is named and not adequate says why, in one sentence, wherever the answer is read."""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lathesim.diagnosis.location.missing_share import next_to_nothing
from lathesim.diagnosis.location.narrow_band import NarrowBand
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.pruning import degrades_a_channel
from lathesim.diagnosis.records.diagnosis import BaselineValue, ChannelFit, Evidence, MissingSignal, VariableBar
from lathesim.diagnosis.records.residual_test import ResidualTest
from lathesim.diagnosis.verdict.judged import Judged, ValueOff, structured_share
from lathesim.diagnosis.verdict.replicate_check import DEPENDENCE
from lathesim.diagnosis.verdict.residual_tests import (
    another_form,
    effects_leave_much,
    every_channel_worse,
    force_follows_motion,
    force_is_missing,
    not_adequate,
    removes_nothing,
    removes_too_little,
    residual_tests,
    value_leaves_form,
)
from tests.diagnosis.pushed_table import POSITION

FIT = {POSITION: ChannelFit("m", 1e-7, 5e-6, 2e-6, "held out")}


def evidence(share_after: float, explained: float) -> Evidence:
    signal = np.zeros(3)
    missing = MissingSignal("x_axis.disturbance", "N", signal, signal, signal, signal, 0.5, share_after)
    bars = (VariableBar(POSITION, "velocity of x_axis", 0.9, explained), VariableBar(POSITION, "time", 0.1, 0.0))
    return Evidence(bars=bars, missing=(missing,))


def judged(found: Evidence, **facts: Any) -> Judged:
    return Judged(**{"channels": (POSITION,), "evidence": found, "fit": FIT, **facts})


def failed(test: Callable[[Judged, Method], Iterator[ResidualTest]], asked: Judged) -> list[str]:
    """Return why a test fails."""
    return [one.sentence for one in test(asked, STANDARD) if not one.passed]


@pytest.mark.parametrize(("probability", "told"), [(0.3, False), (0.01, True)], ids=["as errors of laws leave", "more than they leave"])
def test_what_replicates_with_errors_of_laws_leave_too_is_no_doubt(probability: float, told: bool) -> None:
    asked = judged(evidence(0.1, 0.81), probabilities={(DEPENDENCE, POSITION): probability}, replicates=50)
    assert bool(failed(force_follows_motion, asked)) == told
    assert bool(failed(force_follows_motion, replace(asked, effects=True))) == told


@pytest.mark.parametrize(
    ("share_after", "explained", "told"),
    [(0.1, 0.0, 0.0), (0.1, 0.81, 0.09), (0.0, 0.9, 0.0), (math.nan, 0.9, 0.0)],
    ids=["noise alone", "a pattern", "nothing left", "nothing acts there"],
)
def test_only_what_has_a_pattern_makes_a_model_inadequate(share_after: float, explained: float, told: float) -> None:
    assert structured_share(explained, share_after) == pytest.approx(told)
    assert bool(failed(force_follows_motion, judged(evidence(share_after, explained)))) == (told > 0.01)


@pytest.mark.parametrize(("floors", "told"), [(1.1, False), (8.0, True)], ids=["at the floor", "off"])
def test_more_than_all_that_acts_is_missing_where_noise_is_made_into_a_force(floors: float, told: bool) -> None:
    """The noise of a tachometer, as a torque, was three times what turns the spindle of a sound lathe, and went with its acceleration."""
    fit = {POSITION: replace(FIT[POSITION], after=floors * FIT[POSITION].floor)}
    assert bool(failed(force_follows_motion, judged(evidence(3.0, 0.4), fit=fit))) == told
    assert failed(force_follows_motion, judged(evidence(0.5, 0.4), fit=fit))


@pytest.mark.parametrize(
    ("share_after", "taken", "told"),
    [(0.4, 0.3, True), (0.2, 0.3, False), (0.4, 0.6, False), (0.2, -0.1, True)],
    ids=["most is left", "noise hides how much is gone", "most is gone", "nothing is gone"],
)
def test_effects_that_take_away_little_are_not_all_there_is(share_after: float, taken: float, told: bool) -> None:
    asked = judged(evidence(share_after, 0.0), effects=True, removed=taken)
    assert bool(failed(removes_too_little, asked) or failed(removes_nothing, asked)) == told


@pytest.mark.parametrize(
    ("acts", "before", "after", "told"),
    [(0.004, 0.2, 0.0, False), (0.004, 0.2, 0.05, True), (0.004, 0.02, 0.0, True), (0.4, 0.2, 0.0, True)],
    ids=["all that followed the motion is gone", "some follows it still", "nothing followed it", "much of what acts is left"],
)
def test_a_line_beside_a_load_that_wanders_far_is_all_that_followed_the_motion(
    acts: float, before: float, after: float, told: bool
) -> None:
    found = evidence(acts, 0.0)
    found = replace(found, missing=(replace(found.missing[0], share_before=1.5 * acts),))
    found = replace(found, bars=(VariableBar(POSITION, "position of spindle", before, after),))
    assert bool(failed(removes_too_little, judged(found, effects=True, removed=0.004))) == told


def test_a_ripple_beside_a_load_that_wanders_far_is_a_name_though_the_band_of_the_motion_did_not_show_it() -> None:
    found = evidence(0.004, 0.0)
    unseen = replace(found, missing=(replace(found.missing[0], share_before=0.005),), bars=(VariableBar(POSITION, "time", 0.0, 0.0),))
    assert failed(removes_too_little, judged(unseen, effects=True, removed=0.34))
    assert not failed(removes_too_little, judged(unseen, effects=True, removed=0.34, waves=True))


@pytest.mark.parametrize(
    ("share", "over_floor", "told"),
    [(0.31, 137.0, True), (0.31, 1.1, False), (0.07, 90.0, False), (math.nan, 90.0, False), (math.inf, 90.0, True), (math.inf, 1.1, False)],
    ids=["a force", "noise of a coarse sensor", "a small load that nobody measured", "nothing", "beside nothing", "noise beside nothing"],
)
def test_where_much_is_missing_something_is_though_it_follows_nothing(share: float, over_floor: float, told: bool) -> None:
    """A motor whose iron saturates, with a current that does not show it: a third of the force is missing."""
    off = {POSITION: ChannelFit("m", 1e-6, 2.0 * over_floor * 1e-6, over_floor * 1e-6, "held out")}
    reasons = failed(force_is_missing, judged(evidence(share, 0.0), fit=off))
    finite = "31% of what acts at x_axis.disturbance is still missing"
    sentence = finite if math.isfinite(share) else "something is still missing at x_axis.disturbance, where next to nothing acts"
    assert reasons == ([sentence] if told else [])


@pytest.mark.parametrize(("grows", "told"), [(0.0, False), (0.5, True)], ids=["a load that nobody measured", "physics"])
def test_what_is_as_large_whatever_acts_is_a_load(grows: float, told: bool) -> None:
    """A sound slide was pushed by 30 N that came and went, of 150 N that acted."""
    draw = np.random.default_rng(4)
    acts = draw.uniform(-200.0, 200.0, 6000)
    missing = draw.standard_normal(6000) * (30.0 + grows * np.abs(acts))
    signal = MissingSignal("x_axis.disturbance", "N", np.arange(6000.0), missing, missing, acts, 0.2, 0.2)
    off = {POSITION: ChannelFit("m", 1e-6, 2e-5, 2e-5, "held out")}
    assert bool(failed(force_is_missing, judged(Evidence(missing=(signal,)), fit=off))) == told


@pytest.mark.parametrize(
    ("share_after", "counted", "taken", "told"),
    [(0.2, math.nan, 0.86, True), (0.15, math.nan, 0.86, False), (0.2, 0.15, 0.86, False), (0.2, math.nan, 0.95, False)],
    ids=["much is left", "little is left", "friction at rest holds the rest", "most is gone"],
)
def test_effects_that_leave_much_are_not_all_there_is(share_after: float, counted: float, taken: float, told: bool) -> None:
    """Half of what acts was missing before."""
    found = evidence(share_after, 0.0)
    found = replace(found, missing=(replace(found.missing[0], counted=counted),))
    assert bool(failed(effects_leave_much, judged(found, effects=True, removed=taken))) == told


@pytest.mark.parametrize(
    ("after", "explained", "share"),
    [(0.4, 0.36, 0.24), (0.4, 0.04, 0.08), (0.4, 0.0, None), (0.99, 0.36, None)],
    ids=["another form", "nearly the form", "noise alone", "a channel in which nothing was taken away"],
)
def test_what_an_effect_leaves_in_its_place_says_whether_it_has_the_right_form(after: float, explained: float, share: float | None) -> None:
    signal = np.array([1.0, -1.0, 1.0, -1.0])
    missing = MissingSignal("x_scale.position", "m", signal, 2.0 * signal, 2.0 * after * signal, signal, 2e-4, 2e-4 * after)
    bars = (VariableBar("x_scale.position", "velocity of x_axis", 0.9, explained), VariableBar("x_scale.position", "time", 0.9, 0.0))
    asked = judged(Evidence(bars=bars, missing=(missing,)), channels=("x_scale.position",), effects=True)
    assert [test.statistic for test in another_form(asked, STANDARD)] == ([] if share is None else [pytest.approx(share)])
    told = ["24% of what was missing at x_scale.position is left and goes with velocity of x_axis"]
    assert failed(another_form, asked) == (told if share and share > 0.2 else [])


@pytest.mark.parametrize(("share_after", "told"), [(0.0018, None), (0.018, 0.15)], ids=["as stepping leaves", "a force"])
def test_what_stepping_leaves_of_a_force_is_of_no_other_form(share_after: float, told: float | None) -> None:
    signal = np.ones(4)
    missing = MissingSignal("spindle.disturbance", "N*m", signal, signal, 0.16 * signal, signal, 6.0 * share_after, share_after)
    bars = (VariableBar(POSITION, "acceleration of spindle", 0.9, 0.88),)
    tests = another_form(judged(Evidence(bars=bars, missing=(missing,)), effects=True), STANDARD)
    assert [test.statistic for test in tests] == ([] if told is None else [pytest.approx(told, rel=0.01)])


@pytest.mark.parametrize(
    ("share_after", "explained", "told"),
    [(0.017, 0.55, True), (0.021, 0.18, False), (0.002, 0.9, False)],
    ids=["the wind of a fan", "a load", "as stepping leaves"],
)
def test_a_small_force_that_mostly_follows_the_motion_is_no_load(share_after: float, explained: float, told: bool) -> None:
    reasons = failed(force_follows_motion, judged(evidence(share_after, explained)))
    assert reasons == (["1.7% of what acts at x_axis.disturbance is still missing, and goes with velocity of x_axis"] if told else [])


@pytest.mark.parametrize(
    ("share_after", "explained", "floors", "told"),
    [(0.3, 0.8, 20.0, True), (0.3, 0.2, 20.0, False), (0.1, 0.8, 20.0, False), (0.3, 0.8, 2.0, False)],
    ids=["the square of the speed", "a load", "little", "at the floor"],
)
def test_a_value_that_leaves_much_that_follows_the_motion_is_not_the_answer(
    share_after: float, explained: float, floors: float, told: bool
) -> None:
    fit = {POSITION: ChannelFit("m", 1e-7, 5e-6, floors * 1e-7, "held out")}
    reasons = failed(value_leaves_form, judged(evidence(share_after, explained), fit=fit, value_is_answer=True))
    assert reasons == (["60% of what was missing at x_axis.disturbance is left, and goes with velocity of x_axis"] if told else [])


def test_effects_with_which_every_channel_is_further_off_are_not_believed() -> None:
    worse, better = (ChannelFit("m", 1e-7, 1e-5, after, "held out") for after in (3e-5, 1e-6))
    hardly = ChannelFit("m", 1e-7, 1e-5, 1.1e-5, "held out")
    same = replace(hardly, after=1.01e-5)
    cases = [((worse,), True), ((worse, better), False), ((worse, hardly), True), ((worse, same), False), ((), False)]
    for fits, told in cases:
        fit = dict(zip((POSITION, "x_scale.position"), fits, strict=False))
        assert bool(failed(every_channel_worse, judged(Evidence(), fit=fit, effects=True, feeds_back=True))) == told
        assert not failed(every_channel_worse, judged(Evidence(), fit=fit, effects=True))
    assert degrades_a_channel({POSITION: worse, "x_scale.position": better})
    assert not degrades_a_channel({POSITION: better})


@pytest.mark.parametrize(
    ("before", "after", "read", "nothing"),
    [(0.0015, 0.0005, 1.0, True), (0.02, 0.0005, 1.0, False), (0.0015, 0.0005, 0.5, False), (0.02, 0.02, 1.0, True)],
    ids=["uneven time stamps", "a small friction", "a spring that a scale shows", "nothing is taken away"],
)
def test_what_takes_away_less_of_what_acts_than_a_simulation_leaves_is_next_to_nothing(
    before: float, after: float, read: float, nothing: bool
) -> None:
    signal = np.ones(4)
    force = MissingSignal("q_axis.disturbance", "N*m", signal, signal, signal, signal, before, after)
    current = MissingSignal("q_drive.current", "A", signal, signal, read * signal, signal, 0.7, 0.7 * read)
    assert next_to_nothing([force, current]) == nothing
    assert not next_to_nothing([current])


def test_every_reason_is_told() -> None:
    implausible = ValueOff("x_drive.effort_constant", BaselineValue("N/A", 12.0, 12.0, 12.84), 6.0, 0.1)
    bands = [NarrowBand(POSITION, 55.0, 1e-6, "m", 0.4, 54.0, 56.0), NarrowBand("x_scale.position", 9.0, 1e-6, "m", 0.4, 4.0, 11.0)]
    fit = {**FIT, "x_scale.position": FIT[POSITION]}
    asked = judged(evidence(0.1, 0.81), fit=fit, values=(implausible,), bands=tuple(bands), effects=True, removed=0.95)
    assert not_adequate(residual_tests(asked, STANDARD)) == (
        "The model is not adequate: 10.0% of what acts at x_axis.disturbance is still missing, and goes with velocity of x_axis; "
        "it needs x_drive.effort_constant at 12.84 N/A, further off than the lesson holds possible; "
        "x_encoder.position still swings at 55 Hz; x_scale.position still swings between 4 and 11 Hz."
    )
    assert not_adequate(residual_tests(judged(evidence(0.1, 0.0)), STANDARD)) == ""
