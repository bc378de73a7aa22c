"""The recording of a rig is as long as a Fourier transform takes quickly."""

import numpy as np
import pytest

from lathesim.identification.replay.experiment import quickly_transformed
from lathesim.record import Channel, Record


@pytest.mark.parametrize(
    ("samples", "kept"), [(30_000, 30_000), (29_999, 29_700), (28_772, 28_672), (17_001, 16_875), (11, 11)],
    ids=["as it is", "11 as a factor", "7 as a factor", "of 3 and 5", "few"],
)  # fmt: skip
def test_the_last_samples_beyond_a_quick_length_are_spared(samples: int, kept: int) -> None:
    record = Record(0.001 * np.arange(samples), {"x": Channel("x", "m", np.arange(samples) * 1.0)}, {"sample_period": 0.001})
    shorter = quickly_transformed(record)
    assert len(shorter) == kept
    assert shorter["x"].tolist() == list(range(kept))
    assert shorter.sample_period == 0.001
