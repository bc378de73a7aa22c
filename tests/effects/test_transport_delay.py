"""A late command: exact at the samples, and right in the mean over every step, whatever the delay."""

import numpy as np
import pytest

from lathesim.components.axes import ForceAxis
from lathesim.effects.time_shift import TransportDelay
from lathesim.engine.assembly import Assembly, Part, Wire
from lathesim.engine.run import run
from lathesim.engine.wiring import wire
from lathesim.identification.replay.recorded_parts import HeldSignal
from lathesim.lessons.insertion import insert_effect
from lathesim.record import Record

MASS, PERIOD, SAMPLES = 2.0, 1e-3, 40
FORCES = np.random.default_rng(4).normal(size=SAMPLES)


def pushed(delay: float, steps: int) -> Record:
    """Return the run of a mass without friction, pushed by forces that are held over a sample and come late."""
    push = Part("push", HeldSignal.with_units({"signal": "N"}), tables={"recorded": FORCES.reshape(-1, 1)})
    parts = (push, Part("x_axis", ForceAxis, {"mass": MASS, "viscous": 0.0}))
    channels = ("late.outgoing", "x_axis.velocity")
    bare = Assembly(parts, (Wire("x_axis.force", "push.value"),), PERIOD, PERIOD / steps, record=channels)
    return run(
        wire(insert_effect(bare, TransportDelay, "x_axis", name="late", parameters={"delay": delay})), duration=(SAMPLES - 1) * PERIOD
    )


def late(delay: float, time: np.ndarray) -> np.ndarray:
    """Return the force that acts at some times: what was held then, so long ago."""
    place = np.floor((time - delay) / PERIOD + 1e-9).astype(int)
    return FORCES[np.maximum(place, 0)]


@pytest.mark.parametrize("steps", [1, 2, 4])
@pytest.mark.parametrize("delay", [0.05e-3, 0.25e-3, 0.731e-3, 1e-3, 2.5e-3, 3.98e-3])
def test_what_acts_at_a_sample_and_the_impulse_between_samples_are_right(delay: float, steps: int) -> None:
    found = pushed(delay, steps)
    assert found["late.outgoing"] == pytest.approx(late(delay, found.time), abs=1e-12)
    fine = np.arange(0.0, found.time[-1], PERIOD / 1000) + PERIOD / 2000
    impulse = np.concatenate([[0.0], np.cumsum(late(delay, fine).reshape(-1, 1000).mean(axis=1)) * PERIOD])
    assert found["x_axis.velocity"] == pytest.approx(impulse / MASS, abs=2e-6)
