"""How often an axis turns round."""

import numpy as np
import pytest

from lathesim.analysis.turning_metrics import reversals


@pytest.mark.parametrize(
    ("places", "turns"),
    [
        ([0.0, 1.0, 2.0, 2.0, 3.0], 0),
        ([0.0, 0.0, -1.0, -2.0], 0),
        ([0.0, 1.0, 0.5, 0.5, 0.0, 2.0], 2),
        ([0.0, 1.0, 1.0 - 1e-6, 2.0], 0),
        ([5.0], 0),
    ],
)
def test_turns_are_counted_and_rounding_is_none(places: list[float], turns: int) -> None:
    assert reversals(1e-2 * np.array(places)) == turns
