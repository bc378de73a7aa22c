"""A decision is repeated with shaken limits: how often it stands, and on which limit it hinges."""

from dataclasses import replace

import pytest

from lathesim.diagnosis.method import STANDARD
from lathesim.diagnosis.records.residual_test import Condition, Criterion, ResidualTest, all_of, held
from lathesim.diagnosis.verdict.grounds import Grounds
from lathesim.diagnosis.verdict.stability import OTHER_EFFECTS, stability

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
