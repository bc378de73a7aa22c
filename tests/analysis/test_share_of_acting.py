"""Shares of what acts: none where next to nothing acts."""

import math

import pytest

from lathesim.analysis.share_of_acting import shares_beside, still_missing_at


@pytest.mark.parametrize(
    ("before", "after", "text"),
    [
        (0.173, 0.031, ", 17.3% of what acts there, and 3.1% after"),
        (0.469, 6138.365, ", 46.9% of what acts there"),
        (6138.365, 0.1, ""),
        (math.nan, math.inf, ""),
    ],
)
def test_shares_before_and_after(before: float, after: float, text: str) -> None:
    assert shares_beside(before, after) == text


def test_what_is_still_missing() -> None:
    assert still_missing_at("x_axis.force", 0.123, digits=1) == "12.3% of what acts at x_axis.force is still missing"
    assert still_missing_at("x_axis.force", 6138.365, digits=0) == "something is still missing at x_axis.force, where next to nothing acts"
