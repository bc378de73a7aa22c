"""The recorded numbers of a run: block after block, of known and of unknown length."""

from __future__ import annotations

import numpy as np
import pytest

from lathesim.engine.run_arrays import RecordedValues


@pytest.mark.parametrize("expected", [0, 3, 10, 100])
def test_blocks_are_put_one_behind_the_other(expected: int) -> None:
    whole = np.arange(20.0).reshape(2, 10)
    recorded = RecordedValues(2, expected)
    scratch = np.zeros((2, 4))
    for first in range(0, 10, 4):
        block = scratch[:, : min(4, 10 - first)]
        block[:] = whole[:, first : first + 4]
        recorded.add(block)
    assert np.array_equal(recorded.values, whole)


def test_nothing_recorded_is_no_samples() -> None:
    assert RecordedValues(3, 1000).values.shape == (3, 0)
