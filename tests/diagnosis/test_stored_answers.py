"""Answers stay as they are: whole answers that were stored are answered again. Numbers may differ as they do between two processors."""

import collections

import pytest

from tests.diagnosis.stored.answers import NAMES, QUICK, REAL, asked, differences, is_here, stored

TOLERANCE = 1e-6
"""``python -m tests.diagnosis.stored`` compares with none, on the machine where the answers were stored."""


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=() if name in QUICK else pytest.mark.slow) for name in NAMES],
)
def test_an_answer_is_as_it_was(name: str) -> None:
    if not is_here(name):
        pytest.skip("the reference data beside the project are not here")
    assert list(differences(stored()[name], asked(name), TOLERANCE)) == []


def test_every_verdict_is_stored() -> None:
    counted = collections.Counter(answer["verdict"] for name, answer in stored().items() if name not in REAL)
    verdicts = ("named", "tied", "unknown", "recording_fault", "no_mismatch", "parameters_only")
    assert set(counted) == set(verdicts)
    assert sum(counted.values()) >= 20


def test_a_difference_is_told_by_its_place() -> None:
    before = {"verdict": "named", "effects": [{"size": 1.0}], "old": None}
    assert list(differences(before, {**before, "new": 3}, 0.0)) == []
    told = list(differences(before, {"verdict": "tied", "effects": [{"size": 1.0 + 1e-9}]}, 0.0))
    assert [text.partition(":")[0] for text in told] == ["answer.verdict", "answer.effects[0].size", "answer.old is gone"]
    assert len(list(differences(before, {"verdict": "named", "effects": [{"size": 1.0 + 1e-9}], "old": None}, 1e-6))) == 0
