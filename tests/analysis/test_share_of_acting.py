"""Shares of what acts: none where next to nothing acts."""

import math

from lathesim.analysis.display_unit import known_share


def test_beside_next_to_nothing_there_is_no_share() -> None:
    assert known_share(0.173) == 0.173
    assert all(math.isnan(known_share(share)) for share in (6138.365, math.nan, math.inf))
