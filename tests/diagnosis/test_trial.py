"""What a trial is judged by."""

import numpy as np
import pytest

from lathesim.diagnosis.trial import _share_left


@pytest.mark.parametrize(
    ("before", "after", "share"),
    [
        ([4000.0], [400.0], 0.1),
        ([4000.0, 90000.0], [400.0, 90000.0], 0.1),
        ([4000.0, 90000.0], [400.0, 120000.0], 120400.0 / 94000.0),
        ([4000.0, 41.0], [400.0, 50.0], 0.1),
        ([4000.0, 1.0], [400.0, 900.0], 1300.0 / 4001.0),
    ],
    ids=["one channel", "a screw that has nothing to do with it", "another is worse", "hardly anything in one", "and much there after"],
)
def test_what_is_left_is_told_where_it_is_least(before: list[float], after: list[float], share: float) -> None:
    assert _share_left(np.array(before), np.array(after)) == pytest.approx(share)
