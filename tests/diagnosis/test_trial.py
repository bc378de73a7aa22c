"""What a trial is judged by."""

import dataclasses

import numpy as np
import pytest

from lathesim.diagnosis.fit import fit
from lathesim.diagnosis.trial import Bench, _share_left
from tests.diagnosis.pushed_table import Hidden, baseline, recording, rigs


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


def test_two_recordings_may_differ_in_length_and_in_how_their_noise_is_weighed() -> None:
    rig, held_out = rigs(recording(Hidden(dry=12.0), count=1200), recording(Hidden(dry=12.0), count=1000, seed=2))
    bench = Bench(rig, held_out, lambda text: None)
    started = baseline(rig)
    without, found = (fit(rig.sensed, started, {"try_x_axis_coulomb_friction.level": level}) for level in (0.0, 12.0))
    bench.weights = tuple(dataclasses.replace(noise, differences=noise.differences + 1) for noise in without.noise)
    assert bench._holds_there_too(without, without, {"try_x_axis_coulomb_friction.level": 12.0})
    assert not bench._holds_there_too(found, found, {"try_x_axis_coulomb_friction.level": 0.0})
