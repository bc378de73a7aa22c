"""The decision: what the catalogue does not explain is unknown, and what comes nearest to it is told with it."""

from dataclasses import replace

import pytest

from lathesim.diagnosis.records.residual_test import Condition, Criterion, ResidualTest, all_of
from lathesim.diagnosis.verdict.decision import CLOSEST, decide, sentence_of
from lathesim.diagnosis.verdict.grounds import Grounds
from tests.diagnosis.sample_diagnoses import COULOMB

NEVER = all_of(Condition(0.0, ">", 1.0, "", ""))
FAILED = ResidualTest("form of what is left", "x", Criterion(), "a fifth is left and goes with the speed")
FOUND = Grounds(effects=True, tests=(FAILED,), explains=Criterion(), first_may_be_zero=None, moved=NEVER, at_first=frozenset("x"))


def test_effects_that_leave_what_nothing_explains_are_the_closest_of_the_catalogue() -> None:
    """An eddy-current brake is no dry friction, and a dry friction comes nearest to it."""
    rule = decide(FOUND)
    assert (rule.verdict, rule.reason) == ("unknown", CLOSEST)
    assert sentence_of(rule, (COULOMB,), ()) == (
        "Physics is missing that the catalogue does not explain. Closest to it is CoulombFriction at x_axis."
    )
    two = (COULOMB, replace(COULOMB, effect="ForceOffset", tied_with=("ConverterOffset",)))
    assert sentence_of(rule, two, ()).endswith(
        "Closest to it are CoulombFriction at x_axis and ForceOffset at x_axis (or ConverterOffset)."
    )


@pytest.mark.parametrize(
    "other",
    [
        replace(FOUND, rest_explained=True),
        replace(FOUND, tests=(replace(FAILED, severity="weakens"),)),
        replace(FOUND, tests=()),
        replace(FOUND, tests=(replace(FAILED, channel="y"),)),
    ],
    ids=["a further effect explains what is left", "sizes are open", "nothing is left", "what is left is at another place"],
)
def test_effects_are_named_where_the_catalogue_explains_the_rest(other: Grounds) -> None:
    rule = decide(other)
    assert rule.verdict == "named"
    assert sentence_of(rule, (COULOMB,), ()) == "The simulation left out CoulombFriction at x_axis."


def test_effects_that_explain_too_little_are_not_called_closest() -> None:
    rule = decide(replace(FOUND, explains=NEVER))
    assert rule.reason != CLOSEST
    assert sentence_of(rule, (COULOMB,), ()) == "Physics is missing that the catalogue does not explain."
