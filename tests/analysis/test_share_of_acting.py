"""Shares of what acts: none where next to nothing acts."""

import math

from lathesim.analysis.display_unit import known_share, still_missing_at


def test_what_is_still_missing() -> None:
    assert still_missing_at("x_axis.force", 0.123, digits=1) == "12.3% of what acts at x_axis.force is still missing"
    assert still_missing_at("x_axis.force", 6138.365, digits=0) == "something is still missing at x_axis.force, where next to nothing acts"


def test_beside_next_to_nothing_there_is_no_share() -> None:
    assert known_share(0.173) == 0.173
    assert all(math.isnan(known_share(share)) for share in (6138.365, math.nan, math.inf))
