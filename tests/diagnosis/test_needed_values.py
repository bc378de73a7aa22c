"""Values of an effect that neither recording needs are held at nothing."""

import numpy as np
import pytest

from lathesim.diagnosis.fit import fit
from lathesim.diagnosis.found import Found
from lathesim.diagnosis.needed_values import drop_needless_values
from lathesim.diagnosis.trial import Bench, term_free
from lathesim.effects.presliding import PreslidingFriction
from tests.diagnosis.pushed_table import Hidden, baseline, recording, rigs

LEVEL, EXCESS, SLOW = 8.0, 6.0, 0.02


def peaked(v: float, q: float, t: float) -> float:
    """A friction with a peak at low speed."""
    return float(np.tanh(v / 1e-4)) * (LEVEL + EXCESS * float(np.exp(-abs(v) / SLOW)))


@pytest.mark.parametrize(
    ("hidden", "needed"),
    [(Hidden(dry=LEVEL), {"level", "distance"}), (Hidden(law=peaked), {"level", "distance", "excess", "stribeck_velocity"})],
    ids=["a plain friction", "one with a peak at low speed"],
)
def test_a_friction_keeps_the_values_that_the_recordings_need(hidden: Hidden, needed: set[str]) -> None:
    """A peak that is not there goes, with the speed at which it would have fallen, and so does the damping of the bristles."""
    rig, held_out = rigs(recording(hidden, seed=1), recording(hidden, seed=2), effects=(PreslidingFriction,))
    bench = Bench(rig, held_out, lambda text: None)
    fitted = fit(rig.sensed, baseline(rig))
    bench.weigh(fitted)
    before = bench.model((), fitted)
    (friction,) = rig.candidates
    start = {"level": 10.0, "distance": 1e-6, "excess": 2.0, "stribeck_velocity": 0.01, "bristle_damping": 50.0}
    values = np.array([start[name.partition(".")[2]] for name in friction.parameters])
    model = bench.model((friction,), fit(rig.sensed, [*before.free, *term_free(friction, values)], rounds=4))
    found = Found(before, model)
    drop_needless_values(bench, found)
    (lean,) = found.model.terms
    assert {name.partition(".")[2] for name in lean.parameters} == needed
    assert found.model.fitted.by_name[f"{lean.part}.level"] == pytest.approx(LEVEL, rel=0.1)
    held = {name for name in friction.parameters if name not in lean.parameters}
    assert all(found.model.fitted.constant[name] == 0.0 for name in held if not name.endswith("velocity"))
