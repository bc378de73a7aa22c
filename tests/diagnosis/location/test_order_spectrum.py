"""Lines of a residual that are no one's: the spacing of the samples along the way."""

import numpy as np
import pytest

from lathesim.diagnosis.comparison.compare_text import _chain
from lathesim.diagnosis.location.order_spectrum import Line, _is_of_the_samples

STEP = 0.5e-3
"""Way from sample to sample where the axis is fast [m]."""
WAY = np.cumsum(np.r_[np.linspace(0.0, STEP, 300), np.full(400, STEP), np.linspace(STEP, 0.0, 300)])


@pytest.mark.parametrize(
    ("variable", "spacing", "of_the_samples"),
    [
        ("position of x_axis", STEP, True),
        ("position of x_axis", STEP / 2.0, True),
        ("position of x_axis", 10.0 * STEP, False),
        ("position of x_axis", 1.37 * STEP, False),
        ("time", STEP, False),
    ],
    ids=["once a sample", "twice a sample", "a screw", "between", "a frequency"],
)
def test_a_line_that_repeats_from_sample_to_sample_is_none(variable: str, spacing: float, of_the_samples: bool) -> None:
    line = Line(variable, "m", 1.0 / spacing, 1.0, 0.1)
    assert _is_of_the_samples(line, WAY) == of_the_samples


def test_of_a_whole_machine_the_nearest_parts_of_a_chain_are_told() -> None:
    assert _chain(("x_encoder", "x_axis", "x_drive"), 4) == "x_encoder <- x_axis <- x_drive"
    assert _chain(tuple("abcde"), 4) == "a <- b <- c <- d <- e"
    assert _chain(tuple("abcdefg"), 4) == "a <- b <- c <- d <- 3 more"
