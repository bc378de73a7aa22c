"""The gates of the calibration: what they measure on draws made up, and that the stored draws can be judged."""

import numpy as np
import pytest

from tests.diagnosis.calibration.__main__ import STORED, main
from tests.diagnosis.calibration.draws import Draw, append, read, shortened
from tests.diagnosis.calibration.gates import gates

MASS = 40.0
MISSED = {"intervals hold the truth", "ranks of the truth are uniform", "names in a tied set"}
"""Gates that the stored draws miss: none may be added, and one that is met goes."""


def draw(*, hidden=(), verdict="no_mismatch", effects=(), baseline=None, kind="sound"):
    told = {"verdict": verdict, "adequate": True, "effects": list(effects), "baseline": baseline or {}}
    return Draw("made up", "one", kind, tuple(hidden), {"x_axis.mass": MASS, "CoulombFriction.level": 3.0}, told, 1.0)


def friction(*, value=3.0, low=2.0, high=4.0, tied_with=()):
    return {"effect": "CoulombFriction", "at": "x_axis", "tied_with": list(tied_with), "parameters": {"level": [value, low, high]}}


def estimated(error, deviation):
    return draw(baseline={"x_axis.mass": [MASS + error, MASS + error - 1.96 * deviation, MASS + error + 1.96 * deviation]})


def measured(draws):
    return {one.gate: one for one in gates(draws)}


@pytest.mark.parametrize(("told", "met"), [(1.0, True), (0.6, False), (2.0, False)])
def test_ranks_are_uniform_only_where_intervals_are_as_wide_as_errors(told, met):
    rng = np.random.default_rng(4)
    found = measured([estimated(error, told) for error in rng.standard_normal(400)])
    assert found["ranks of the truth are uniform"].met is met
    assert found["intervals hold the truth"].met is met


def test_a_tied_set_counts_the_name_and_what_it_is_tied_with():
    ties = [friction(tied_with=["PreslidingFriction at x_axis"])], [friction()]
    draws = [draw(hidden=[("PreslidingFriction",)], verdict="tied", effects=one, kind="single") for one in ties]
    found = measured(draws)
    assert found["the tied set holds the effect"].measured.startswith("50.0 %")
    assert found["names in a tied set"].measured == "1.50"


def test_an_answer_without_a_name_holds_no_effect_and_a_doubt_about_a_sound_machine_is_a_false_alarm():
    found = measured([draw(hidden=[("CoulombFriction",)], verdict="unknown", effects=[friction()], kind="single"), draw(verdict="unknown")])
    assert not found["the tied set holds the effect"].met
    assert found["sound machines called sound"].measured.startswith("0.0 %")


def test_sizes_of_a_wrong_effect_count_for_no_interval():
    wrong = draw(hidden=[("ForceOffset",)], verdict="named", effects=[friction(value=9.0, low=8.0, high=10.0)], kind="single")
    assert measured([wrong])["intervals hold the truth"].count == 0
    right = draw(hidden=[("CoulombFriction",)], verdict="named", effects=[friction(value=9.0, low=8.0, high=10.0)], kind="single")
    assert measured([right])["intervals hold the truth"].measured.startswith("0.0 %")


def test_draws_are_kept_as_they_are(tmp_path):
    level = {"value": 3.0, "unit": "N", "low": 2.0, "high": 4.0}
    effects = [{"effect": "CoulombFriction", "at": "x_axis", "tied_with": [], "parameters": {"level": level}}]
    baseline = {"x_axis.mass": {"refit_with": 41.0, "low": 40.0, "high": 42.0}}
    told = shortened({"verdict": "named", "adequate": True, "effects": effects, "baseline": baseline})
    kept = Draw("made up", "one", "single", (("CoulombFriction",),), {"x_axis.mass": MASS}, told, 1.5)
    append(tmp_path / "draws.jsonl", [kept])
    assert read(tmp_path / "draws.jsonl") == [kept]
    assert told["baseline"] == {"x_axis.mass": [41.0, 40.0, 42.0]}


def test_the_stored_draws_meet_the_gates_that_are_met(capsys):
    assert main([]) == int(bool(MISSED))
    shown = capsys.readouterr().out
    assert all(f"{sum(draw.source == source for draw in read(STORED))} draws" in shown for source in ("rigs", "table"))
    assert {one.gate for one in gates(read(STORED)) if not one.met} == MISSED
