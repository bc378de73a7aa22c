"""A search for what explains the motion is over where the effects that grew do not explain it: what is left is not held against rivals."""

from __future__ import annotations

import numpy as np

from lathesim.diagnosis.explaining.search import explain, explains_the_motion
from lathesim.effects.friction import CoulombFriction
from tests.diagnosis.pushed_table import Hidden, experiments, recording, study


def swinging(speed: float, place: float, time: float) -> float:
    """Return a force that swings slowly [N]; it moves the table further than the recorded force does."""
    return float(18.0 * np.sin(0.8 * np.pi * time * (1.0 + 0.2 * time)))


def test_what_does_not_explain_the_motion_has_no_rivals() -> None:
    hidden = Hidden(dry=30.0, law=swinging)
    halves = experiments(*(recording(hidden, count=1000, seed=seed) for seed in (1, 2)), effects=(CoulombFriction,))
    asked = study(*(half.by_output_error() for half in halves))
    found, whole = explain(asked, of_motion=True), explain(asked)
    assert [one.name for one in found.model.candidates] == [one.name for one in whole.model.candidates] == ["CoulombFriction"]
    assert not explains_the_motion(asked, found.model)
    assert found.complete
    assert (len(found.worth), len(whole.worth)) == (0, 1)
