"""A play before the only sensor: the recorded motion has crossed it already."""

import numpy as np
import pytest

from lathesim.effects.backlash_and_screw import Backlash
from lathesim.effects.friction import CoulombFriction
from lathesim.record import Record
from tests.diagnosis.pushed_table import FORCE, MASS, POSITION, RESOLUTION, Hidden, as_record, experiments, motion, searched


def behind_play(seed: int, width: float) -> Record:
    """Return a recording of the table whose encoder sits behind a play."""
    pushed, place = motion(Hidden(), 2000, seed, 60.0)
    seen, behind = np.empty_like(place), 0.0
    for sample, before in enumerate(place):
        behind = min(max(behind, before - 0.5 * width), before + 0.5 * width)
        seen[sample] = behind
    return as_record({FORCE: ("N", pushed.copy()), POSITION: ("m", np.round(seen / RESOLUTION) * RESOLUTION)})


@pytest.mark.parametrize("width", [20e-6, 100e-6])
def test_a_play_before_the_only_sensor_is_found_with_its_width(width: float) -> None:
    first, second = experiments(behind_play(1, width), behind_play(2, width), effects=(Backlash, CoulombFriction))
    model = searched(first, second).model
    (play,) = model.candidates
    assert play.name == "Backlash"
    assert model.fitted.by_name[play.parameters[0]] == pytest.approx(width, rel=1e-3)
    assert model.fitted.by_name["x_axis.mass"] == pytest.approx(MASS, rel=1e-4)
