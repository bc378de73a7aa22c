"""A decision is repeated with shaken limits: how often it stands, and on which limit it hinges."""

from dataclasses import replace

import pytest

from lathesim.diagnosis.method import STANDARD
from lathesim.diagnosis.records.diagnosis import as_json
from lathesim.diagnosis.records.residual_test import Condition, Criterion, ResidualTest, all_of, held
from lathesim.diagnosis.records.stability import Stability
from lathesim.diagnosis.reporting.html_report import report_html
from lathesim.diagnosis.reporting.terminal_text import answer_lines
from lathesim.diagnosis.verdict.grounds import Grounds
from lathesim.diagnosis.verdict.stability import OTHER_EFFECTS, stability
from tests.diagnosis.sample_diagnoses import NAMED

LIMIT = STANDARD.verdict.within_laws


def force_test(share: float, error: float = 0.0) -> ResidualTest:
    return ResidualTest("force follows the motion", "x", all_of(held(share, ">=", LIMIT, error)), "much is left")


def grounds(*tests: ResidualTest, effects: bool = False, **facts: Criterion) -> Grounds:
    never = all_of(Condition(0.0, ">", 1.0, "", ""))
    return Grounds(effects, tests, facts.get("explains", Criterion()), None, facts.get("moved", never), accepted=(), refused=())


@pytest.mark.parametrize(("share", "alike", "hinges"), [(0.001, 1.0, ()), (0.1, 1.0, ()), (1.01 * LIMIT, 0.5, ("law_error",))])
def test_a_decision_near_its_limit_is_less_stable_than_one_far_from_it(share: float, alike: float, hinges: tuple[str, ...]) -> None:
    found = stability(grounds(force_test(share)))
    assert found.share == pytest.approx(alike, abs=0.1)
    assert found.hinges_on == hinges
    assert sum(found.outcomes.values()) == pytest.approx(1.0)


def test_the_error_of_a_statistic_counts_beside_the_limits() -> None:
    exact, unsure = (stability(grounds(force_test(1.6 * LIMIT, error))) for error in (0.0, 0.8 * LIMIT))
    assert exact.share == 1.0
    assert 0.6 < unsure.share < 0.9
    assert set(unsure.outcomes) == {"unknown", "no_mismatch"}


def test_a_test_that_discredits_takes_the_name_and_one_that_weakens_does_not() -> None:
    for severity, explained, verdict in (
        ("weakens", False, "named"),
        ("fails", True, "named"),
        ("fails", False, "unknown"),
        ("discredits", True, "unknown"),
    ):
        asked = replace(
            grounds(replace(force_test(1.0), severity=severity), effects=True), rest_explained=explained, at_first=frozenset("x")
        )
        assert stability(asked).outcomes == {verdict: 1.0}


def test_an_effect_that_is_hardly_accepted_may_be_another_one() -> None:
    nearly = all_of(held(10.5, ">", STANDARD.margin))
    found = stability(replace(grounds(effects=True), accepted=(nearly,)))
    assert 0.3 < found.outcomes[OTHER_EFFECTS] < 0.7
    assert found.hinges_on == ("margin",)


def test_the_same_answer_has_the_same_stability() -> None:
    asked = grounds(force_test(LIMIT, 0.01))
    assert stability(asked) == stability(asked)


def test_terminal_report_and_json_tell_stability_and_tests() -> None:
    found = Stability(0.97, 200, {"named": 0.97, "unknown": 0.03}, ("law_error",))
    answer = replace(NAMED, stability=found, residual_tests=(force_test(0.001), force_test(0.1)))
    line = "Stability: named in 97% of 200 decisions with shaken limits (unknown in 3%); it hinges on law_error."
    assert line in answer_lines(answer)
    page = report_html(answer)
    assert line in page and "Tests of what is left" in page and "much is left" in page
    told = as_json(answer)
    assert told["stability"] == {"share": 0.97, "decisions": 200, "outcomes": {"named": 0.97, "unknown": 0.03}, "hinges_on": ["law_error"]}
    assert [(test["passed"], test["sentence"]) for test in told["residual_tests"]] == [(True, ""), (False, "much is left")]
    assert told["residual_tests"][0]["conditions"] == [
        [{"name": "law_error", "relation": ">=", "statistic": 0.001, "limit": 0.010268745, "error": 0.0}]
    ]
