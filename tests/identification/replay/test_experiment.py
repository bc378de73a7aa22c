"""Experiments of a recording: as long as a Fourier transform takes quickly, and which motion the effects in it sense."""

from pathlib import Path

import numpy as np
import pytest

from lathesim.effects.friction import CoulombFriction
from lathesim.effects.lag import MotorInductance
from lathesim.identification.replay.experiment import build_experiments, quickly_transformed
from lathesim.identification.replay.open_loop import sensed_share
from lathesim.record import Channel, Record
from tests.diagnosis.controlled_axis import controlled_axis


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


def test_a_winding_senses_the_simulated_motion_and_a_friction_the_recorded_one(tmp_path: Path) -> None:
    """What a winding adds of a velocity cancels what its drive takes away: the counts of an encoder would not."""
    machine, record = controlled_axis(tmp_path)
    (experiment,) = build_experiments(machine, [("run.csv", record)], (CoulombFriction, MotorInductance))
    friction, winding = sorted(experiment.candidates, key=lambda candidate: candidate.name)
    assert (friction.effect, winding.effect) == (CoulombFriction, MotorInductance)
    assert sensed_share(f"{friction.part}.flow") in experiment.sensed.plan.parameters
    assert sensed_share(f"{winding.part}.flow") not in experiment.sensed.plan.parameters
