"""Scores of the suite: what an answer is worth, how the runner keeps answers, and the table made of them."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import pytest

from tests.diagnosis.suite.runner import Job, answer_file, chosen, read_answer, run
from tests.diagnosis.suite.scoring import score
from tests.diagnosis.suite.table import as_markdown, misses, quantile_interval, rows, wilson


def hidden(effect: str = "CoulombFriction", *, at: str = "x_axis", size: float = 10.0, **more: Any) -> dict[str, Any]:
    """Return an effect as the truth of a case has it."""
    sizes = {recording: {"plain": {}, "refitted": {}, "largest": size} for recording in more.pop("recordings", ("fit",))}
    told = {"key": effect.lower(), "effect": effect, "families": ["reversal"], "at": at, "right": [effect], "data": False, "parameters": {}}
    return {**told, "size": sizes, **more}


def truth(category: str, *effects: dict[str, Any], fault: dict[str, Any] | None = None) -> dict[str, Any]:
    """Return the truth of a case of an axis with command and encoder."""
    outputs = {"command": "x_controller.voltage", "encoder": "x_encoder.position"}
    floors = {"validate": {"command": 0.1, "encoder": 1e-6}}
    return {"rig": "axis", "category": category, "effects": list(effects), "fault": fault, "poor": "", "outputs": outputs,
            "floors": floors, "recordings": ["fit", "validate"]}  # fmt: skip


def given(effect: str, *, ties: tuple[str, ...] = (), probability: float = 0.95, family: str = "reversal", **more: Any) -> dict[str, Any]:
    """Return an effect as an answer has it."""
    return {"effect": effect, "at": "x_axis", "family": family, "probability": probability, "tied_with": list(ties), **more}


def told(verdict: str, *effects: dict[str, Any], second: dict[str, Any] | None = None, **more: Any) -> dict[str, Any]:
    """Return what the runner keeps of an answer."""
    answer = {"verdict": verdict, "effects": list(effects), "adequate": True, "wall_time_s": 8.0, **more}
    kept = {"seconds": 9.0, "exit_code": 0, "error": "", "answer": answer}
    return kept if second is None else {**kept, "second": second}


NO_ANSWER = {"seconds": 300.0, "exit_code": None, "error": "no answer within 300 s", "answer": {}}


def test_name_where_nothing_is_hidden_is_a_false_alarm() -> None:
    assert score("c", truth("control"), told("named", given("Backlash"))).false_alarm
    assert score("c", truth("parameters"), told("tied", given("Backlash", ties=("PreslidingFriction",)))).false_alarm


def test_quiet_answer_is_none_and_unknown_is_not_quiet() -> None:
    assert score("c", truth("control"), told("parameters_only")).quiet
    unknown = score("c", truth("control"), told("unknown"))
    assert (unknown.false_alarm, unknown.quiet) == (False, False)


def test_right_name_first_counts() -> None:
    made = score("c", truth("single", hidden()), told("named", given("CoulombFriction")))
    assert (made.first_right, made.family_right, made.place_right, made.by_tie) == (True, True, True, False)
    assert made.missed == []


def test_tie_with_the_truth_counts_and_is_marked() -> None:
    made = score("c", truth("single", hidden()), told("tied", given("PreslidingFriction", ties=("CoulombFriction",))))
    assert made.first_right and made.by_tie


def test_other_name_of_the_family_is_only_the_family() -> None:
    made = score("c", truth("single", hidden()), told("named", given("PreslidingFriction")))
    assert (made.first_right, made.family_right) == (False, True)
    assert made.missed == ["first right"]


@pytest.mark.parametrize("answer", [told("no_mismatch"), told("unknown", given("CoulombFriction")), NO_ANSWER])
def test_answer_without_a_name_misses(answer: dict[str, Any]) -> None:
    assert score("c", truth("single", hidden()), answer).first_right is False


def test_name_too_many_is_a_miss_of_its_own() -> None:
    made = score("c", truth("single", hidden()), told("named", given("CoulombFriction"), given("Cogging")))
    assert made.first_right
    assert made.missed == ["none too many"]


def test_the_mean_that_an_uneven_friction_has_is_no_name_too_many() -> None:
    uneven = hidden("PositionDependentFriction", mean="CoulombFriction")
    both = told("named", given("CoulombFriction"), given("PositionDependentFriction"))
    made = score("c", truth("single", uneven), both)
    assert (made.first_right, made.none_too_many) == (True, True)
    assert score("c", truth("single", uneven), told("named", given("CoulombFriction"))).first_right is False
    assert score("c", truth("single", hidden("PositionDependentFriction", mean="")), both).first_right is False


def test_effect_below_three_floors_need_not_be_found() -> None:
    made = score("c", truth("single", hidden(size=2.0)), told("no_mismatch"))
    assert made.first_right is None and not made.asked and not made.missed


def test_pair_is_exact_with_both_names_and_no_other() -> None:
    case = truth("pair", hidden(), hidden("ForceOffset"))
    assert score("c", case, told("named", given("ForceOffset"), given("CoulombFriction"))).exact
    assert not score("c", case, told("named", given("CoulombFriction"))).exact
    more = score("c", case, told("named", given("CoulombFriction"), given("ForceOffset"), given("Backlash")))
    assert more.first_right and not more.exact


def test_pair_with_a_small_effect_is_not_asked_to_be_exact() -> None:
    made = score("c", truth("pair", hidden(), hidden("ForceOffset", size=1.0)), told("named", given("CoulombFriction")))
    assert made.first_right and made.exact is None


def test_outside_the_catalogue_only_a_sure_and_complete_name_is_wrong() -> None:
    case = truth("outside", hidden("", key="drag", right=[], families=[]))
    assert not score("c", case, told("named", given("ViscousFriction"))).outside_not_named
    assert score("c", case, told("named", given("ViscousFriction", probability=0.6))).outside_not_named
    assert score("c", case, told("named", given("ViscousFriction"), adequate=False)).outside_not_named
    assert score("c", case, told("unknown")).outside_reported
    assert not score("c", case, told("no_mismatch")).outside_reported


def test_fault_needs_verdict_channel_and_kind() -> None:
    case = truth("fault", fault={"kind": "frozen", "channel": "encoder", "outputs": ["x_encoder.position"], "words": "frozen|stuck"})
    assert score("c", case, told("recording_fault", sentence="x_encoder.position is stuck from 3 s to 5 s.")).fault_named
    assert not score("c", case, told("recording_fault", sentence="x_controller.voltage is stuck.")).fault_named
    assert not score("c", case, told("recording_fault", sentence="x_encoder.position is late.")).fault_named
    assert not score("c", case, told("unknown", sentence="x_encoder.position is stuck.")).fault_named


def test_data_called_at_fault_is_right_where_the_data_are() -> None:
    case = truth("single", hidden("ClockSkew", at="x_scale", data=True))
    assert score("c", case, told("recording_fault", sentence="The clock of x_scale.position runs off.")).first_right
    assert not score("c", case, told("recording_fault", sentence="The clock of x_encoder.position runs off.")).first_right


def test_poor_recording_is_resolved_by_the_experiment() -> None:
    case = truth("poor", hidden(recordings=("fit", "resolve")))
    family = given("PreslidingFriction", separating_experiment="creep both ways")
    resolved = score("c", case, told("named", family, second=told("named", given("CoulombFriction"))))
    assert resolved.poor_family and resolved.poor_resolved
    wrong = score("c", case, told("named", family, second=told("named", given("PreslidingFriction"))))
    assert wrong.poor_family and not wrong.poor_resolved


def test_parameters_are_held_against_the_truth() -> None:
    level = {"level": {"value": 20.0, "unit": "N"}}
    near = {"level": {"value": 20.4, "unit": "N", "low": 20.1, "high": 20.7}}
    made = score("c", truth("single", hidden(parameters=level)), told("named", given("CoulombFriction", parameters=near)))
    assert made.parameter_errors == pytest.approx([0.02])
    assert made.covered == [False]


def test_removed_share_is_what_is_above_the_true_noise() -> None:
    fit = {"x_encoder.position": {"before": 11e-6, "after": 2e-6}, "x_controller.voltage": {"before": 0.1, "after": 0.09}}
    made = score("c", truth("single", hidden()), told("named", given("CoulombFriction"), fit=fit))
    assert made.removed == pytest.approx(1.0 - 3.0 / 120.0)


def test_what_a_load_hides_in_both_of_two_channels_is_seen_in_their_difference() -> None:
    case = truth("single", hidden()) | {
        "outputs": {"encoder": "x_encoder.position", "scale": "x_scale.position"},
        "floors": {"validate": {"encoder": 1e-6, "scale": 1e-6, "scale-encoder": 1e-7}},
    }
    fit = {"x_encoder.position": {"before": 1e-6, "after": 1e-6}, "x_scale.position": {"before": 2e-6, "after": 1e-6}}
    missing = [{"at": "x_scale.position", "before": 1.1e-6, "after": 2e-7}, {"at": "x_axis.disturbance", "before": 3.0, "after": 3.0}]
    made = score("c", case, told("named", given("CoulombFriction"), fit=fit, missing=missing))
    assert made.removed == pytest.approx(1.0 - 3.0 / (3.0 + 120.0))


def test_wilson_interval_of_nothing_seen() -> None:
    assert wilson(0, 60) == pytest.approx((0.0, 0.0602), abs=1e-3)
    assert wilson(9, 10) == pytest.approx((0.596, 0.982), abs=1e-3)


def test_interval_of_a_median_comes_from_the_ordered_values() -> None:
    low, high = quantile_interval(list(range(100)), 0.5)
    assert (low, high) == (39, 60)
    assert quantile_interval([1.0, 2.0], 0.5) == (float("-inf"), float("inf"))


def test_table_holds_measured_beside_asked_and_every_miss() -> None:
    scores = [
        score("case_000", truth("control"), told("no_mismatch")),
        score("case_001", truth("single", hidden()), told("named", given("Backlash", family="reversal"))),
        score("case_002", truth("single", hidden()), told("named", given("CoulombFriction"))),
    ]
    by_question = {row.question: row for row in rows(scores)}
    first = by_question["right name first, effect of 3 floors or more"]
    assert (first.asked, first.measured, first.over, first.met) == ("95 %", "50.0%", "1/2", False)
    assert by_question["false alarms: a name where nothing is hidden"].met
    assert by_question["recording faults named"].measured == "-"
    (miss,) = misses(scores)
    assert "case_001" in miss and "Backlash" in miss and "CoulombFriction (10 floors)" in miss
    assert miss in as_markdown(scores)


def answered(job: Job) -> None:
    """Stand in for the program: dies, hangs, fails or answers by the name of the case."""
    case = Path(job.folder).name
    if case == "case_001":
        time.sleep(60.0)
    if case == "case_002":
        raise ValueError("a fault of the stand-in")
    Path(job.answer).write_text(json.dumps(told("no_mismatch")), encoding="utf-8")


@pytest.fixture
def cases(tmp_path: Path) -> Path:
    """Return a folder with three controls."""
    for number in range(3):
        (tmp_path / f"case_{number:03d}").mkdir()
        (tmp_path / f"case_{number:03d}" / "truth.json").write_text(json.dumps(truth("control")), encoding="utf-8")
    return tmp_path


@pytest.mark.slow
def test_runner_outlives_a_case_that_hangs_or_fails(cases: Path, tmp_path: Path) -> None:
    answers, lines = tmp_path / "answers", []
    run(chosen(cases), answers, limit=3.0, work=answered, tell=lines.append)
    assert [len(lines), sum("right" in line for line in lines)] == [3, 1]
    hung, failed = read_answer(answers, "case_001"), read_answer(answers, "case_002")
    assert hung is not None and failed is not None
    assert "no answer within" in hung["error"]
    assert "a fault of the stand-in" in failed["error"]


def test_resumed_run_asks_only_what_has_no_answer(cases: Path, tmp_path: Path) -> None:
    answers, lines = tmp_path / "answers", []
    answers.mkdir()
    for case in ("case_000", "case_001", "case_002"):
        answer_file(answers, case).write_text(json.dumps(told("no_mismatch")), encoding="utf-8")
    run(chosen(cases), answers, resume=True, tell=lines.append)
    assert lines == []


def test_cases_are_chosen_by_rig_category_and_what_is_hidden(cases: Path) -> None:
    (cases / "case_001" / "truth.json").write_text(json.dumps(truth("single", hidden(key="coulomb"))), encoding="utf-8")
    assert [folder.name for folder in chosen(cases, "axis/single")] == ["case_001"]
    assert [folder.name for folder in chosen(cases, "coulomb")] == ["case_001"]
    assert [folder.name for folder in chosen(cases, number=2)] == ["case_000", "case_001"]
